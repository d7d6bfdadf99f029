"""The trajectory that is published, carried out by the arm's model under its joint controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import groupby

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint_units import TURNING, units_of
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import ControlledArm, ControlledMotion, locked_bending
from flex_planner.control.feedback_stability import feedback_growth
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.control.joint_reference import Reference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.planning.executed_limits import ExecutedSlack, find_executed_slack
from flex_planner.planning.plan import Plan
from flex_planner.planning.uncertainty import ASSUMED_ERROR
import numpy as np

# of the joint angles at the start, to see what becomes of it [rad]
_SMALL = 1e-6
# faster than this the PD shakes the arm [1/s]; slower growth is that of vibrations which neither
# the model nor the PD damps
UNSTABLE_GROWTH = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExecutionCertificate:
    """
    Where a joint controller brings the arm with the published points; ``inf`` if it runs away.

    All of it at the first update of the controller at or after the planned arrival, but for the
    limits on the way, which are looked at until then.

    Attributes
    ----------
    tip_error : float
        Distance of the tip from the goal, with the PD [m].
    residual_vibration : float
        Largest bending if the joints were locked then, with the PD [m].
    open_loop_tip_error, open_loop_residual_vibration : float
        The same under the efforts alone [m].
    open_loop_amplification : float
        By how much a small error of a joint angle at the start grows until then under the
        efforts alone; of the joint that is worst.
    feedback_growth : float
        How fast deviations grow under the PD at the postures of the motion, negative if they die
        away [1/s].
    limits : ExecutedSlack
        What limits on the way leave of the motion, with the PD.
    controller : JointController
        That did it.

    """

    controller: JointController
    tip_error: float = np.inf
    residual_vibration: float = np.inf
    open_loop_tip_error: float = np.inf
    open_loop_residual_vibration: float = np.inf
    open_loop_amplification: float = np.inf
    feedback_growth: float = np.inf
    limits: ExecutedSlack = ExecutedSlack(-np.inf)

    @property
    def limit_slack(self) -> float:
        """Return the smallest slack on the way; inf without limits, -inf if not known."""
        return self.limits.slack


@dataclass(frozen=True, slots=True, kw_only=True)
class RobustnessReport:
    """
    Residual vibration of the same trajectory on other arms, with the PD; ``inf`` if they run away.

    Attributes
    ----------
    nominal : float
        Of the arm that was planned for, `ExecutionCertificate.residual_vibration` [m].
    more_modes : float
        With two more modes for every link that has any, at most 8; 0 for rigid links [m].
    stiffness_differs, payload_differs : float
        With less and with more of E I, or of mass and inertia of the payload: the larger of the
        two; the nominal one where there are neither modes nor a payload [m].
    more_modes_growth : float
        How fast deviations grow under the PD with more modes, as
        `ExecutionCertificate.feedback_growth` [1/s].
    stiffness_difference, payload_difference : float
        By which share, see `Uncertainty`.

    """

    nominal: float
    more_modes: float
    stiffness_differs: float
    payload_differs: float
    more_modes_growth: float
    stiffness_difference: float = ASSUMED_ERROR
    payload_difference: float = ASSUMED_ERROR


@dataclass(frozen=True, slots=True, kw_only=True)
class ExecutionLimits:
    """
    What an execution must not exceed, with the PD, for a trajectory to be published.

    Attributes
    ----------
    tip_error, residual_vibration : float
        As shares of the arm's reach: an arm that ends further away does not do what was planned.
        The points themselves cost less than the limits of `CertificateLimits`. What is left is
        that torques are held: at 1 kHz, with efforts in the middle of their periods, 1e-7 to
        1e-4 for most arms, and up to 3e-3 for fast ones whose joints turn next to nothing.

    """

    tip_error: float = 5e-3
    residual_vibration: float = 5e-3

    def violations(self, certificate: ExecutionCertificate, reach: float,
                   arm: Arm | None = None) -> list[str]:
        """Return a sentence for each limit that is not met; gains have the units of the arm."""
        pairs = ((entry.name.replace('_', ' '), getattr(certificate, entry.name),
                  getattr(self, entry.name) * reach) for entry in fields(self))
        found = [f'executed {name} is {value:.3g} m, but must be <= {limit:.3g} m'
                 for name, value, limit in pairs if not value <= limit]
        if found and certificate.feedback_growth > UNSTABLE_GROWTH:
            found.append(unstable_feedback(certificate.controller, certificate.feedback_growth,
                                           arm))
        return found


def unstable_feedback(controller: JointController, growth: float,
                      arm: Arm | None = None) -> str:
    """Return a sentence on a PD that is unstable."""
    return (f'the PD of the joints ({describe_controller(controller, arm)}) is unstable: '
            f'deviations double within {np.log(2) / growth * 1e3:.2g} ms')


def describe_controller(controller: JointController, arm: Arm | None = None) -> str:
    """Return a controller in words; without an arm all joints turn."""
    stiffness, damping = say_gains(controller.gains, arm)
    return (f'{stiffness} and {damping} at {controller.rate:g} Hz, effort_hold '
            f'{controller.hold.value}')


def say_gains(gains: Gains, arm: Arm | None = None, form: str = 'g') -> tuple[str, str]:
    """Return both gains of all joints with their units, those of joints that slide in N/m."""
    units = ([units_of(joint) for joint in arm.joints] if arm is not None
             else [TURNING] * len(gains.stiffness))
    return (_with_units(gains.stiffness, [unit.stiffness for unit in units], form),
            _with_units(gains.damping, [unit.damping for unit in units], form))


def _with_units(values: Array, units: Sequence[str], form: str) -> str:
    """Return numbers with a unit after each run of those that share it."""
    runs = [(unit, list(run)) for unit, run in groupby(
        zip(values, units, strict=True), lambda pair: pair[1])]
    return ', '.join(f'{", ".join(f"{value:{form}}" for value, _ in run)} {unit}'
                     for unit, run in runs)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Execution:
    """
    A trajectory with the arm that carries it out.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    parameters : PhysicalParameters
        Of the arm.
    start : numpy.ndarray, shape (2 n_t,)
        Its state when the motion begins.
    duration : float
        Of the trajectory up to the arrival [s].
    goal : numpy.ndarray, shape (2,)
        Where the tip should arrive [m].
    controller : JointController
        Of the joints.

    """

    dynamics: ArmDynamics
    parameters: PhysicalParameters
    start: Array
    duration: float
    goal: Array
    controller: JointController

    @classmethod
    def of(cls, plan: Plan, controller: JointController, begin: float = 0.0) -> Execution:
        """Return the execution of a plan, held up to a time, by the arm that it was made for."""
        goal = tip_position(plan.arm, plan.problem.goal[None, :plan.arm.n_coordinates])[0]
        return Execution(dynamics=plan.model, parameters=plan.problem.parameters,
                         start=plan.problem.start, duration=begin + plan.task.duration, goal=goal,
                         controller=controller)

    @property
    def arm(self) -> ControlledArm:
        """Return the arm under its controller."""
        return ControlledArm(dynamics=self.dynamics, parameters=self.parameters,
                             controller=self.controller)

    @property
    def open_loop(self) -> Execution:
        """Return the execution by efforts alone."""
        none = Gains.of(self.dynamics.arm.n_joints, 0.0, 0.0)
        return replace(self, controller=replace(self.controller, gains=none))

    def arrive(self, reference: Reference, monitor: Monitor | None = None) -> Array:
        """Return the state on arrival, shape (2 n_t,); NaN if the arm has run away."""
        state: Array = self.carry_out(reference, monitor).states[-1]
        return state

    def carry_out(self, reference: Reference, monitor: Monitor | None = None) -> ControlledMotion:
        """Return the motion up to the arrival; NaN from where the arm has run away."""
        return self.arm.follow(reference, self.start, self.duration, monitor)

    def tip(self, state: Array) -> Array:
        """Return the tip in a state, shape (2,) [m]."""
        tip: Array = tip_position(self.dynamics.arm,
                                  state[None, :self.dynamics.arm.n_coordinates])[0]
        return tip

    def tip_error(self, state: Array) -> float:
        """Return the distance of the tip from its goal; infinite if the arm has run away [m]."""
        distance = np.linalg.norm(self.tip(state) - self.goal)
        return float(np.nan_to_num(distance, nan=np.inf))

    def vibration(self, state: Array) -> float:
        """Return the residual vibration of a state [m]."""
        return locked_bending(self.dynamics, state, self.parameters)

    def amplification(self, reference: Reference, arrived: Array,
                      monitor: Monitor | None = None) -> float:
        """Return what becomes of small errors of the joints at the start; 1 leaves them."""
        n, largest = self.dynamics.arm.n_joints, 0.0
        for joint in range(n):
            moved = self.start.copy()
            moved[joint] += _SMALL
            change = (replace(self, start=moved).arrive(reference, monitor) - arrived)[:n]
            largest = max(largest, float(np.nan_to_num(np.abs(change).max(), nan=np.inf)))
        return largest / _SMALL


def certify_execution(execution: Execution, reference: Reference, positions: Array,
                      monitor: Monitor | None = None, *,
                      slacks: PathSlacks | None = None) -> ExecutionCertificate:
    """
    Return the certificate of a trajectory.

    Parameters
    ----------
    execution : Execution
        With n joints.
    reference : Reference
        The trajectory.
    positions : numpy.ndarray, shape (k, n)
        Joint angles of the motion, at which the stability of the PD is looked at [rad].
    monitor : Monitor, optional
        May stop it.
    slacks : PathSlacks, optional
        Of the limits on the way; none by default.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    motion, free = execution.carry_out(reference, monitor), execution.open_loop
    arrived = motion.states[-1]
    drifted = free.arrive(reference, monitor)
    return ExecutionCertificate(
        controller=execution.controller, tip_error=execution.tip_error(arrived),
        residual_vibration=execution.vibration(arrived),
        open_loop_tip_error=free.tip_error(drifted),
        open_loop_residual_vibration=free.vibration(drifted),
        open_loop_amplification=free.amplification(reference, drifted, monitor),
        feedback_growth=feedback_growth(execution.arm, positions),
        limits=find_executed_slack(slacks, motion))
