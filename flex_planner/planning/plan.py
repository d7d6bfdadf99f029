"""A planned motion with its certificate."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
import os

from flex_planner.arms.arm import Arm, BeamSection, Elasticity, Joint, Link, Motor, Node
from flex_planner.arms.element_modes import ElementModes
from flex_planner.arms.kinematics import tip_position
from flex_planner.arms.mechanism import FlexibleBody
from flex_planner.arms.motion_svg import motion_svg
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import SpatialBody
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidValueError, ValueFileError
from flex_planner.base.html_view import html_view
from flex_planner.base.validation import Array
from flex_planner.base.value_files import load_value, save_value
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.boundary_conditions import BoundaryConditions
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.path_constraints import (
    BendingMoment,
    Capsule,
    Circle,
    Deflection,
    HalfPlane,
    HalfSpace,
    JointRange,
    JointSpeed,
    KeepOut,
    PathSlacks,
    SelfClearance,
    SpatialCapsule,
    Sphere,
)
from flex_planner.optimal_control.smoothed_torque_state import SmoothedTorqueState
from flex_planner.optimal_control.state_layout import StateLayout
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_conditions import ChosenTorque, TorqueState
from flex_planner.optimal_control.torque_ends import TorqueEnds
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.optimal_control.torque_offset import OffsetProblem, TorqueOffset
from flex_planner.optimal_control.torque_slacks import TorqueSlacks
from flex_planner.optimal_control.via_conditions import ViaConditions
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.certificate import Certificate
from flex_planner.planning.constraint_margins import ConstraintMargin
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.kinds.explorer import ExploredMotion
from flex_planner.planning.objectives import (
    Margin,
    Objective,
    Objectives,
    ObjectiveSearch,
    WeightTrial,
)
from flex_planner.planning.robust.objective import Robustness, RobustSearch, RobustTrial
from flex_planner.planning.strategies.try_strategies import TriedStrategy
from flex_planner.planning.warnings import PlanWarning, WarningKind
import numpy as np
from numpy.typing import ArrayLike

# share of its duration by which a time may be past an end of the motion
_ROUNDING = 1e-12
_SHOWN = 101  # instants in small pictures


class PlanStatus(Enum):
    """How planning ended; the value is shown to people."""

    SOLVED = 'solved and certified'
    NOT_CONVERGED = 'not converged, which does not show that the motion is impossible'
    NOT_FOUND = 'no motion found'
    INFEASIBLE = 'impossible for every motion'
    CERTIFICATE_FAILED = 'converged, but the re-simulated motion misses its tolerances'
    LIMIT_VIOLATED = 'solved, but the motion leaves a limit of the arm on its way'
    BENT_TOO_FAR = 'solved, but links bend further than the model of the arm holds'
    OBJECTIVE_NOT_MET = 'an objective cannot be met, this is the closest motion'
    TIMEOUT = 'time limit reached'
    CANCELED = 'canceled'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """
    A plan at chosen times.

    Attributes
    ----------
    times : numpy.ndarray, shape (k,)
        [s].
    coordinates, rates, accelerations : numpy.ndarray, shape (k, n_t)
        q, q', q'': joints [rad], then modes [m].
    torques : numpy.ndarray, shape (k, n)
        [N m].
    lower_bounds, upper_bounds : numpy.ndarray, shape (k, n)
        Of the torques at those speeds, eq. (15) [N m].
    position_costates, velocity_costates : numpy.ndarray, shape (k, n_t)
        psi_1 and psi_2.
    torque_costates : numpy.ndarray, shape (k, n), or (k, 0) where torques are no states
        psi_tau.
    hamiltonian : numpy.ndarray, shape (k,)
        H of eq. (8).
    tip : numpy.ndarray, shape (k, 2), or (k, 3) of a spatial arm
        Tip of the bent arm [m].

    """

    times: Array
    coordinates: Array
    rates: Array
    accelerations: Array
    torques: Array
    lower_bounds: Array
    upper_bounds: Array
    position_costates: Array
    velocity_costates: Array
    torque_costates: Array
    hamiltonian: Array
    tip: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Plan:
    """
    The outcome of planning one task, whether it succeeded or not.

    Attributes
    ----------
    task : Task
        What was asked.
    status : PlanStatus
        Only ``SOLVED`` plans may be executed.
    message : str
        The status in more words.
    strategy : str
        What led to the solution.
    problem : MotionProblem
        The boundary-value problem.
    solution : CollocationSolution or None
        None unless a solution was found.
    certificate : Certificate
        Residuals.
    cost : float
        J of eq. (6), with the price of torque rates where they have one.
    effort : float
        Integral of the squared torques [N^2 m^2 s].
    energy : float
        Integral of the absolute mechanical power of the motors [J].
    switching_times : numpy.ndarray
        When a motor reaches or leaves its limit [s].
    saturation : numpy.ndarray, shape (n,)
        Share of the time that each motor spends on its limit.
    constraints : tuple of ConstraintMargin
        How near the motion comes to each limit on the way; empty without limits or solution.
    torque_rates : numpy.ndarray, shape (n,)
        Largest rates of the torques [N m/s]; empty where torques may jump.
    barrier_gap : float
        Number of limits times mu times duration, where limits bent the motion: by at most so much
        J is above the least where the task is convex, which motions of arms are not; where it was
        measured, J was nearer by far.
    kinds : tuple of KindOfMotion
        Kinds of motion that were met, at most four, that of the plan first; values of the others
        are of the arm made rigid.
    starts : int
        How many starts led to them.
    warnings : tuple of PlanWarning
        What is to be known of a certified motion; of the arm alone where there is none.
    objectives : ObjectiveSearch or None
        How objectives were met; None if there are none.
    iterations : int
        Newton iterations, failed strategies included.
    tried : tuple of TriedStrategy
        What was tried, in this order, and how long it took.
    planning_time : float
        [s].

    """

    task: Task
    status: PlanStatus
    message: str
    strategy: str
    problem: MotionProblem
    solution: CollocationSolution | None
    certificate: Certificate = field(default_factory=Certificate)
    cost: float = np.inf
    effort: float = np.inf
    energy: float = np.inf
    switching_times: Array = field(default_factory=lambda: np.zeros(0))
    saturation: Array = field(default_factory=lambda: np.zeros(0))
    constraints: tuple[ConstraintMargin, ...] = ()
    torque_rates: Array = field(default_factory=lambda: np.zeros(0))
    barrier_gap: float = 0.0
    kinds: tuple[KindOfMotion, ...] = ()
    starts: int = 1
    warnings: tuple[PlanWarning, ...] = ()
    objectives: ObjectiveSearch | None = None
    iterations: int = 0
    tried: tuple[TriedStrategy, ...] = ()
    planning_time: float = 0.0

    @property
    def solved(self) -> bool:
        """Return whether the plan is certified and keeps the limits of its arm."""
        return self.status is PlanStatus.SOLVED

    @property
    def certified(self) -> bool:
        """Return whether the motion solves its task, even if the arm may not do it."""
        return self.status in (PlanStatus.SOLVED, PlanStatus.LIMIT_VIOLATED,
                               PlanStatus.BENT_TOO_FAR)

    @property
    def arm(self) -> Arm:
        """Return the arm."""
        return self.task.arm

    @property
    def model(self) -> ArmModel:
        """Return the arm's compiled functions."""
        return self.problem.model

    @property
    def via_times(self) -> Array:
        """Return when the via points of the task are passed, shape (K,) [s]."""
        return self.problem.junctions

    @property
    def mesh_intervals(self) -> int:
        """Return the intervals of the final mesh, 0 without a solution."""
        return self.solution.intervals if self.solution else 0

    def __repr__(self) -> str:
        """Return one line: status, arm, motion and cost."""
        task = self.task
        cost = f', J = {self.cost:.6g}' if self.solution is not None else ''
        return (f'<Plan {self.status.name}: {task.arm.name}, {task.duration:g} s, '
                f'{task.payload_mass:g} kg{cost}>')

    def _repr_html_(self) -> str:
        """Return the plan as notebooks show it."""
        return html_view(plan_view(self), self.svg())

    def svg(self) -> str:
        """Return a small picture of the motion as SVG; empty without one, and of spatial arms."""
        if self.solution is None or isinstance(self.arm, SpatialArm):
            return ''
        times = np.linspace(0, self.task.duration, _SHOWN, dtype=np.float64)
        return motion_svg(self.arm, self.solution(times)[:, :self.arm.n_coordinates])

    def save(self, path: str | os.PathLike[str]) -> None:
        """
        Write the plan to one file, whole or not at all.

        Raises
        ------
        OSError
            If the file cannot be written.

        """
        save_value(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Plan:
        """
        Return a saved plan; the compiled functions of its arm are loaded when they are needed.

        Raises
        ------
        ValueFileError
            If the file is damaged, or holds no plan.
        OSError
            If it cannot be read.

        """
        found = load_value(path, _SAVED)
        if not isinstance(found, Plan):
            raise ValueFileError(f'{path} holds a {type(found).__name__}, but must hold a Plan')
        return found

    def sample(self, times: ArrayLike) -> Samples:
        """
        Return the motion at times (k,) from 0 to the task's duration.

        Raises
        ------
        InvalidValueError
            If a time is not a number within the motion.
        ValueError
            If the plan has no solution.

        """
        if self.solution is None:
            raise ValueError(f'the plan has no solution: {self.message}')
        times = self._within(times)
        arm, z = self.arm, self.solution(times)
        n_t = arm.n_coordinates
        control = self.problem.controls(times, z)
        lower, upper = TorqueLimits.of(arm).bounds(z[:, n_t:n_t + arm.n_joints])
        return Samples(
            times=times, coordinates=z[:, :n_t], rates=z[:, n_t:2 * n_t],
            accelerations=control.acceleration, torques=control.torque, lower_bounds=lower,
            upper_bounds=upper, position_costates=z[:, 2 * n_t:3 * n_t],
            velocity_costates=z[:, 3 * n_t:4 * n_t],
            torque_costates=z[:, self.problem.layout.torque_costate_slice],
            hamiltonian=control.hamiltonian,
            tip=tip_position(arm, z[:, :n_t]))

    def torques(self, times: ArrayLike) -> Array:
        """Return the torques of `sample`, which takes longer, shape (k, n) [N m]."""
        if self.solution is None:
            raise ValueError(f'the plan has no solution: {self.message}')
        times = self._within(times)
        torques: Array = self.problem.controls(times, self.solution(times)).torque
        return torques

    def _within(self, times: ArrayLike) -> Array:
        """Return times (k,) after a check that the motion lasts so long."""
        end = self.task.duration
        try:
            given = np.atleast_1d(np.asarray(times, dtype=float))
        except (TypeError, ValueError):
            given = np.zeros((0, 0))
        if given.ndim != 1:
            raise InvalidValueError('times', times, 'a list of numbers')
        outside = np.flatnonzero(~(np.abs(given - end / 2) <= end * (0.5 + _ROUNDING)))
        if outside.size:
            k = int(outside[0])
            raise InvalidValueError(f'times[{k}]', float(given[k]), f'from 0 to {end:g} s')
        return np.clip(given, 0.0, end)

    def uniform_samples(self, count: int) -> Samples:
        """Return the motion at evenly spaced times, both ends included."""
        return self.sample(np.linspace(0, self.task.duration, count, dtype=np.float64))


# what a file of a plan may hold
_SAVED = (Plan, PlanStatus, Certificate, Task, Arm, Link, BeamSection, Joint, Elasticity, Motor,
          Node, SpatialArm, SpatialLink, SpatialBeam, SpatialBody, SpatialJoint, ElementModes,
          FlexibleBody, ArmModel, MotionProblem, BoundaryConditions, Parameters,
          CollocationSolution, GaussRule,
          ObjectiveSearch, Objectives, Objective, WeightTrial, Margin, KindOfMotion,
          ExploredMotion, PlanWarning, WarningKind, TriedStrategy, ConstraintMargin,
          ConstrainedMotion, PathSlacks, JointRange, JointSpeed, KeepOut, Circle, Capsule,
          HalfPlane, Sphere, SpatialCapsule, HalfSpace, SelfClearance, BendingMoment,
          Deflection, ViaPoint, ViaConditions,
          StateLayout, ChosenTorque, TorqueState, SmoothedTorqueState, TorqueEnds,
          TorqueSlacks, TorqueLimits,
          OffsetProblem, TorqueOffset, Robustness, RobustSearch, RobustTrial, JointController,
          Gains, EffortHold)


def plan_view(plan: Plan) -> list[tuple[str, str]]:
    """Return the rows of a plan in a notebook."""
    task, proof = plan.task, plan.certificate
    rows = [('arm', task.arm.name), ('status', plan.status.value),
            ('motion', f'{task.duration:g} s with {task.payload_mass:g} kg')]
    if plan.solution is None:
        return [*rows, ('why', plan.message)]
    return [
        *rows, ('cost J', f'{plan.cost:.6g}'), ('strategy', plan.strategy),
        ('planned in', f'{plan.planning_time:.2f} s'),
        ('re-simulated tip error', f'{proof.tip_error * 1e3:.1e} mm'),
        ('residual vibration', f'{proof.residual_vibration * 1e3:.1e} mm'),
        *(('warning', warning.sentence) for warning in plan.warnings)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Peaks:
    """
    Largest speeds and torques of a motion, per joint.

    Attributes
    ----------
    speeds : numpy.ndarray, shape (n,)
        [rad/s].
    speed_shares : numpy.ndarray, shape (n,)
        Of the no-load speed; 0 where there is none.
    torques : numpy.ndarray, shape (n,)
        [N m].
    torque_shares : numpy.ndarray, shape (n,)
        Of the bound in that direction at that speed; 0 where there is none.

    """

    speeds: Array
    speed_shares: Array
    torques: Array
    torque_shares: Array


def peaks(plan: Plan, samples: Samples) -> Peaks:
    """Return the largest speeds and torques of a sampled plan."""
    n = plan.arm.n_joints
    speeds = np.abs(samples.rates[:, :n])
    no_load = np.array([joint.motor.no_load_speed for joint in plan.arm.joints])
    bounds = TorqueLimits.of(plan.arm).toward(samples.torques, samples.rates[:, :n])
    torques = np.abs(samples.torques)
    return Peaks(speeds=speeds.max(axis=0), speed_shares=(speeds / no_load).max(axis=0),
                 torques=torques.max(axis=0), torque_shares=(torques / bounds).max(axis=0))
