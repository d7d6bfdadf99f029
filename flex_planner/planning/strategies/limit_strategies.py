"""
Limits of payload and duration as ways to a plan.

Both are followed from an easier task to one that no other strategy solves. Where the motions
followed come to the task, the nearest of them is a start for it.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from flex_planner.collocation import (
    CollocationResult,
    follow_homotopy,
    Solver,
    SolverStatus,
)
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION
from flex_planner.optimal_control.via_points import free_times
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.first_extremals import approach_limit
from flex_planner.planning.strategies.free_parameters import (
    DURATION,
    PAYLOAD,
    solve_stretched,
)
from flex_planner.planning.strategies.homotopies import (
    drop_weights,
    has_weights,
    raise_weights_from,
)
from flex_planner.planning.strategies.strategy import Attempt

# a limit is reached when a price so many times as high moves it less than this share
_STEADY, _DEARER = 1e-4, 4.0
_MOST_EXTREMALS = 100
# durations tried to start from, in units of the one that is too short
_LONGER = (3.0, 12.0)


def continue_in_payload(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start with little payload and let it grow, at a rising price of effort, up to the task's.

    What can be carried does not depend on the weights, which come last. None where the times of
    via points are free.

    """
    wanted = problem.task.payload_mass
    if not wanted or free_times(problem.task.via_points):
        return None
    light = drop_weights(PAYLOAD.with_value(problem, 0.0))
    extremals = collect_until(approach_limit(PAYLOAD, light, solver.coarse()),
                              lambda met: met[-1].value >= wanted or is_steady(met))
    last = extremals[-1]
    if not last.result.converged:
        return Attempt(result=last.result)
    if last.value * (1 + _STEADY) < wanted:
        return _ended(last, (
            f'motions of the kind that was followed carry at most {last.value:.4g} kg in '
            f'{problem.task.duration:g} s, and {wanted:g} kg were asked for'))
    return Attempt(result=_reach_payload(problem, extremals, solver))


def _reach_payload(problem: MotionProblem, extremals: list[Extremal],
                   solver: Solver) -> CollocationResult:
    """Go from the nearest extremal to the payload of a task, then raise its weights."""
    wanted = problem.task.payload_mass
    nearest = min(extremals, key=lambda extremal: abs(extremal.value - wanted))
    bare = drop_weights(problem)

    def at(share: float) -> MotionProblem:
        return PAYLOAD.with_value(bare, nearest.value + share * (wanted - nearest.value))

    result = follow_homotopy(at, nearest.result.solution, solver, first_step=1.0)
    if result.converged:
        return raise_weights_from(problem, result.solution, solver)
    return result


def continue_in_duration(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start with a longer duration and shorten it, at a rising price of time, to the task's.

    None where via points belong to the duration of the task.

    """
    if problem.junctions.size:
        return None
    wanted, met = problem.task.duration, list[Extremal]()
    bare = drop_weights(problem)
    for factor in (factor for factor in _LONGER if wanted * factor <= MAX_DURATION):
        slow = DURATION.with_value(bare, wanted * factor)
        met = collect_until(approach_limit(DURATION, slow, solver.coarse()),
                            lambda met: met[-1].value <= wanted or is_steady(met))
        if met[0].result.converged or met[0].interrupted:
            break
    if not met:
        return None
    last = met[-1]
    if not last.result.converged:
        return Attempt(result=last.result)
    if last.value > wanted * (1 + _STEADY):
        return _ended(last, (
            f'motions of the kind that was followed take at least {last.value:.4g} s with '
            f'{problem.task.payload_mass:g} kg, and {wanted:g} s were asked for'))
    nearest = min(met, key=lambda extremal: abs(extremal.value - wanted))
    result = solve_stretched(bare, nearest.result.solution, solver)
    if result.converged and has_weights(problem):
        result = raise_weights_from(problem, result.solution, solver)
    return Attempt(result=result)


def collect_until(extremals: Iterable[Extremal], done: Callable[[list[Extremal]], bool],
                  kept: list[Extremal] | None = None) -> list[Extremal]:
    """
    Return the extremals up to those that are enough, or one that fails, or the last.

    They are added to a list, too, if there is one: it has them also where a monitor stops it.

    """
    met: list[Extremal] = []
    for extremal in extremals:
        met.append(extremal)
        if kept is not None:
            kept.append(extremal)
        if not extremal.result.converged or len(met) == _MOST_EXTREMALS or done(met):
            break
    return met


def is_steady(extremals: list[Extremal], share: float = _STEADY) -> bool:
    """Return whether the last value is a limit: a higher price has not moved it."""
    last = extremals[-1]
    cheaper = [one for one in extremals if one.price * _DEARER < 1.01 * last.price]
    return bool(cheaper) and abs(last.value - cheaper[-1].value) < share * last.value


def _ended(last: Extremal, sentence: str) -> Attempt:
    """Return an attempt that ended before the task, which shows nothing about other kinds."""
    return Attempt(result=replace(last.result, status=SolverStatus.NEWTON_FAILED,
                                  message=sentence))
