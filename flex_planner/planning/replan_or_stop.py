"""What to do when a plan in motion is to lead elsewhere: plan again, later, stop, or go on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.planning.plan import Plan
from flex_planner.planning.replan import budgeted, replan
from flex_planner.planning.stop_on_path import stop_on_path
import numpy as np
from numpy.typing import ArrayLike

# of a delay that is rounding [s]
_SAME_TIME = 1e-9
# of the time that there is, for the goal, where a stop may be needed
_FIRST_SHARE = 0.6


class Course(Enum):
    """What the arm does from then on; the value is shown to people."""

    REPLANNED = 'the new plan leads to the goal in time'
    LATER = 'the new plan leads to the goal later than asked'
    STOPS = 'the new plan stops on the path of the one before'
    GOES_ON = 'the plan before goes on'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Continuation:
    """
    A plan to go on with, or why there is none.

    Attributes
    ----------
    course : Course
        What happens.
    plan : Plan
        The new one; with `Course.GOES_ON` one that is not solved.
    torque_step : numpy.ndarray, shape (n,)
        By how much torques jump when it begins; NaN without a solution [N m].
    delay : float
        By how much later than asked it arrives [s].
    deviation : float
        Of a stop: how far joints leave the path; NaN otherwise [rad].
    message : str
        Why the goal is not reached, or not in time; empty if it is.

    """

    course: Course
    plan: Plan
    torque_step: Array
    delay: float = 0.0
    deviation: float = np.nan
    message: str = ''


def replan_or_stop(plan: Plan, at: float, *, state: ArrayLike | None = None,
                   goal: ArrayLike | None = None, duration: float | None = None,
                   keep_time: bool = False, torque_rate_weight: ArrayLike | None = None,
                   stops: bool = False, budget: float = 0.05,
                   monitor: Monitor | None = None) -> Continuation:
    """
    Plan again; where that fails and `stops` is true, stop on the path.

    Parameters
    ----------
    plan, at, state, goal, duration, keep_time, torque_rate_weight, budget, monitor
        As of `replan`; the stop has what is left of the budget, at least 40 %.
    stops : bool
        Whether to stop where the goal is not reached; otherwise the plan goes on.

    Raises
    ------
    InvalidTaskError, InvalidValueError, HoldingError
        As by `replan`.

    """
    watch = monitor or budgeted(budget)
    share = _FIRST_SHARE if stops else 1.0
    first = replace(watch, time_limit=watch.elapsed + share * (watch.time_limit - watch.elapsed))
    again = replan(plan, at, state=state, goal=goal, duration=duration, keep_time=keep_time,
                   torque_rate_weight=torque_rate_weight, monitor=first)
    if again.solved:
        late = again.delay > _SAME_TIME
        return Continuation(
            course=Course.LATER if late else Course.REPLANNED, plan=again.plan,
            torque_step=again.torque_step, delay=again.delay, message=(
                f'no motion was found that arrives in time, but one {again.delay:.3g} s later'
                if late else ''))
    failed = Continuation(course=Course.GOES_ON, plan=again.plan,
                          torque_step=again.torque_step, message=again.plan.message)
    if not stops:
        return failed
    stop = stop_on_path(plan, at, state=state, torque_rate_weight=torque_rate_weight,
                        monitor=watch)
    if not stop.solved:
        return failed
    return Continuation(course=Course.STOPS, plan=stop.plan, torque_step=stop.torque_step,
                        deviation=stop.deviation, message=again.plan.message)
