"""
Heavy payloads of arms that ring so much that Newton's method does not find their motions.

Links that bend at their ends are driven by the hub torques so directly that near the largest
payload bang-bang torques switch many times. IPOPT finds such motions from a straight line, but on
a coarse mesh not exactly enough: its mesh is improved like that of the collocation solver until
the motion and its multipliers are a start for Newton's method.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    BoundaryValueProblem,
    CollocationResult,
    CollocationSolution,
    INTERRUPTED,
    Solver,
)
from flex_planner.collocation.mesh import defects, level_mesh, switching_times
from flex_planner.optimal_control.direct.conversion import to_solution
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.free_problem import FreeProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.extremals import Extremal, TargetGap
from flex_planner.planning.strategies.free_parameters import FreeParameter, PAYLOAD
import numpy as np

# points per interval, intervals of the first mesh and of the finest
_STAGES, _INTERVALS, _MOST_FIRST, _MOST_INTERVALS = 5, 40, 43, 160
# of the meshes at one price, each so many times as fine
_MESHES, _FINER = 3, 1.4
_ITERATIONS, _TOLERANCE = 150, 1e-7
# of Newton's method from there; exact, since near the limit little payload has a high price
_NEWTON, _EXACT = 30, 1e-7
# the first price, by a rigid arm's; it is raised so much at most, to what leaves this share of
# the gap that is wanted
_FIRST, _DEARER, _SURE, _LEAST_FACTOR = 4.0, 16.0, 0.8, 1.5

# a jump in price where Newton's method has stalled: to this share of the gap wanted, within
# bounds, on a mesh of so many intervals
_SURE_JUMP, _LEAST_JUMP, _JUMP, _JUMP_INTERVALS = 0.5, 4.0, 64.0, 60


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Transcribed:
    """A motion of IPOPT with the problem of its payload, and whether it converged."""

    problem: MotionProblem
    solution: CollocationSolution
    converged: bool


def continue_by_ipopt(problem: MotionProblem, price: float, solver: Solver,
                      target_gap: TargetGap) -> Iterator[Extremal]:
    """
    Yield heavier and heavier payloads from a price on, as far as IPOPT and Newton's method lead.

    It begins at a multiple of that price: with more torques on their limits IPOPT needs fewer
    iterations. Only motions that solve the optimality conditions are yielded, and a last one that
    says so if the monitor interrupted the search.

    """
    fewest = _fewest_intervals(problem)
    if fewest is None:
        return
    duration, guess, value = problem.task.duration, None, problem.task.payload_mass
    intervals = max(_INTERVALS, fewest)
    mesh = np.linspace(0, duration, intervals + 1, dtype=np.float64)
    before = price = _FIRST * price
    factor = _DEARER
    while factor > _LEAST_FACTOR:
        extremal = _solve_at_price(PAYLOAD, problem, price, mesh, guess, solver)
        if extremal is None or not (extremal.interrupted or extremal.value > value):
            if guess is None:
                return
            factor **= 0.5
        else:
            yield extremal
            if extremal.interrupted:
                return
            problem, guess, value = extremal.problem, extremal.result.solution, extremal.value
            mesh = _level(problem, guess, intervals)
            before, factor = price, _factor(extremal, factor, target_gap)
        price = before * factor


def transcribe_at_price(parameter: FreeParameter, problem: MotionProblem, price: float,
                        value: float, make_guess: Callable[[MotionProblem], CollocationSolution],
                        solver: Solver) -> Extremal | None:
    """
    Return the motion at a price that IPOPT finds from a guess and Newton's method makes exact.

    Parameters
    ----------
    parameter : FreeParameter
        What is free.
    problem : MotionProblem
        With hard goals.
    price, value : float
        Of the free parameter; the value is that of the guess.
    make_guess : callable
        From the motion with that value to a guess.
    solver : Solver
        If its monitor interrupts it, the extremal says so.

    """
    fewest = _fewest_intervals(problem)
    if fewest is None:
        return None
    try:
        near = parameter.with_value(problem, value)
    except FlexPlannerError:  # too heavy to hold
        return None
    mesh = np.linspace(0, near.task.duration, max(_INTERVALS, fewest) + 1, dtype=np.float64)
    return _solve_at_price(parameter, near, price, mesh, make_guess(near), solver)


def jump_in_price(parameter: FreeParameter, here: Extremal, target_gap: TargetGap,
                  solver: Solver) -> Extremal | None:
    """
    Return a motion at a much higher price, where Newton's method alone comes on in small steps.

    Parameters
    ----------
    parameter : FreeParameter
        What is free.
    here : Extremal
        The motion to jump from.
    target_gap : callable
        From a value to the gap that is wanted.
    solver : Solver
        If its monitor interrupts it, the extremal says so.

    """
    problem, guess = here.problem, here.result.solution
    fewest = _fewest_intervals(problem)
    if fewest is None:
        return None
    wanted = target_gap(here.value)
    factor = _JUMP if not wanted else float(
        np.clip(here.gap / (_SURE_JUMP * wanted), _LEAST_JUMP, _JUMP))
    mesh = _level(problem, guess, max(_JUMP_INTERVALS, fewest))
    found = _solve_at_price(parameter, problem, factor * here.price, mesh, guess, solver)
    if found is None or found.interrupted:
        return found
    return found if parameter.improves(found.value, here.value) else None


def _fewest_intervals(problem: MotionProblem) -> int | None:
    """Return the intervals of the coarsest mesh; None where IPOPT is no way to the motion."""
    if np.isfinite(problem.goal_weights).any() or problem.junctions.size:
        return None  # the transcription knows hard goals only, and no via points
    fewest = problem.fewest_intervals(_STAGES)
    return fewest if fewest <= _MOST_FIRST else None  # and takes minutes on fine meshes


def _factor(extremal: Extremal, largest: float, target_gap: TargetGap) -> float:
    """Return the factor in price that leaves the gap wanted, which goes with its inverse."""
    wanted = target_gap(extremal.value)
    if not wanted:
        return largest
    return min(max(extremal.gap / (_SURE * wanted), 1.1 * _LEAST_FACTOR), largest)


def _solve_at_price(parameter: FreeParameter, problem: MotionProblem, price: float, mesh: Array,
                    guess: CollocationSolution | None, solver: Solver) -> Extremal | None:
    """Return the motion whose value is worth a price, on better and better meshes; or None."""
    for _ in range(_MESHES):
        try:
            found = _transcribe(parameter, problem, price, mesh, guess, solver.monitor)
            ahead = parameter.free(found.problem, price)
            start = ahead.extend(found.solution)
            result = _exact(solver).solve(ahead, start)
            if result.converged or result.status in INTERRUPTED:
                return _extremal(ahead, found.problem, result, price)
        except FlexPlannerError:  # a payload of an iterate: too heavy to hold, or below none
            return None
        if not found.converged:
            return None
        problem, guess = found.problem, found.solution
        mesh = _level(ahead, start, int(_FINER * start.intervals))
    return None


def _exact(solver: Solver) -> Solver:
    """Return a solver for Newton's method from a motion of IPOPT, with its own rule."""
    return solver.with_settings(stages=_STAGES, error_tolerance=_EXACT).patient(_NEWTON)


