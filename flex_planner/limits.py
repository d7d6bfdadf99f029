"""
What an arm can do at most: the payload it can carry, and the time it needs.

Both are found on the way to a task that no other strategy solves. Either the task is met, then
its neighbour is a start for it; or the limit lies before it, and is the evidence that the task
is infeasible.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    Settings,
    solve,
    Status,
)
from flex_planner.continuation import STOPPED, walk
from flex_planner.errors import InvalidTaskError, NoEquilibriumError
from flex_planner.extended_motion import FreeDurationProblem, payload_price, PayloadProblem
from flex_planner.motion import MotionProblem
from flex_planner.progress import Monitor
from flex_planner.strategies import (
    Attempt,
    coarse_mesh,
    cold_start,
    DIRECTLY,
    solve_rigid,
    Strategy,
    warm_start,
)
from flex_planner.task import MAX_DURATION
import numpy as np

Rungs = Sequence[tuple[str, Strategy]]

# errors on the way: limits are wanted to four digits
_TOLERANCE = 1e-4
# a limit is reached when the next price moves it less than this share
_STEADY = 1e-4
_FACTOR, _SMALLEST_FACTOR = 4.0, 1.02
_MOST_STOPS = 100
# durations tried to start from, in units of the one that is too short
_LONGER = (3.0, 12.0)
_SHORTER = 0.85
_HEAVIER, _LEAST_MORE = 0.25, 0.1
# largest mesh of a first motion, in units of the coarsest that overlooks nothing
_FIRST_MESHES = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """
    A motion on the way to a limit.

    Attributes
    ----------
    value : float
        Payload [kg] or duration [s].
    price : float
        What a little more payload, or a little less time, adds to J [1/kg, 1/s].
    result : CollocationResult
        Of the motion with this payload and duration.

    """

    value: float
    price: float
    result: CollocationResult


def payloads(problem: MotionProblem, first: CollocationResult, settings: Settings,
             monitor: Monitor) -> Iterator[Stop]:
    """
    Yield heavier and heavier payloads, each with the motion of least effort that carries it.

    Ends where no heavier one is found; if the monitor stops it, with a stop that says so. Where no
    step in price succeeds, the payload is raised by itself, see `durations`.

    Parameters
    ----------
    problem : MotionProblem
        The motion with the first payload.
    first : CollocationResult
        Its solution.
    settings, monitor
        Of the solver.

    """
    here, price, factor = first, _payload_price(problem, first.solution), _FACTOR
    while factor > _SMALLEST_FACTOR:
        try:
            step = _heavier(problem, here.solution, price, factor, settings, monitor)
        except (InvalidTaskError, NoEquilibriumError):  # too heavy to hold
            step = None
        if step is None:
            factor **= 0.5
            continue
        stop, problem = step
        yield stop
        if stop.result.status in STOPPED:
            return
        here, price = stop.result, stop.price


def _heavier(problem: MotionProblem, solution: CollocationSolution, price: float, factor: float,
             settings: Settings, monitor: Monitor) -> tuple[Stop, MotionProblem] | None:
    """Return the next stop, a factor in price away or else a step in payload."""
    ahead = PayloadProblem(problem.model, problem.task, problem.parameters, price * factor)
    found = solve(ahead, ahead.extended(solution), _on_the_way(settings), monitor)
    payload, inner = ahead.restricted(found.solution)
    if found.status in STOPPED:
        return Stop(value=payload, price=price, result=found), problem
    if found.converged and payload > problem.task.payload_mass:
        stop = Stop(value=payload, price=price * factor, result=replace(found, solution=inner))
        return stop, ahead.with_payload(payload)
    more = max(_HEAVIER * problem.task.payload_mass, _LEAST_MORE)
    heavier = _changed(problem, payload_mass=problem.task.payload_mass + more)
    there = solve(heavier, solution, _on_the_way(settings), monitor)
    if not there.converged or _payload_price(heavier, there.solution) <= price:
        return None
    return Stop(value=heavier.task.payload_mass, result=there,
                price=_payload_price(heavier, there.solution)), heavier


def durations(problem: MotionProblem, first: CollocationResult, settings: Settings,
              monitor: Monitor) -> Iterator[Stop]:
    """
    Yield shorter and shorter durations, see `payloads`.

    The phase of what rings in a flexible motion changes fast with its duration; where no step in
    price succeeds, the duration is shortened by itself.

    """
    here, price, factor = first, _time_price(problem, first.solution), _FACTOR
    while factor > _SMALLEST_FACTOR:
        ahead = _free(problem, price * factor)
        found = solve(ahead, ahead.extended(here.solution), _on_the_way(settings), monitor)
        duration = float(found.solution.nodes[0, -1])
        if found.status in STOPPED:
            yield Stop(value=duration, price=price, result=found)
            return
        if found.converged and 0 < duration < problem.task.duration:
            problem, price = ahead.fixed(duration), price * factor
            here = replace(found, solution=ahead.restricted(found.solution))
            yield Stop(value=duration, price=price, result=here)
            continue
        shorter = _changed(problem, duration=problem.task.duration * _SHORTER)
        there = _stretched(shorter, here.solution, _on_the_way(settings), monitor)
        if there.converged and _time_price(shorter, there.solution) > price:
            problem, here, price = shorter, there, _time_price(shorter, there.solution)
            yield Stop(value=problem.task.duration, price=price, result=here)
        else:
            factor **= 0.5


def walked_payload(problem: MotionProblem, settings: Settings, monitor: Monitor, *,
                   rungs: Rungs = DIRECTLY) -> Attempt | None:
    """Start without payload and let it grow, at a rising price of effort, up to the task's."""
    wanted = problem.task.payload_mass
    light = _changed(problem, payload_mass=0.0)
    first = _first(light, settings, monitor, rungs) if wanted else None
    if first is None or not first.converged:
        return None if first is None else Attempt(result=first)
    stops = _until(payloads(light, first, settings, monitor), lambda value: value >= wanted)
    if not stops:
        return _no_limit(first)
    last = stops[-1]
    if last.result.status in STOPPED:
        return Attempt(result=last.result)
    if last.value * (1 + _STEADY) < wanted:
        return _limited(stops, (
            f'the arm carries at most {last.value:.4g} kg from start to goal in '
            f'{problem.task.duration:g} s, and {wanted:g} kg were asked for'))
    nearest = min(stops, key=lambda stop: abs(stop.value - wanted))

    def at(way: float) -> MotionProblem:
        return _changed(problem, payload_mass=nearest.value + way * (wanted - nearest.value))

    return Attempt(result=walk(at, nearest.result.solution, settings, monitor, first_step=1.0))


