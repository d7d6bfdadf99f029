"""From a problem that is easy to the one that is asked, in steps as large as Newton allows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    BoundaryValueProblem,
    CollocationResult,
    CollocationSolution,
    solve,
    SolverSettings,
    SolverStatus,
)
from flex_planner.collocation.mesh import coarsened
import numpy as np

# on the way solutions need not be exact, and failures must be cheap
_TOLERANCE, _DEFECT, _ITERATIONS = 0.05, 3e-3, 15
# a mesh is refined where a step fails, and loses at most this share where one succeeds
_FINER, _COARSER = 1.5, 0.75
_SMALLEST_STEP = 1 / 256
# so few iterations show that the step may grow
_EASY = 6

STOPPED = (SolverStatus.CANCELED, SolverStatus.TIMEOUT)


def walk(problem_at: Callable[[float], BoundaryValueProblem], start: CollocationSolution,
         settings: SolverSettings, monitor: Monitor, first_step: float) -> CollocationResult:
    """
    Follow the solutions of a family of problems from 0 to 1.

    Parameters
    ----------
    problem_at : callable
        The problem at a share of the way.
    start : CollocationSolution
        Solves the problem at 0, at least nearly.
    settings : SolverSettings
        Of the solution at 1.
    monitor : Monitor
        Watches and may stop it.
    first_step : float
        Share of the way tried first.

    """
    here, step, point = 0.0, first_step, start
    while True:
        there = min(1.0, here + step)
        problem = problem_at(there)
        result = solve(problem, point,
                       settings if there == 1.0 else _cheap(settings), monitor)
        if result.status in STOPPED:
            return result
        if result.converged:
            if there == 1.0:
                return result
            here = there
            fewest = max(settings.intervals, int(_COARSER * result.solution.intervals))
            point = coarsened(problem, result.solution, _DEFECT, fewest)
            step *= 2 if result.iterations <= _EASY else 1
        else:
            step /= 2
            point = _refined(point, settings.max_intervals)
            if step < _SMALLEST_STEP:
                return replace(result, message=f'{result.message} at {there:.1%} of the way')


def _refined(point: CollocationSolution, most: int) -> CollocationSolution:
    """Return the same function on a finer mesh."""
    before = point.intervals
    count = min(int(_FINER * before), max(most, before))
    places = np.linspace(0, before, count + 1)
    return point.on_mesh(np.interp(places, np.arange(before + 1), point.mesh))


def loose(settings: SolverSettings) -> SolverSettings:
    """Return settings for a problem on the way."""
    return replace(settings, error_tolerance=max(_TOLERANCE, settings.error_tolerance))


def _cheap(settings: SolverSettings) -> SolverSettings:
    """Return settings for a step that may fail."""
    return replace(loose(settings), max_iterations=min(_ITERATIONS, settings.max_iterations))