def _extremal(ahead: FreeProblem, motion: MotionProblem, result: CollocationResult,
              price: float) -> Extremal:
    """Return a solution as an extremal."""
    value, _ = ahead.restrict(result.solution)
    if not result.converged:
        return Extremal(value=value, price=price, result=result, problem=motion)
    return Extremal(value=value, price=price, result=ahead.restrict_result(result),
                    problem=ahead.fix(value))


def _transcribe(parameter: FreeParameter, problem: MotionProblem, price: float, mesh: Array,
                guess: CollocationSolution | None, monitor: Monitor) -> _Transcribed:
    """Return IPOPT's motion on a mesh, with its multipliers as costates."""
    duration = mesh[-1]
    direct = DirectProblem(problem.model, DirectSettings(
        scheme='gauss', degree=_STAGES, intervals=mesh.size - 1, tolerance=_TOLERANCE,
        max_iterations=_ITERATIONS), mesh / duration)
    found = direct.solve(problem.parameters, problem.start, problem.goal, problem.task.duration,
                         guess=guess, free=parameter.unknown, price=price, monitor=monitor)
    motion = problem.with_changes(payload_mass=max(found.payload, 0.0), duration=found.duration)
    return _Transcribed(problem=motion, solution=to_solution(found, motion),
                        converged=found.converged)


def _level(problem: BoundaryValueProblem, solution: CollocationSolution,
           count: int) -> Array:
    """Return a mesh of so many intervals with nodes on the switches."""
    count = min(count, max(_MOST_INTERVALS, solution.intervals))
    return level_mesh(solution, defects(problem, solution), 1.0,
                      switching_times(problem, solution), fewest=count, most=count)
