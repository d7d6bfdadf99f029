"""
Continuation in price: heavier and heavier payloads, shorter and shorter durations.

Which of the two is a `FreeParameter`; the steps are the same for both.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError, NoEquilibriumError
from flex_planner.collocation import CollocationResult, INTERRUPTED, Solver, SolverStatus
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION
from flex_planner.planning.strategies.extremals import Extremal, no_target, TargetGap
from flex_planner.planning.strategies.free_parameters import (
    DURATION,
    FreeParameter,
    SHORTER,
    solve_stretched,
)
from flex_planner.planning.strategies.ipopt_continuation import jump_in_price
import numpy as np

# of the price from one motion to the next; grows where that is easy, shrinks where it fails
_FACTOR, _LARGEST_FACTOR, _SMALLEST_FACTOR = 4.0, 16.0, 1.02
_EASY = 8
# below this factor in price IPOPT is asked for a jump, so often
_STALLED, _MOST_JUMPS = 2.0, 4
# near a limit the price is raised to what leaves this share of the gap that is wanted
_CLOSE, _SURE, _LEAST_FACTOR = 0.2, 0.6, 1.5
# the gap falls with this power of the price: 2 for rigid arms, less where links ring
_POWER = 1.5
# that are tried where the price of a duration is approached
_MOST_DURATIONS = 40
# a price so near is left to Newton's method
_NEAR_PRICE = 16.0


def continue_in_price(parameter: FreeParameter, problem: MotionProblem,
                      first: CollocationResult, solver: Solver,
                      target_gap: TargetGap = no_target) -> Iterator[Extremal]:
    """
    Yield motions with values nearer and nearer to the limit, each one of least effort.

    Ends where none is found that is nearer; if the monitor interrupts it, with an extremal that
    says so. Where no step in price succeeds, the value is changed by itself: the phase of what
    rings in a flexible motion changes fast with its duration.

    Parameters
    ----------
    parameter : FreeParameter
        ``PAYLOAD`` or ``DURATION``.
    problem : MotionProblem
        The motion with the first value.
    first : CollocationResult
        Its solution.
    solver : Solver
        See `Solver.coarse`.
    target_gap : callable
        From a value to the gap that is wanted there, see `Extremal.gap`; 0 for as little as there
        is.

    """
    try:
        price = parameter.price(problem, first.solution)
    except NoEquilibriumError:  # the links buckle with hardly more payload
        return
    here = Extremal(value=parameter.value(problem), result=first, problem=problem, price=price)
    factor = _FACTOR if problem.model.arm.n_passive else _LARGEST_FACTOR
    jumps, tried = _MOST_JUMPS, None
    while factor > _SMALLEST_FACTOR:
        solver.monitor.payload = here.problem.task.payload_mass
        try:
            extremal = _step(parameter, here, min(factor, _aim(here, target_gap)), solver)
        except FlexPlannerError:  # too heavy to hold, or absurd
            extremal = None
        if extremal is None:
            factor **= 0.5
            if factor >= _STALLED or not jumps or tried is here:
                continue
            # a jump that fails may succeed from further on
            extremal = jump_in_price(parameter, here, target_gap, solver)
            tried, jumps = here, jumps - 1
            if extremal is None:
                continue
        yield extremal
        if extremal.interrupted:
            return
        if extremal.result.iterations <= _EASY:
            factor = min(factor**1.5, _LARGEST_FACTOR)
        here = extremal


def _aim(here: Extremal, target_gap: TargetGap) -> float:
    """Return the factor in price that leaves about the gap wanted."""
    gap, wanted = here.gap, target_gap(here.value)
    if not wanted or not gap < _CLOSE * here.value:
        return _LARGEST_FACTOR
    return max(float((gap / (_SURE * wanted)) ** (1 / _POWER)), _LEAST_FACTOR)


def _step(parameter: FreeParameter, here: Extremal, factor: float,
          solver: Solver) -> Extremal | None:
    """Return the next extremal, a factor in price away or else a step in value."""
    found = parameter.solve_at_price(here.problem, here.result.solution, here.price * factor,
                                     solver)
    if found is not None and (found.interrupted or parameter.improves(found.value, here.value)):
        return found
    value = parameter.next_value(here.value)
    problem = parameter.with_value(here.problem, value)
    there = parameter.solve_next(problem, here.result.solution, solver)
    if not there.converged:
        return None
    extremal = Extremal(value=value, result=there, problem=problem,
                        price=parameter.price(problem, there.solution))
    return extremal if extremal.price > here.price or parameter.is_far(here, value) else None


def free_duration(problem: MotionProblem, result: CollocationResult,
                  solver: Solver) -> tuple[MotionProblem, CollocationResult]:
    """
    Free the duration of a solved motion, at the price per second of its task.

    The price at which a given duration would be the best is -H. Durations are tried until that
    is so near to the task's price that Newton's method finds the rest.

    """
    wanted = problem.task.time_weight
    shorter = wanted > DURATION.price(problem, result.solution)
    freed = _free_at(problem, result, wanted, solver)
    coarse = solver.coarse()
    if problem.layout.torques:
        extremals = _approach_price(problem, result, wanted, coarse)
    elif shorter:
        extremals = continue_in_price(DURATION, problem, result, coarse)
    else:
        extremals = _lengthen(problem, result, coarse)
    for extremal in extremals if freed is None else ():
        if extremal.interrupted:
            return problem, extremal.result
        passed = not problem.layout.torques and (
            extremal.price > wanted if shorter else extremal.price < wanted)
        if passed or max(extremal.price / wanted, wanted / extremal.price) < _NEAR_PRICE:
            near = DURATION.with_value(problem, extremal.value)
            freed = _free_at(near, extremal.result, wanted, solver)
        if freed is not None or passed:
            break
    if freed is None:
        return problem, replace(result, status=SolverStatus.NEWTON_FAILED,
                                message='no duration was found that is worth its price')
    return freed


def _free_at(problem: MotionProblem, result: CollocationResult, price: float,
             solver: Solver) -> tuple[MotionProblem, CollocationResult] | None:
    """Return the motion with a free duration if it is near, or if the monitor stopped it."""
    found = DURATION.solve_at_price(problem, result.solution, price, solver)
    if found is None or found.interrupted:
        return None if found is None else (problem, found.result)
    return found.problem, found.result


def _approach_price(problem: MotionProblem, first: CollocationResult, wanted: float,
                    solver: Solver) -> Iterator[Extremal]:
    """Yield durations whose prices come near to one: they fall about with the fourth power."""
    here, price = first, DURATION.price(problem, first.solution)
    for _ in range(_MOST_DURATIONS):
        factor = float(np.clip((price / wanted)**0.25, SHORTER, 1 / SHORTER))
        if not DURATION.is_possible(factor * problem.task.duration):
            break
        problem = DURATION.with_value(problem, factor * problem.task.duration)
        here = solve_stretched(problem, here.solution, solver)
        price = DURATION.price(problem, here.solution) if here.converged else wanted
        yield Extremal(value=problem.task.duration, price=price, result=here, problem=problem)
        if not here.converged:
            break


def _lengthen(problem: MotionProblem, first: CollocationResult,
              solver: Solver) -> Iterator[Extremal]:
    """Yield longer and longer durations, whose prices fall."""
    here = first
    while problem.task.duration / SHORTER <= MAX_DURATION:
        problem = DURATION.with_value(problem, problem.task.duration / SHORTER)
        here = solve_stretched(problem, here.solution, solver)
        if not here.converged and here.status not in INTERRUPTED:
            return
        yield Extremal(value=problem.task.duration, price=DURATION.price(problem, here.solution),
                       result=here, problem=problem)
