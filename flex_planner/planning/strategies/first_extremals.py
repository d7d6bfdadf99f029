"""Where families of motions start: near their end, if the same arm made rigid shows the way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationResult, CollocationSolution, SolverSettings
from flex_planner.collocation.homotopy import STOPPED
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.initial_guesses import (
    cold_start,
    DIRECTLY,
    lifted,
    rigid_problem,
)
from flex_planner.planning.strategies.ipopt_continuation import hard_payloads
from flex_planner.planning.strategies.price_continuation import (
    changed,
    durations,
    Enough,
    Extremal,
    Family,
    no_aim,
    payloads,
    SearchStart,
    worth,
    worth_time,
)

# largest mesh of a first motion, in units of the coarsest that overlooks nothing
_FIRST_MESHES = 4
# a rigid motion is lifted when its payload is so near to its limit, and few before are tried
_LIFT, _LIFTS, _MOST_RIGID = 0.03, 3, 15


def heaviest(problem: MotionProblem, settings: SolverSettings, monitor: Monitor, *,
             first: Extremal | None = None, enough: Enough = no_aim) -> Iterator[Extremal]:
    """
    Yield heavier and heavier payloads from that of the problem on.

    A flexible arm starts from the heavy end of the same arm made rigid: where the payload is free
    at a price its motion is near, while with a given payload the phase of what rings is not.
    Where that fails it starts from the payload of the problem. A first motion that is known, see
    `taken_over`, spares all that.

    """
    return _family(problem, payloads, settings, monitor, first, enough)


def quickest(problem: MotionProblem, settings: SolverSettings, monitor: Monitor, *,
             first: Extremal | None = None, enough: Enough = no_aim) -> Iterator[Extremal]:
    """Yield shorter and shorter durations from that of the problem on, see `heaviest`."""
    return _family(problem, durations, settings, monitor, first, enough)


def _family(problem: MotionProblem, family: Family, settings: SolverSettings, monitor: Monitor,
            first: Extremal | None, enough: Enough) -> Iterator[Extremal]:
    """Yield the motions of a family, the first one included."""
    payload = family is payloads
    if first is None and problem.model.arm.n_modes:
        rigid = _rigid_stops(problem, family, settings, monitor)
        first = _lifted_first(problem, rigid, payload, settings, monitor)
        if first is None and rigid and payload:
            price, found = rigid[-1].price, False
            for stop in hard_payloads(problem, price, settings, monitor, enough):
                found = True
                yield stop
            if found:
                return
    if first is None:
        result = first_motion(problem, settings, monitor)
        first = Extremal(value=problem.task.payload_mass if payload else problem.task.duration,
                         price=0.0, problem=problem, result=result)
    yield first
    if first.result.converged:
        yield from family(first.problem, first.result, settings, monitor, enough)


def _rigid_stops(problem: MotionProblem, family: Family, settings: SolverSettings,
                 monitor: Monitor) -> list[Extremal]:
    """Return the motions of the same arm made rigid up to one that is near its limit."""
    rigid = rigid_problem(problem)
    first = cold_start(rigid, settings, monitor).result
    stops: list[Extremal] = []
    if not first.converged:
        return stops
    for stop in family(rigid, first, settings, monitor, lambda value: _LIFT * value):
        stops.append(stop)
        if stop.stopped or stop.room < _LIFT * stop.value or len(stops) == _MOST_RIGID:
            break
    return stops


def _lifted_first(problem: MotionProblem, stops: list[Extremal], payload: bool,
                  settings: SolverSettings,
                  monitor: Monitor) -> Extremal | None:
    """Return the flexible motion at the price of a rigid one that is near its limit, or None."""
    for stop in reversed(stops[-_LIFTS:]):
        if stop.stopped:
            return stop
        found = taken_over(problem, SearchStart.of(stop), settings, monitor, payload=payload)
        if found is not None:
            return found
    return None


def taken_over(problem: MotionProblem, start: SearchStart, settings: SolverSettings,
               monitor: Monitor, *,
               payload: bool) -> Extremal | None:
    """
    Return the motion at the price of another arm's or task's; None if there is none beyond.

    Parameters
    ----------
    problem : MotionProblem
        With the least payload, or the longest duration, that is of interest.
    start : SearchStart
        Of the other arm or task.
    settings, monitor
        Of the solver.
    payload : bool
        Whether the payload is free, else the duration.

    """
    solution, price = start.solution, start.price
    if solution.nodes.shape[1] not in (problem.size, 4 * problem.model.arm.n_joints):
        return None  # of an arm with other modes
    try:
        if payload:
            near = changed(problem, payload_mass=start.value)
            found = worth(near, _fitted(near, solution, settings), price, settings, monitor)
            beyond = found is not None and found.value > problem.task.payload_mass
        else:
            near = changed(problem, duration=start.value)
            found = worth_time(near, _fitted(near, solution, settings), price, settings, monitor)
            beyond = found is not None and found.value < problem.task.duration
    except FlexPlannerError:  # too heavy to hold
        return None
    return found if beyond or (found is not None and found.stopped) else None


def _fitted(problem: MotionProblem, solution: CollocationSolution,
            settings: SolverSettings) -> CollocationSolution:
    """Return a motion of the same or of a rigid arm as a guess, stretched to the duration."""
    guess = solution.stretched(problem.task.duration / solution.mesh[-1])
    return guess if guess.nodes.shape[1] == problem.size else lifted(problem, guess, settings)


def first_motion(problem: MotionProblem, settings: SolverSettings,
                 monitor: Monitor) -> CollocationResult:
    """Return the first solution that strategies find, or the last failure: soon."""
    most = max(_FIRST_MESHES * problem.fewest_intervals(settings.stages), 200)
    quick = replace(settings, max_iterations=min(15, settings.max_iterations),
                    max_intervals=min(most, settings.max_intervals),
                    intervals=min(most, settings.intervals))
    result = cold_start(problem, quick, monitor).result
    for _, strategy in DIRECTLY[1:]:
        if result.converged or result.status in STOPPED:
            break
        attempt = strategy(problem, quick, monitor)
        result = result if attempt is None else attempt.result
    return result
