"""How arms arrive that differ from their model, and how their links bend after it."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_bends, tip_jacobian, twist_levers
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.extent import peak_to_peak
from flex_planner.control.held_periods import HeldPeriods
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.control.linearisation import hold_inputs, linearise_dynamics
from flex_planner.dynamics.statics import equilibrium
from flex_planner.planning.execution import Execution
from flex_planner.planning.plan import Plan
from flex_planner.planning.published_motion import PublishedMotion
from flex_planner.planning.robust.objective import WATCHED
import numpy as np

# beyond the arrival, so that a hold that follows it is part of the trajectory
_PERIODS_AFTER = 3
# of the deflections of a link: every so many of its stations is looked at
_STRIDE = 4


def tabulate_reference(plan: Plan, controller: JointController) -> JointReference:
    """Return the trajectory of a plan with a point at every update of its controller."""
    motion, n = PublishedMotion.of(plan, controller, controller.period), plan.arm.n_joints
    count = int(np.ceil(plan.task.duration / controller.period - 1e-6)) + _PERIODS_AFTER
    times = np.arange(count, dtype=np.float64) * controller.period
    samples = motion.samples(times)
    positions, velocities = motion.joints_of(samples, times)
    return JointReference(times=times, positions=positions, velocities=velocities,
                          accelerations=samples.accelerations[:, :n],
                          torques=motion.torque(times))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ringing:
    """
    How an arm rings about its goal under its controller, by equations linearised there.

    Attributes
    ----------
    rest : numpy.ndarray, shape (2 n_t,)
        The state that the controller leads it to.
    near : numpy.ndarray, shape (l, 2 n_t, 2 n_t)
        What 0 to l - 1 periods of the controller make of a state less `rest`.
    far : numpy.ndarray, shape (l, n_f, 2 n_t)
        What so many times l periods make of the coordinates without a motor.
    instants : int
        Of the second after it, a period apart; at most l^2.
    shapes : tuple of numpy.ndarray, shape (k, 1 to 3, n_f)
        From these coordinates to the deflections of k points: of links, along a line or in a
        plane, of the stretched arm's tip by elastic joints, and of the tip in space of an arm
        there.

    """

    rest: Array
    near: Array
    far: Array
    instants: int
    shapes: tuple[Array, ...]

    @classmethod
    def of(cls, execution: Execution, goal: Array, hold: Array) -> Ringing:
        """
        Return the ringing of an arm at joint angles (n,) under torques (n,) that should hold it.

        Raises
        ------
        NoEquilibriumError
            If the arm buckles there.

        """
        arm = execution.dynamics.arm
        rest, period = _rest_and_period(execution, goal, hold)
        instants = int(np.ceil(WATCHED / execution.controller.period - 1e-6)) + 1
        with np.errstate(over='ignore', invalid='ignore'):  # of a controller that is unstable
            near = _powers(period, int(np.ceil(np.sqrt(instants))))
            far = _powers(near[-1] @ period, len(near))[:, arm.n_joints:arm.n_coordinates]
        return cls(rest=rest, near=near, far=far, instants=instants,
                   shapes=tuple(_deflections(arm, rest)))

    def residual(self, away: Array) -> float:
        """Return the largest peak-to-peak deflection from a state less the rest (2 n_t,) [m]."""
        if not np.isfinite(away).all():
            return np.inf
        with np.errstate(over='ignore', invalid='ignore'):
            passive = (self.far @ (self.near @ away).T).transpose(1, 0, 2).reshape(
                self.far.shape[1], -1)[:, :self.instants]
        extents = [peak_to_peak((part @ passive).transpose(2, 0, 1)) for part in self.shapes]
        return float(np.nan_to_num(extents, nan=np.inf).max())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arrival:
    """
    An arm on its way and after it.

    Attributes
    ----------
    execution : Execution
        By that arm.
    ringing : Ringing
        Of it.
    times, states : numpy.ndarray, shape (m + 1,) and (m + 1, 2 n_t)
        Updates of the controller up to the first at or after the arrival [s].

    """

    execution: Execution
    ringing: Ringing
    times: Array
    states: Array

    @classmethod
    def of(cls, execution: Execution, ringing: Ringing, trajectory: HeldPeriods,
           monitor: Monitor | None = None) -> Arrival:
        """
        Return how an arm arrives that follows a trajectory.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        motion = trajectory.follow(execution.arm, execution.start, monitor)
        return cls(execution=execution, ringing=ringing, times=motion.times,
                   states=motion.states)

    @property
    def away(self) -> Array:
        """Return the state on arrival less the rest, shape (2 n_t,)."""
        away: Array = self.states[-1] - self.ringing.rest
        return away

    @property
    def residual(self) -> float:
        """Return the peak-to-peak deflection in the second after it, where it is largest [m]."""
        return self.ringing.residual(self.away)


def _powers(matrix: Array, count: int) -> Array:
    """Return the powers 0 to count - 1 of a matrix (m, m), shape (count, m, m)."""
    powers = np.eye(len(matrix))[None]
    while len(powers) < count:  # twice as many each time
        powers = np.concatenate([powers, powers @ matrix])
        matrix = matrix @ matrix
    return powers[:count]


def _rest_and_period(execution: Execution, goal: Array, hold: Array) -> tuple[Array, Array]:
    """Return where an arm comes to rest under its controller, and what a period makes of it."""
    dynamics, gains = execution.dynamics, execution.controller.gains
    n, n_t = dynamics.arm.n_joints, dynamics.arm.n_coordinates
    rest, _ = equilibrium(dynamics, goal, execution.parameters)
    state, physical = np.concatenate([rest, np.zeros(n_t)]), execution.parameters.physical
    A, B = (part[0] for part in linearise_dynamics(dynamics, state[None], hold[None], physical))
    feedback = np.zeros((n, 2 * n_t))
    feedback[:, :n], feedback[:, n_t:n_t + n] = np.diag(gains.stiffness), np.diag(gains.damping)
    rate = dynamics.forward_dynamics(state[None], hold[None], physical)[0]
    state = state - np.linalg.lstsq(A - B @ feedback, rate, rcond=None)[0]
    free, forced = hold_inputs(A, B, execution.controller.period)
    return state, free - forced @ feedback


def _deflections(arm: Arm, rest: Array) -> list[Array]:
    """
    Return what makes deflections of passive coordinates, shape (k, 1 to 3, n_f) each.

    Of links; beyond elastic joints; and of a spatial arm, whose links may twist, of its tip.

    """
    n, n_t, size = arm.n_joints, arm.n_coordinates, arm.n_passive
    parts = [_of_modes(arm, i) for i, link in enumerate(arm.links) if link.modes]
    if arm.elastic_joints:
        twisted = np.eye(len(arm.elastic_joints), size) * twist_levers(arm)[:, None]
        parts.append(twisted[:, None])
    if isinstance(arm, SpatialArm):
        parts.append(tip_jacobian(arm, rest[:n_t])[None, :, n:])
    return parts


def _of_modes(arm: Arm, index: int) -> Array:
    """Return the deflections of a link's stations by the passive coordinates, (k, 1 or 2, m)."""
    modal = np.eye(arm.n_coordinates)[arm.modal_slices[index], arm.n_joints:]
    return link_bends(arm, index, modal)[::_STRIDE]
