"""
Heavy payloads of arms that ring so much that Newton's method does not find their motions.

Links that bend at their ends are driven by the hub torques so directly that near the largest
payload bang-bang torques switch many times. IPOPT finds such motions from a straight line, but on
a coarse mesh not exactly enough: its mesh is improved like that of the collocation solver until
the motion and its multipliers are a start for Newton's method.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    BoundaryValueProblem,
    CollocationResult,
    CollocationSolution,
    GaussRule,
    solve,
    SolverSettings,
)
from flex_planner.collocation.homotopy import STOPPED
from flex_planner.collocation.mesh import defects, levelled, switching_times
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.free_payload import PayloadProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.price_continuation import changed, Enough, Extremal
import numpy as np

# points an interval, intervals of the first mesh and of the finest
_STAGES, _INTERVALS, _MOST_FIRST, _MOST_INTERVALS = 5, 40, 43, 160
# of the meshes at one price, each so many times as fine
_MESHES, _FINER = 3, 1.4
_ITERATIONS, _TOLERANCE = 150, 1e-7
# of Newton's method from there; exact, since near the limit little payload has a high price
_NEWTON, _EXACT = 30, 1e-7
# the first price, by a rigid arm's; it is raised so much at most, to what leaves this share of
# the room that is wanted
_FIRST, _DEARER, _SURE, _LEAST_FACTOR = 4.0, 16.0, 0.8, 1.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    """What IPOPT found: a motion with the problem of its payload, and whether it converged."""

    problem: MotionProblem
    solution: CollocationSolution
    converged: bool


def hard_payloads(problem: MotionProblem, price: float, settings: SolverSettings, monitor: Monitor,
                  enough: Enough) -> Iterator[Extremal]:
    """
    Yield heavier and heavier payloads from a price on, as far as IPOPT and Newton's method lead.

    It begins at a multiple of that price: with more torques on their limits IPOPT needs fewer
    iterations. Only motions that solve the optimality conditions are yielded, and a last one that
    says so if the monitor stopped the search.

    """
    fewest = problem.fewest_intervals(_STAGES)
    if np.isfinite(problem.goal_weights).any() or fewest > _MOST_FIRST:
        return  # the transcription knows hard goals only, and takes minutes on fine meshes
    duration, guess, value = problem.task.duration, None, problem.task.payload_mass
    intervals = max(_INTERVALS, fewest)
    mesh = np.linspace(0, duration, intervals + 1, dtype=np.float64)
    before = price = _FIRST * price
    factor = _DEARER
    while factor > _LEAST_FACTOR:
        stop = _priced(problem, price, mesh, guess, settings, monitor)
        if stop is None or not (stop.stopped or stop.value > value):
            if guess is None:
                return
            factor **= 0.5
        else:
            yield stop
            if stop.stopped:
                return
            problem, guess, value = stop.problem, stop.result.solution, stop.value
            mesh = _levelled(problem, guess, intervals)
            before, factor = price, _factor(stop, factor, enough)
        price = before * factor


def _factor(stop: Extremal, largest: float, enough: Enough) -> float:
    """Return the factor in price that leaves little enough room, which goes with its inverse."""
    wanted = enough(stop.value)
    if not wanted:
        return largest
    return min(max(stop.room / (_SURE * wanted), 1.1 * _LEAST_FACTOR), largest)


def _priced(problem: MotionProblem, price: float, mesh: Array,
            guess: CollocationSolution | None, settings: SolverSettings,
            monitor: Monitor) -> Extremal | None:
    """Return the motion whose payload is worth a price, on better and better meshes; or None."""
    for _ in range(_MESHES):
        found = _transcribed(problem, price, mesh, guess, monitor)
        ahead = PayloadProblem(found.problem.model, found.problem.task,
                               found.problem.parameters, price)
        start = ahead.extended(found.solution)
        result = solve(ahead, start, _newton(settings), monitor)
        if result.converged or result.status in STOPPED:
            return _stop(ahead, result, price)
        if not found.converged:
            return None
        problem, guess = found.problem, found.solution
        mesh = _levelled(ahead, start, int(_FINER * start.intervals))
    return None


def _newton(settings: SolverSettings) -> SolverSettings:
    """Return settings for Newton's method from a motion of IPOPT, with its own rule."""
    return replace(settings, stages=_STAGES, error_tolerance=_EXACT,
                   max_iterations=min(_NEWTON, settings.max_iterations))


def _stop(ahead: PayloadProblem, result: CollocationResult, price: float) -> Extremal:
    """Return a solution as a stop."""
    payload, inner = ahead.restricted(result.solution)
    if not result.converged:
        return Extremal(value=payload, price=price, result=result, problem=ahead.motion)
    return Extremal(value=payload, price=price, result=replace(result, solution=inner),
                    problem=ahead.with_payload(payload))


def _transcribed(problem: MotionProblem, price: float, mesh: Array,
                 guess: CollocationSolution | None, monitor: Monitor) -> _Found:
    """Return what IPOPT finds on a mesh, with its multipliers as costates."""
    duration = problem.task.duration
    direct = DirectProblem(problem.model, DirectSettings(
        scheme='gauss', degree=_STAGES, intervals=mesh.size - 1, tolerance=_TOLERANCE,
        max_iterations=_ITERATIONS, free_payload=True), mesh / duration)
    found = direct.solve(problem.parameters, problem.start, problem.goal, duration, guess=guess,
                         price=price, monitor=monitor)
    motion = changed(problem, payload_mass=found.payload)
    points = np.hstack([found.point_states, found.point_costates])
    rates = motion.rate(found.point_times, points).reshape(mesh.size - 1, _STAGES, -1)
    solution = CollocationSolution(mesh, np.hstack([found.states, found.costates]), rates,
                                   GaussRule.of(_STAGES))
    return _Found(problem=motion, solution=solution, converged=found.converged)


def _levelled(problem: BoundaryValueProblem, solution: CollocationSolution,
              count: int) -> Array:
    """Return a mesh of so many intervals with nodes on the switches."""
    count = min(count, max(_MOST_INTERVALS, solution.intervals))
    return levelled(solution, defects(problem, solution), 1.0,
                    switching_times(problem, solution), fewest=count, most=count)
