"""How arms arrive that differ from their model, and how their links bend after it."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_deflections
from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.statics import equilibrium
from flex_planner.planning.execution import Execution
from flex_planner.planning.plan import Plan
from flex_planner.planning.published_motion import PublishedMotion
from flex_planner.planning.robust.linearisation import hold_inputs, linearise_dynamics
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
class Arrival:
    """
    An arm on its way and after it.

    Attributes
    ----------
    execution : Execution
        By that arm.
    times, states : numpy.ndarray, shape (m + 1,) and (m + 1, 2 n_t)
        Updates of the controller up to the first at or after the arrival [s].
    ringing : numpy.ndarray, shape (r, 2 n_t)
        From the state on arrival less `rest` to deflections of links at instants of the second
        after it; deflections of one point follow one another.
    rest : numpy.ndarray, shape (2 n_t,)
        Where the controller leads the arm to.
    instants : int
        How many there are.

    """

    execution: Execution
    times: Array
    states: Array
    ringing: Array
    rest: Array
    instants: int

    @property
    def residual(self) -> float:
        """Return the peak-to-peak deflection where it is largest [m]."""
        return self.residual_of(self.states[-1] - self.rest)

    def residual_of(self, away: Array) -> float:
        """Return the same of an arm that arrives so far from its rest (2 n_t,) [m]."""
        if not np.isfinite(away).all():
            return np.inf
        deflections = (self.ringing @ away).reshape(-1, self.instants)
        return float(np.nan_to_num(np.ptp(deflections, axis=1), nan=np.inf).max())


def arrive(execution: Execution, reference: JointReference,
           monitor: Monitor | None = None) -> Arrival:
    """
    Return how an arm arrives; after that, equations linearised at its rest say how it rings.

    Parameters
    ----------
    execution : Execution
        By the arm.
    reference : JointReference
        The trajectory.
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.
    NoEquilibriumError
        If the arm buckles where it should arrive.

    """
    motion = execution.arm.follow(reference, execution.start, execution.duration, monitor)
    rest, period = _rest_and_period(execution, reference)
    ringing, instants = _ringing(execution, period)
    return Arrival(execution=execution, times=motion.times, states=motion.states,
                   ringing=ringing, rest=rest, instants=instants)


def residual_bending(execution: Execution, reference: JointReference,
                     monitor: Monitor | None = None) -> float:
    """Return the residual of `arrive`; infinite for an arm that buckles [m]."""
    try:
        return arrive(execution, reference, monitor).residual
    except NoEquilibriumError:
        return np.inf


def _rest_and_period(execution: Execution, reference: JointReference) -> tuple[Array, Array]:
    """Return where an arm comes to rest under its controller, and what a period makes of it."""
    dynamics, gains = execution.dynamics, execution.controller.gains
    n, n_t = dynamics.arm.n_joints, dynamics.arm.n_coordinates
    goal, hold = reference.positions[-1], reference.torques[-1]
    rest, _ = equilibrium(dynamics, goal, execution.parameters)
    state, physical = np.concatenate([rest, np.zeros(n_t)]), execution.parameters.physical
    A, B = (part[0] for part in linearise_dynamics(dynamics, state[None], hold[None], physical))
    feedback = np.zeros((n, 2 * n_t))
    feedback[:, :n], feedback[:, n_t:n_t + n] = np.diag(gains.stiffness), np.diag(gains.damping)
    rate = dynamics.forward_dynamics(state[None], hold[None], physical)[0]
    state = state - np.linalg.lstsq(A - B @ feedback, rate, rcond=None)[0]
    free, forced = hold_inputs(A, B, execution.controller.period)
    return state, free - forced @ feedback


def _ringing(execution: Execution, period: Array) -> tuple[Array, int]:
    """Return deflections after each period of a second, by the state on arrival."""
    shown = _deflections(execution.dynamics.arm)
    count = int(np.ceil(WATCHED / execution.controller.period - 1e-6)) + 1
    rows, power = shown[:, None], period
    while rows.shape[1] < count:  # twice as many instants each time
        rows = np.concatenate([rows, rows @ power], axis=1)
        power = power @ power
    rows = rows[:, :count]
    return rows.reshape(-1, period.shape[0]), count


def _deflections(arm: Arm) -> Array:
    """Return what makes deflections of a state: of links, and beyond twisted joints."""
    n, size = arm.n_joints, arm.n_passive
    beyond = np.cumsum([link.length for link in reversed(arm.links)])[::-1]
    twisted = np.eye(size)[:len(arm.elastic_joints)] * beyond[list(arm.elastic_joints), None]
    passive = np.vstack([*(link_deflections(arm, i, np.eye(size))[::_STRIDE]
                           for i, link in enumerate(arm.links) if link.modes), twisted])
    shown = np.zeros((len(passive), 2 * arm.n_coordinates))
    shown[:, n:arm.n_coordinates] = passive
    return shown
