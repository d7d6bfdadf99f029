"""What the searches for the largest payload and the shortest duration share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationSolution, SolverSettings
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import planned
from flex_planner.planning.strategies.initial_guesses import (
    Attempt,
    has_weights,
    QUICK,
    Strategy,
    weights_raised,
)
from flex_planner.planning.strategies.limit_strategies import steady
from flex_planner.planning.strategies.price_continuation import (
    changed,
    Extremal,
    on_the_way,
    worth,
    worth_time,
)
import numpy as np

_MOST_STOPS = 100
_FINEST = 1e-6
# of motions on the way, by accuracy of the value [1/kg, 1/s]
_EXACTNESS = 10.0
# share of the value that the room of a start should be
_MIDDLE = 0.01


def way_to(accuracy: float, settings: SolverSettings) -> SolverSettings:
    """Return settings for motions on the way to a limit that is wanted to an accuracy."""
    return on_the_way(settings, _EXACTNESS * accuracy)


def middle(stops: Sequence[Extremal]) -> Extremal | None:
    """Return the last motion that leaves some room: a start for searches of its kind."""
    roomy = [stop for stop in stops if stop.room >= _MIDDLE * stop.value]
    return roomy[-1] if roomy else next(iter(stops), None)


def collected(stops: Iterable[Extremal], accuracy: float) -> list[Extremal]:
    """Return the stops up to one that is near the limit, or fails, or the last."""
    met: list[Extremal] = []
    for stop in stops:
        met.append(stop)
        if not stop.result.converged or len(met) == _MOST_STOPS or is_near(met, accuracy):
            break
    return met


def is_near(stops: list[Extremal], accuracy: float) -> bool:
    """Return whether the last value is the limit, to an accuracy."""
    last = stops[-1]
    if not last.price:
        return False
    wide = width(accuracy, last.value)
    if np.isfinite(last.room):
        return last.room <= wide
    return steady(stops, wide / (10 * last.value))  # a motor without limit is never full


def width(accuracy: float, value: float) -> float:
    """Return how wide a bracket may be: motions nearer to their limit are out of reach."""
    return max(accuracy, _FINEST * value)


def plan_near(problem: MotionProblem, start: CollocationSolution, settings: SolverSettings,
              monitor: Monitor) -> Plan:
    """Return the plan of a problem from a motion nearly its own."""
    return planned(problem, (_found(start), *QUICK), settings, monitor)


def plan_at(stops: list[Extremal], problem: MotionProblem, settings: SolverSettings,
            monitor: Monitor, *,
            payload: bool, exact: bool) -> Plan:
    """
    Return the plan with the value of the last stop of a search.

    Where the value leaves Newton's method no way, the price may: the last stop is then replaced
    by the same motion, solved as exactly as a plan.

    Parameters
    ----------
    stops : list of Extremal
        The last one near the limit.
    problem : MotionProblem
        That was searched, with its weights.
    settings, monitor
        Of the solver.
    payload : bool
        Whether the value is a payload, else a duration.
    exact : bool
        Whether the last stop was solved to be the plan.

    """
    stop = stops[-1]

    def there(stop: Extremal) -> MotionProblem:
        return (changed(problem, payload_mass=stop.value) if payload
                else changed(problem, duration=stop.value))

    first = _found(stop.result.solution, stop if exact else None)
    plan = planned(there(stop), (first,), settings, monitor)
    if plan.status is not PlanStatus.NOT_CONVERGED:
        return plan
    again = _more_exact(stop, settings, monitor, payload=payload)
    if again is not None:
        found = planned(there(again), (_found(again.result.solution, again),), settings, monitor)
        if found.status is not PlanStatus.NOT_CONVERGED:
            stops[-1] = again
            return found
    found = planned(there(stop), QUICK, settings, monitor)
    if found.status is PlanStatus.NOT_CONVERGED:
        return replace(found, message=f'{plan.message}; {found.message}')
    return found


def _found(start: CollocationSolution, stop: Extremal | None = None) -> tuple[str, Strategy]:
    """Return the strategy that starts from a motion; that of a stop may be the solution."""
    def found(problem: MotionProblem, settings: SolverSettings, monitor: Monitor) -> Attempt:
        if stop is not None and _is_solution(stop, problem, settings):
            return Attempt(result=stop.result)
        return Attempt(result=weights_raised(problem, start, settings, monitor))

    return 'limit found', found


def _more_exact(stop: Extremal, settings: SolverSettings, monitor: Monitor, *,
                payload: bool) -> Extremal | None:
    """Return the motion of a stop as exact as a plan has to be, None without success."""
    if not stop.price:
        return None
    try:
        found = (worth if payload else worth_time)(stop.problem, stop.result.solution,
                                                   stop.price, settings, monitor)
    except FlexPlannerError:  # too heavy to hold, or no duration
        return None
    return found if found is not None and found.result.converged else None


def _is_solution(stop: Extremal, problem: MotionProblem, settings: SolverSettings) -> bool:
    """Return whether a stop is the solution of a problem, as exact as it has to be."""
    one, other = stop.problem.task, problem.task
    return (not has_weights(problem) and one.payload_mass == other.payload_mass
            and one.duration == other.duration and stop.result.converged
            and float(stop.result.errors.max()) <= settings.error_tolerance)
