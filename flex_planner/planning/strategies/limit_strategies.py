"""
Limits of payload and duration as ways to a plan, and as evidence that there is none.

Both limits are found on the way to a task that no other strategy solves. Either the task is met,
then its neighbour is a start for it; or the limit lies before it, and is the evidence that the
task is infeasible.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationResult, solve, SolverSettings, SolverStatus
from flex_planner.collocation.homotopy import STOPPED, walk
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION
from flex_planner.planning.strategies.first_extremals import heaviest, quickest
from flex_planner.planning.strategies.initial_guesses import (
    Attempt,
    has_weights,
    weights_raised,
    without_weights,
)
from flex_planner.planning.strategies.price_continuation import (
    changed,
    durations,
    Extremal,
    free,
    longer_durations,
    on_the_way,
    stretched,
    time_price,
)

# a limit is reached when a price so many times as high moves it less than this share
_STEADY, _DEARER = 1e-4, 4.0
_MOST_STOPS = 100
# a price so near is left to Newton's method
_NEAR_PRICE = 16.0
# durations tried to start from, in units of the one that is too short
_LONGER = (3.0, 12.0)


def walked_payload(problem: MotionProblem, settings: SolverSettings,
                   monitor: Monitor) -> Attempt | None:
    """
    Start with little payload and let it grow, at a rising price of effort, up to the task's.

    What can be carried does not depend on the weights, which come last.

    """
    wanted = problem.task.payload_mass
    if not wanted:
        return None
    light = without_weights(changed(problem, payload_mass=0.0))
    stops = until(heaviest(light, on_the_way(settings), monitor),
                  lambda stop: stop.value >= wanted)
    last = stops[-1]
    if not last.result.converged:
        return Attempt(result=last.result)
    if last.value * (1 + _STEADY) < wanted:
        return _limited(stops, (
            f'the arm carries at most {last.value:.4g} kg from start to goal in '
            f'{problem.task.duration:g} s, and {wanted:g} kg were asked for'))
    return Attempt(result=_walked_to(problem, stops, settings, monitor))


def _walked_to(problem: MotionProblem, stops: list[Extremal], settings: SolverSettings,
               monitor: Monitor) -> CollocationResult:
    """Go from the nearest stop to the payload of a task, then raise its weights."""
    wanted = problem.task.payload_mass
    nearest = min(stops, key=lambda stop: abs(stop.value - wanted))
    bare = without_weights(problem)

    def at(way: float) -> MotionProblem:
        return changed(bare, payload_mass=nearest.value + way * (wanted - nearest.value))

    result = walk(at, nearest.result.solution, settings, monitor, first_step=1.0)
    if result.converged:
        return weights_raised(problem, result.solution, settings, monitor)
    return result


def walked_duration(problem: MotionProblem, settings: SolverSettings,
                    monitor: Monitor) -> Attempt | None:
    """Start with a longer duration and shorten it, at a rising price of time, to the task's."""
    wanted, met = problem.task.duration, list[Extremal]()
    bare = without_weights(problem)
    for factor in (factor for factor in _LONGER if wanted * factor <= MAX_DURATION):
        slow = changed(bare, duration=wanted * factor)
        met = until(quickest(slow, on_the_way(settings), monitor),
                    lambda stop: stop.value <= wanted)
        if met[0].result.converged or met[0].stopped:
            break
    if not met:
        return None
    last = met[-1]
    if not last.result.converged:
        return Attempt(result=last.result)
    if last.value > wanted * (1 + _STEADY):
        return _limited(met, (
            f'the motion takes at least {last.value:.4g} s with {problem.task.payload_mass:g} kg, '
            f'and {wanted:g} s were asked for'))
    nearest = min(met, key=lambda stop: abs(stop.value - wanted))
    result = stretched(bare, nearest.result.solution, settings, monitor)
    if result.converged and has_weights(problem):
        result = weights_raised(problem, result.solution, settings, monitor)
    return Attempt(result=result)


def freed_duration(problem: MotionProblem, result: CollocationResult, settings: SolverSettings,
                   monitor: Monitor) -> tuple[MotionProblem, CollocationResult]:
    """
    Free the duration of a solved motion, at the price per second of its task.

    The price at which a given duration would be the best is -H. Durations are tried until that
    is so near to the task's price that Newton's method finds the rest.

    """
    wanted = problem.task.time_weight
    shorter = wanted > time_price(problem, result.solution)
    stops = durations if shorter else longer_durations
    freed = _freed(problem, result, wanted, settings, monitor)
    for stop in stops(problem, result, on_the_way(settings), monitor) if freed is None else ():
        if stop.result.status in STOPPED:
            return problem, stop.result
        passed = stop.price > wanted if shorter else stop.price < wanted
        if passed or max(stop.price / wanted, wanted / stop.price) < _NEAR_PRICE:
            near = changed(problem, duration=stop.value)
            freed = _freed(near, stop.result, wanted, settings, monitor)
        if freed is not None or passed:
            break
    if freed is None:
        return problem, replace(result, status=SolverStatus.NEWTON_FAILED,
                                message='no duration was found that is worth its price')
    return freed


def _freed(problem: MotionProblem, result: CollocationResult, price: float,
           settings: SolverSettings,
           monitor: Monitor) -> tuple[MotionProblem, CollocationResult] | None:
    """Return the motion with a free duration if it is near, or if the monitor stopped it."""
    ahead = free(problem, price)
    found = solve(ahead, ahead.extended(result.solution), settings, monitor)
    if found.status in STOPPED:
        return problem, found
    duration = float(found.solution.nodes[0, -1])
    if not found.converged or not 0 < duration <= MAX_DURATION:
        return None
    return ahead.fixed(duration), replace(found, switches=found.switches * duration,
                                          solution=ahead.restricted(found.solution))


def until(stops: Iterable[Extremal], done: Callable[[Extremal], bool]) -> list[Extremal]:
    """Return the stops up to one that is enough, or to a limit; at least one."""
    met: list[Extremal] = []
    for stop in stops:
        met.append(stop)
        if not stop.result.converged or done(stop) or len(met) == _MOST_STOPS or steady(met):
            break
    return met


def steady(stops: list[Extremal], share: float = _STEADY) -> bool:
    """Return whether the last value is a limit: a higher price has not moved it."""
    last = stops[-1]
    cheaper = [stop for stop in stops if stop.price * _DEARER < 1.01 * last.price]
    return bool(cheaper) and abs(last.value - cheaper[-1].value) < share * last.value


def _limited(stops: list[Extremal], sentence: str) -> Attempt:
    """
    Return an attempt with evidence: only if the price shows that the limit is near.

    Under gravity motions of several kinds (swinging back first) have limits of their own, and
    that of one is no evidence.

    """
    last = stops[-1]
    if last.problem.model.arm.gravity.any():
        return Attempt(result=replace(last.result, status=SolverStatus.NEWTON_FAILED, message=(
            f'by the motions that were followed {sentence}; under gravity others may do more')))
    if steady(stops):
        grown = last.price / max(stops[0].price, 1.0)
        return Attempt(result=last.result, evidence=(
            f'{sentence} (the price of more has grown {grown:.0e} times)'))
    return Attempt(result=replace(last.result, status=SolverStatus.NEWTON_FAILED,
                                  message='the limit was not found'))
