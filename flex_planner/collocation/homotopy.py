"""From a problem that is easy to the one that is asked, in steps as large as Newton allows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.collocation.junctions import double_nodes
from flex_planner.collocation.mesh import coarsen
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.result import CollocationResult, INTERRUPTED
from flex_planner.collocation.solution import CollocationSolution
from flex_planner.collocation.solver import Solver
import numpy as np

# error that a mesh along the way is coarsened to
_DEFECT = 3e-3
# a mesh is refined where a step fails, and loses at most this share where one succeeds
_FINER, _COARSER = 1.5, 0.75
_SMALLEST_STEP = 1 / 256
# so few iterations show that the step may grow
_EASY = 6


def follow_homotopy(problem_at: Callable[[float], BoundaryValueProblem],
                    start: CollocationSolution, solver: Solver,
                    first_step: float) -> CollocationResult:
    """
    Follow the solutions of problems that depend on a share, from 0 to 1.

    Parameters
    ----------
    problem_at : callable
        The problem at a share.
    start : CollocationSolution
        Solves the problem at 0, at least nearly.
    solver : Solver
        Of the solution at 1.
    first_step : float
        Share tried first.

    """
    here, step, point, settings = 0.0, first_step, start, solver.settings
    while True:
        there = min(1.0, here + step)
        problem = problem_at(there)
        result = (solver if there == 1.0 else solver.cheap()).solve(problem, point)
        if result.status in INTERRUPTED:
            return result
        if result.converged:
            if there == 1.0:
                return result
            here = there
            fewest = max(settings.intervals, int(_COARSER * result.solution.intervals))
            point = coarsen(problem, result.solution, _DEFECT, fewest)
            step *= 2 if result.iterations <= _EASY else 1
        else:
            step /= 2
            point = _refine_mesh(point, settings.max_intervals)
            if step < _SMALLEST_STEP:
                return replace(result, message=f'{result.message} at {there:.1%} of the homotopy')


def _refine_mesh(point: CollocationSolution, most: int) -> CollocationSolution:
    """Return the same function on a finer mesh."""
    before = point.intervals
    count = min(int(_FINER * before), max(most, before))
    places = np.linspace(0, before, count + 1)
    mesh = np.interp(places, np.arange(before + 1), point.mesh)
    return point.on_mesh(double_nodes(mesh, point.junctions))
