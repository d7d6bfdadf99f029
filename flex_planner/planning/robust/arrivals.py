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
    motion = PublishedMotion.of(plan, controller, controller.period)
    count = int(np.ceil(plan.task.duration / controller.period - 1e-6)) + _PERIODS_AFTER
    times = np.arange(count, dtype=np.float64) * controller.period
    positions, velocities = motion.motion(times)
    accelerations = motion.samples(times).accelerations[:, :plan.arm.n_joints]
    return JointReference(times=times, positions=positions, velocities=velocities,
                          accelerations=accelerations, torques=motion.torque(times))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ringing:
    """
    How an arm rings about its goal under its controller, by equations linearised there.

    Attributes
    ----------
    rest : numpy.ndarray, shape (2 n_t,)
        The state that the controller leads it to.
    passive : numpy.ndarray, shape (n_f, instants, 2 n_t)
        From a state less `rest` to the coordinates without a motor in the second after it, at
        updates of the controller.
    shapes : tuple of numpy.ndarray, shape (k, 1 to 3, n_f)
        From these coordinates to the deflections of k points: of links, along a line or in a
        plane, of the stretched arm's tip by elastic joints, and of the tip in space of an arm
        there.

    """

    rest: Array
    passive: Array
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
        rest, power = _rest_and_period(execution, goal, hold)
        rows = np.eye(rest.size)[arm.n_joints:arm.n_coordinates, None]
        count = int(np.ceil(WATCHED / execution.controller.period - 1e-6)) + 1
        while rows.shape[1] < count:  # twice as many instants each time
            rows = np.concatenate([rows, rows @ power], axis=1)
            power = power @ power
        return cls(rest=rest, passive=rows[:, :count], shapes=tuple(_deflections(arm, rest)))

    def residual(self, away: Array) -> float:
        """Return the largest peak-to-peak deflection from a state less the rest (2 n_t,) [m]."""
        if not np.isfinite(away).all():
            return np.inf
        passive = self.passive @ away
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
