"""The collocation equations of a problem on a mesh: residual and linearisation."""

from __future__ import annotations

import ctypes

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.compiled_system import factorise_system
from flex_planner.collocation.core import core_problem, CoreSizes, load_core, pack_rule
from flex_planner.collocation.junctions import evaluate_junctions, JunctionRows, NO_JUNCTIONS
from flex_planner.collocation.linear import LinearSystem, Residual
from flex_planner.collocation.problem import (
    BoundaryValueProblem,
    compiled_rate_of,
    RATE_NOT_FINITE,
    SingularSystemError,
)
from flex_planner.collocation.solution import CollocationSolution
import numpy as np

# Jacobian entries evaluated between two looks at the monitor: some milliseconds, some MB
CHUNK = 400_000


def magnitudes(problem: BoundaryValueProblem, solution: CollocationSolution) -> Array:
    """Return the magnitude of each unknown that relative sizes refer to, shape (m,)."""
    largest: Array = np.maximum(np.abs(solution.nodes).max(axis=0), problem.scale)
    return largest


def collocation_residual(problem: BoundaryValueProblem,
                         solution: CollocationSolution) -> Residual:
    """Return the residual of the collocation equations at a point."""
    residual = _compiled_residual(problem, solution)
    if residual is None:
        values = solution.stage_values().reshape(-1, problem.size)
        rate = problem.rate(solution.stage_times().ravel(), values)
        residual = _residual(problem, solution, rate.reshape(solution.stages.shape))
    evaluate_junctions(problem, solution, residual.steps)
    return residual


def _compiled_residual(problem: BoundaryValueProblem,
                       solution: CollocationSolution) -> Residual | None:
    """Return the residual by compiled code, None where there is none."""
    rate = compiled_rate_of(problem)
    if rate is None:
        return None
    left, right = problem.left(solution.nodes[0])[0], problem.right(solution.nodes[-1])[0]
    core = load_core(CoreSizes(problem.size, left.size, problem.explicit.size,
                               solution.rule.stages, 0))
    if core is None:
        return None
    given = [np.ascontiguousarray(values) for values in (
        pack_rule(solution.rule), solution.steps, solution.nodes, solution.stages)]
    stages, gaps = np.empty_like(given[-1]), np.empty((solution.intervals, problem.size))
    addresses = (array.ctypes.data for array in (*given, stages, gaps))
    if core.evaluate(ctypes.byref(core_problem(rate)), solution.intervals, *addresses, None, None):
        raise MemoryError('no memory for the equations of a motion')
    return Residual(stages, gaps, left, right)


def _residual(problem: BoundaryValueProblem, solution: CollocationSolution,
              rate: Array) -> Residual:
    increments = solution.rule.weights @ solution.stages
    gaps = np.diff(solution.nodes, axis=0) - solution.steps[:, None] * increments
    return Residual(solution.stages - rate, gaps, problem.left(solution.nodes[0])[0],
                    problem.right(solution.nodes[-1])[0])


def linearise(problem: BoundaryValueProblem, solution: CollocationSolution, monitor: Monitor,
              *, exact: bool = False) -> tuple[Residual, Array, JunctionRows]:
    """
    Return the residual, the mean of dF/dz over each interval, (N, m, m), and junctions.

    If exact, it is dF/dz at every stage, (N, s, m, m).

    Raises
    ------
    SingularSystemError
        If F or its Jacobian is not finite.
    StoppedError
        If the monitor stopped it.

    """
    count, stages, size = solution.stages.shape
    times, values = solution.stage_times(), solution.stage_values()
    rate = np.empty_like(solution.stages)
    jacobians = np.empty((count, stages, size, size) if exact else (count, size, size))
    chunk = max(1, CHUNK // (stages * size**2))
    for first in range(0, count, chunk):
        monitor.check()
        part = slice(first, first + chunk)
        rates, jacobian = problem.rate_jacobian(times[part].ravel(),
                                                values[part].reshape(-1, size))
        rate[part] = rates.reshape(rate[part].shape)
        by_stage = jacobian.reshape(-1, stages, size * size)
        found = by_stage if exact else solution.rule.weights @ by_stage
        jacobians[part] = found.reshape(jacobians[part].shape)
    if not (np.isfinite(rate).all() and np.isfinite(jacobians).all()):
        raise SingularSystemError(RATE_NOT_FINITE)
    residual = _residual(problem, solution, rate)
    return residual, jacobians, evaluate_junctions(problem, solution, residual.steps)


def factorise(problem: BoundaryValueProblem, solution: CollocationSolution,
              jacobians: Array, junctions: JunctionRows = NO_JUNCTIONS,
              monitor: Monitor | None = None) -> LinearSystem:
    """Return the linear system at a point, given its Jacobians and junctions."""
    return factorise_system(
        solution.rule, solution.steps, jacobians, problem.left(solution.nodes[0])[1],
        problem.right(solution.nodes[-1])[1], magnitudes(problem, solution), problem.explicit,
        junctions, monitor)
