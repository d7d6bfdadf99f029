"""What the searches for the largest payload and the shortest duration share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flex_planner.collocation import CollocationSolution, Settings
from flex_planner.families import on_the_way, Stop
from flex_planner.ladder import planned
from flex_planner.limits import steady
from flex_planner.motion import MotionProblem
from flex_planner.plan import Plan
from flex_planner.progress import Monitor
from flex_planner.strategies import Attempt, has_weights, QUICK, Strategy, weights_raised
import numpy as np

_MOST_STOPS = 100
_FINEST = 1e-6
# of motions on the way, by accuracy of the value [1/kg, 1/s]
_EXACTNESS = 10.0
# share of the value that the room of a start should be
_MIDDLE = 0.01


def way_to(accuracy: float, settings: Settings) -> Settings:
    """Return settings for motions on the way to a limit that is wanted to an accuracy."""
    return on_the_way(settings, _EXACTNESS * accuracy)


def middle(stops: Sequence[Stop]) -> Stop | None:
    """Return the last motion that leaves some room: a start for searches of its kind."""
    roomy = [stop for stop in stops if stop.room >= _MIDDLE * stop.value]
    return roomy[-1] if roomy else next(iter(stops), None)


def collected(stops: Iterable[Stop], accuracy: float) -> list[Stop]:
    """Return the stops up to one that is near the limit, or fails, or the last."""
    met: list[Stop] = []
    for stop in stops:
        met.append(stop)
        if not stop.result.converged or len(met) == _MOST_STOPS or is_near(met, accuracy):
            break
    return met


def is_near(stops: list[Stop], accuracy: float) -> bool:
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


def plan_near(problem: MotionProblem, start: CollocationSolution, settings: Settings,
              monitor: Monitor, stop: Stop | None = None) -> Plan:
    """Return the plan of a problem from a motion nearly its own; that of a stop may be it."""
    def found(problem: MotionProblem, settings: Settings, monitor: Monitor) -> Attempt:
        if stop is not None and _is_solution(stop, problem, settings):
            return Attempt(result=stop.result)
        return Attempt(result=weights_raised(problem, start, settings, monitor))

    rungs: tuple[tuple[str, Strategy], ...] = (('limit found', found), *QUICK)
    return planned(problem, rungs, settings, monitor)


def _is_solution(stop: Stop, problem: MotionProblem, settings: Settings) -> bool:
    """Return whether a stop is the solution of a problem, as exact as it has to be."""
    one, other = stop.problem.task, problem.task
    return (not has_weights(problem) and one.payload_mass == other.payload_mass
            and one.duration == other.duration and stop.result.converged
            and float(stop.result.errors.max()) <= settings.error_tolerance)
