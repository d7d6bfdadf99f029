"""Backends that are not ours: SciPy's solve_bvp, and one that counts its calls."""

from __future__ import annotations

from typing import Any

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    BoundaryValueProblem,
    CollocationResult,
    CollocationSolution,
    GaussRule,
    solve,
    SolverSettings,
    SolverStatus,
)
import numpy as np
from scipy.integrate import solve_bvp

# no two entries are those of the default, or beyond what a variant sets
FINE = SolverSettings(stages=5, intervals=30, max_intervals=1000, max_iterations=40,
                      error_tolerance=1e-7, max_meshes=10)
# a cubic has a quadratic for its derivative, which three points hold exactly
_CUBIC = GaussRule.of(3)
_MAX_NODES = 20000


def solve_by_scipy(problem: BoundaryValueProblem, guess: CollocationSolution,
                   settings: SolverSettings, monitor: Monitor | None = None, *,
                   expected_error: float = 1.0) -> CollocationResult:
    """Solve a problem by solve_bvp, whose cubics become a collocation solution."""
    watch = monitor or Monitor()

    def rate(t: Array, z: Array) -> Array:
        watch.check()
        return problem.rate(t, z.T).T

    def ends(first: Array, last: Array) -> Array:
        return np.concatenate([problem.left(first)[0], problem.right(last)[0]])

    def rows(first: Array, last: Array) -> tuple[Array, Array]:
        left, right = problem.left(first)[1], problem.right(last)[1]
        return (np.vstack([left, np.zeros_like(right)]), np.vstack([np.zeros_like(left), right]))

    with np.errstate(over='ignore', invalid='ignore'):  # it diverges from some guesses
        found = solve_bvp(rate, ends, guess.mesh, guess.nodes.T, bc_jac=rows,
                          max_nodes=_MAX_NODES, tol=settings.error_tolerance,
                          fun_jac=lambda t, z: np.moveaxis(
                              problem.rate_jacobian(t, z.T)[1], 0, 2))
    return _result(found, problem.size)


def _result(found: Any, size: int) -> CollocationResult:
    """Return what solve_bvp returned; its arrays hold a point a column."""
    times = found.x[:-1, None] + np.diff(found.x)[:, None] * _CUBIC.nodes
    stages = found.sol(times.ravel(), 1).T.reshape(*times.shape, size)
    residual = float(found.rms_residuals.max())
    return CollocationResult(
        solution=CollocationSolution(found.x, found.y.T, stages, _CUBIC),
        status=SolverStatus.CONVERGED if found.success else SolverStatus.NEWTON_FAILED,
        errors=np.full(size, residual), residual=residual, switches=np.zeros(0),
        iterations=int(found.niter), meshes=int(found.niter), message=str(found.message))


class CountingBackend:
    """Solves as the default does, and keeps what it was given."""

    def __init__(self) -> None:
        self.settings: list[SolverSettings] = []
        self.monitors: list[Monitor | None] = []
        self.expected_errors: list[float] = []
        self.iterations = 0

    def __call__(self, problem: BoundaryValueProblem, guess: CollocationSolution,
                 settings: SolverSettings, monitor: Monitor | None = None, *,
                 expected_error: float = 1.0) -> CollocationResult:
        self.settings.append(settings)
        self.monitors.append(monitor)
        self.expected_errors.append(expected_error)
        result = solve(problem, guess, settings, monitor, expected_error=expected_error)
        self.iterations += result.iterations
        return result