def walked_duration(problem: MotionProblem, settings: Settings, monitor: Monitor, *,
                    rungs: Rungs = DIRECTLY) -> Attempt | None:
    """
    Start with a longer duration and shorten it, at a rising price of time, to the task's.

    Not where the rigid arm makes it in time: then bending is what makes the task hard.

    """
    wanted = problem.task.duration
    if problem.model.arm.n_modes and solve_rigid(problem, settings, monitor).converged:
        return None
    first = None
    for factor in _LONGER:
        if wanted * factor > MAX_DURATION:
            break
        slow = _changed(problem, duration=wanted * factor)
        first = _first(slow, settings, monitor, rungs)
        if first is None or first.converged or first.status in STOPPED:
            break
    if first is None or not first.converged:
        return None if first is None else Attempt(result=first)
    stops = _until(durations(slow, first, settings, monitor), lambda value: value <= wanted)
    if not stops:
        return _no_limit(first)
    last = stops[-1]
    if last.result.status in STOPPED:
        return Attempt(result=last.result)
    if last.value > wanted * (1 + _STEADY):
        return _limited(stops, (
            f'the motion takes at least {last.value:.4g} s with {problem.task.payload_mass:g} kg, '
            f'and {wanted:g} s were asked for'))
    nearest = min(stops, key=lambda stop: abs(stop.value - wanted))
    return Attempt(result=_stretched(problem, nearest.result.solution, settings, monitor))


def freed_duration(problem: MotionProblem, result: CollocationResult, settings: Settings,
                   monitor: Monitor) -> tuple[MotionProblem, CollocationResult]:
    """
    Free the duration of a solved motion, at the price per second of its task.

    The price at which a given duration would be the best is -H. Durations are tried until that
    is so near to the task's price that Newton's method finds the rest.

    """
    wanted = problem.task.time_weight
    shorter = wanted > _time_price(problem, result.solution)
    stops = durations if shorter else _longer_durations
    freed = _freed(problem, result, wanted, settings, monitor)
    for stop in stops(problem, result, settings, monitor) if freed is None else ():
        if stop.result.status in STOPPED:
            return problem, stop.result
        passed = stop.price > wanted if shorter else stop.price < wanted
        if passed or max(stop.price / wanted, wanted / stop.price) < _FACTOR**2:
            near = _changed(problem, duration=stop.value)
            freed = _freed(near, stop.result, wanted, settings, monitor)
        if freed is not None or passed:
            break
    if freed is None:
        return problem, replace(result, status=Status.NEWTON_FAILED,
                                message='no duration was found that is worth its price')
    return freed


