"""
A stop on the way: the arm comes to rest on the path of the plan that runs, and nearly along it.

Links that bend cannot keep to a path of the joints while the arm slows down, or they would swing
in the end. So the stop is the motion of least effort to rest at joint angles that the plan passes,
and how far it is beside the path until then is measured.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, number
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.replan import budgeted, plan_rest, TIP_TOLERANCE, torque_step
from flex_planner.planning.rest_of_motion import Departure
import numpy as np
from numpy.typing import ArrayLike

LARGEST_DEVIATION = 0.05
# shares of what is left of the plan: how long the stop takes, and where on the path it ends. With
# constant deceleration the way is half of what it would be; last, the arm goes on to the end
_STOPS = (0.15, 0.075), (0.3, 0.15), (0.6, 0.3), (1.0, 0.5), (1.0, 1.0), (1.5, 1.0)
_SAMPLES = 101


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stop:
    """
    What came of planning a stop.

    Attributes
    ----------
    plan : Plan
        To rest on the path, on a clock of its own; check `solved`. Certified as that of `replan`.
    at : float
        When it begins, on the clock of the running plan [s].
    torque_step : numpy.ndarray, shape (n,)
        By how much torques jump there; NaN without a solution [N m].
    deviation : float
        How far joints are from the path at most, the one that is farthest: NaN without a
        solution [rad].

    """

    plan: Plan
    at: float
    torque_step: Array
    deviation: float

    @property
    def solved(self) -> bool:
        """Return whether it may replace the running plan."""
        return self.plan.solved


def stop_on_path(plan: Plan, at: float, *, state: ArrayLike | None = None,
                 torque: ArrayLike | None = None, torque_rate_weight: ArrayLike | None = None,
                 max_deviation: float = LARGEST_DEVIATION, budget: float = 0.2,
                 monitor: Monitor | None = None) -> Stop:
    """
    Plan the soonest of some stops on the path of a plan while it is carried out.

    Motors keep their limits; the motion is certified by one simulation of its torque.

    Parameters
    ----------
    plan, at, state, torque, torque_rate_weight, monitor
        As of `replan`.
    max_deviation : float
        How far joints may be from the path on the way, > 0; beyond what they are from it at the
        begin [rad].
    budget : float
        Time that it may take, 0.001 to 60 [s].

    Returns
    -------
    Stop
        Where none was found, ``plan.status`` and ``plan.message`` say what became of the last.

    Raises
    ------
    InvalidTaskError, InvalidValueError, HoldingError
        As by `replan`.

    """
    departure = Departure.of(plan, at, state, torque, torque_rate_weight)
    number('max_deviation', max_deviation, above=0, unit='rad')
    watch, path = monitor or budgeted(budget), _path(departure)
    most = max_deviation + _distance(path, departure.state[None])
    for share, where in _STOPS:
        until = departure.at + where * departure.left
        goal = plan.sample(until).coordinates[0, :plan.arm.n_joints]
        problem = departure.problem(goal, share * departure.left)
        found = plan_rest(departure, problem, watch, TIP_TOLERANCE, until)
        stop = Stop(plan=found, at=departure.at, torque_step=torque_step(departure, found),
                    deviation=_deviation(path, found))
        if found.status in STOP_STATUS.values() or (found.solved and stop.deviation <= most):
            break
    return stop if stop.deviation <= most or not stop.solved else _refuse(stop, most)


def _path(departure: Departure) -> Array:
    """Return joint angles that the plan passes from now on, shape (k, n)."""
    times = np.linspace(departure.at, departure.plan.task.duration, _SAMPLES, dtype=np.float64)
    return departure.plan.sample(times).coordinates[:, :departure.torque.size]


def _deviation(path: Array, found: Plan) -> float:
    """Return how far a motion is from a path; NaN without one."""
    if found.solution is None:
        return np.nan
    return _distance(path, found.uniform_samples(_SAMPLES).coordinates)


def _distance(path: Array, coordinates: Array) -> float:
    """Return how far joints (m, n or more) are from straight lines along a path (k, n) at most."""
    angles, pieces = coordinates[:, None, :path.shape[1]], np.diff(path, axis=0)
    lengths = np.maximum((pieces**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(((angles - path[:-1]) * pieces).sum(axis=-1) / lengths, 0, 1)[..., None]
    apart = np.abs(path[:-1] + share * pieces - angles).max(axis=-1)
    return float(apart.min(axis=1).max())


def _refuse(stop: Stop, most: float) -> Stop:
    """Return a stop that is too far beside the path as none."""
    return replace(stop, plan=replace(stop.plan, status=PlanStatus.LIMIT_VIOLATED, message=(
        f'joints would leave the path by {stop.deviation:.3g} rad on the way to a stop, but may '
        f'by {most:.3g} rad: a larger max_deviation, or let the running plan end')))