def _freed(problem: MotionProblem, result: CollocationResult, price: float, settings: Settings,
           monitor: Monitor) -> tuple[MotionProblem, CollocationResult] | None:
    """Return the motion with a free duration if it is near, or if the monitor stopped it."""
    free = _free(problem, price)
    found = solve(free, free.extended(result.solution), settings, monitor)
    if found.status in STOPPED:
        return problem, found
    duration = float(found.solution.nodes[0, -1])
    if not found.converged or not 0 < duration <= MAX_DURATION:
        return None
    return free.fixed(duration), replace(found, switches=found.switches * duration,
                                         solution=free.restricted(found.solution))


def _longer_durations(problem: MotionProblem, first: CollocationResult, settings: Settings,
                      monitor: Monitor) -> Iterator[Stop]:
    """Yield longer and longer durations, whose prices fall."""
    here = first
    while problem.task.duration / _SHORTER <= MAX_DURATION:
        problem = _changed(problem, duration=problem.task.duration / _SHORTER)
        here = _stretched(problem, here.solution, _on_the_way(settings), monitor)
        if not here.converged and here.status not in STOPPED:
            return
        yield Stop(value=problem.task.duration, price=_time_price(problem, here.solution),
                   result=here)


def _free(problem: MotionProblem, price: float) -> FreeDurationProblem:
    """Return the motion with a free duration at a price per second."""
    task = replace(problem.task, time_weight=price)
    return FreeDurationProblem(MotionProblem(problem.model, task, problem.parameters))


def _stretched(problem: MotionProblem, solution: CollocationSolution, settings: Settings,
               monitor: Monitor) -> CollocationResult:
    """Solve a motion, starting from one of another duration, or else from nothing."""
    for strategy in (warm_start(solution), cold_start, coarse_mesh):
        attempt = strategy(problem, settings, monitor)
        if attempt is not None and attempt.result.status is not Status.NEWTON_FAILED:
            break
    assert attempt is not None
    return attempt.result


def _first(problem: MotionProblem, settings: Settings, monitor: Monitor,
           rungs: Rungs) -> CollocationResult | None:
    """Return the first solution that strategies find, or the last failure: soon."""
    result, most = None, max(_FIRST_MESHES * problem.fewest_intervals(settings.stages), 200)
    quick = replace(_on_the_way(settings), max_iterations=min(15, settings.max_iterations),
                    max_intervals=min(most, settings.max_intervals),
                    intervals=min(most, settings.intervals))
    for _, strategy in rungs:
        attempt = strategy(problem, quick, monitor)
        if attempt is not None:
            result = attempt.result
            if result.converged or result.status in STOPPED:
                break
    return result


def _until(stops: Iterator[Stop], done: Callable[[float], bool]) -> list[Stop]:
    """Return the stops up to one that is enough, or to a limit."""
    met: list[Stop] = []
    for stop in stops:
        met.append(stop)
        if stop.result.status in STOPPED or done(stop.value) or len(met) == _MOST_STOPS:
            break
        if _steady(met):
            break
    return met


def _steady(stops: list[Stop]) -> bool:
    """Return whether the last value is a limit: a higher price has not moved it."""
    last = stops[-1]
    cheaper = [stop for stop in stops if stop.price * _FACTOR < 1.01 * last.price]
    return bool(cheaper) and abs(last.value - cheaper[-1].value) < _STEADY * last.value


def _limited(stops: list[Stop], sentence: str) -> Attempt:
    """Return an attempt with evidence: only if the price shows that the limit is near."""
    last = stops[-1]
    if _steady(stops):
        grown = last.price / stops[0].price
        return Attempt(result=last.result, evidence=(
            f'{sentence} (the price of more has grown {grown:.0e} times)'))
    return _no_limit(last.result)


def _no_limit(result: CollocationResult) -> Attempt:
    """Return a failure: the result solves another task."""
    return Attempt(result=replace(result, status=Status.NEWTON_FAILED,
                                  message='the limit was not found'))


def _payload_price(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Return dJ/dm_p of a motion, at least something positive."""
    return max(payload_price(problem, solution), 1e-3)


def _time_price(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Return -dJ/dt_f of a motion, -H, at least something positive."""
    hamiltonian = problem.model.controls(solution.nodes, problem.p).hamiltonian
    return max(-float(np.mean(hamiltonian)), 1e-3)


def _changed(problem: MotionProblem, **changes: float) -> MotionProblem:
    """Return the problem of a task changed in payload or duration."""
    task = replace(problem.task, **changes)  # type: ignore[arg-type]
    parameters = replace(problem.parameters, payload_mass=task.payload_mass)
    return MotionProblem(problem.model, task, parameters)


def _on_the_way(settings: Settings) -> Settings:
    """Return settings for motions on the way to a limit."""
    return replace(settings, error_tolerance=max(_TOLERANCE, settings.error_tolerance),
                   max_iterations=min(25, settings.max_iterations))
