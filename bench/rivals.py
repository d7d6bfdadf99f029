"""
Other ways to the same motions: SciPy's solve_bvp, and direct collocation with IPOPT.

Each rival runs at a level: a tolerance of solve_bvp, a number of intervals for IPOPT. `find_match`
looks for the level that reaches an accuracy, so that times of equally good results are compared.
solve_bvp evaluates the planner's own compiled functions, IPOPT the programme of
`flex_planner.optimal_control.direct.programme`.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import time
from typing import Any

from flex_planner import Monitor, Plan
from flex_planner.base.progress import StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation import GaussRule
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.result import DirectResult
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
import numpy as np
from scipy.integrate import solve_bvp

TOLERANCES = tuple(10.0**-k for k in range(3, 13))
INTERVALS = tuple(20 * 2**k for k in range(9))
PAYLOAD_CHANGE = 0.005  # of a warm start
_FIRST_NODES = 61
_MAX_NODES = 400_000
_IPOPT_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """
    One attempt of a rival.

    Attributes
    ----------
    method : str
        Which one.
    level : float
        Tolerance or intervals.
    build_seconds, seconds : float
        To derive the problem for CasADi, which serves any payload afterwards; to solve it.
    intervals : int
        Of the last mesh.
    cost : float
        J by quadrature of L.
    costates : numpy.ndarray, shape (2 n_t,)
        At the start of the motion.
    converged : bool
        What the rival says of itself.
    message : str
        In its words.

    """

    method: str
    level: float
    seconds: float
    build_seconds: float = 0.0
    intervals: int = 0
    cost: float = np.nan
    costates: Array
    converged: bool
    message: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """J, initial costates and the largest magnitude of each costate of a much finer solution."""

    cost: float
    costates: Array
    scale: Array

    @classmethod
    def of(cls, plan: Plan) -> Reference:
        """Read them from a plan."""
        if plan.solution is None:
            raise ValueError(f'no reference: {plan.message}')
        psi = plan.solution.nodes[:, plan.problem.size // 2:]
        return cls(cost=plan.cost, costates=psi[0], scale=np.abs(psi).max(axis=0))

    def errors(self, run: Run) -> tuple[float, float]:
        """Return the errors of a run; infinite where it did not converge."""
        if not run.converged:
            return np.inf, np.inf
        return relative_errors(run.cost, run.costates, self.cost, self.costates, self.scale)


def relative_errors(cost: float, costates: Array, reference_cost: float,
                    reference_costates: Array, reference_scale: Array) -> tuple[float, float]:
    """
    Return the relative errors of J and of the initial costates.

    Every costate counts relative to its own largest magnitude along the reference.

    """
    return (abs(cost / reference_cost - 1),
            float(np.max(np.abs(costates - reference_costates) / reference_scale)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Match:
    """The first run that reached an accuracy, or else the best one; errors of J and costates."""

    reached: bool
    run: Run | None
    errors: tuple[float, float]
    attempts: int
    search_seconds: float


def find_match(accuracy: float, run: Callable[[float, Monitor], Run], levels: Sequence[float],
               reference: Reference, *, seconds: float = 120.0) -> Match:
    """
    Run a rival level by level until both errors are below the accuracy.

    Parameters
    ----------
    accuracy : float
        Largest relative error, see `relative_errors`.
    run : callable
        Level and monitor to `Run`.
    levels : sequence of float
        From coarse to fine.
    reference : Reference
        What is taken for exact.
    seconds : float
        For all levels together.

    """
    monitor, best, errors = Monitor(time_limit=seconds), None, (np.inf, np.inf)
    attempts = 0
    for attempts, level in enumerate(levels, 1):  # noqa: B007
        found = run(level, monitor)
        new = reference.errors(found)
        if best is None or max(new) < max(errors):
            best, errors = found, new
        if max(errors) < accuracy or monitor.elapsed > seconds:
            break
    return Match(reached=max(errors) < accuracy, run=best, errors=errors, attempts=attempts,
                 search_seconds=monitor.elapsed)


def neighbour(problem: MotionProblem) -> MotionProblem:
    """Return the same motion with a payload that differs a little."""
    task = replace(problem.task, payload_mass=problem.task.payload_mass * (1 + PAYLOAD_CHANGE))
    return MotionProblem(problem.model, task, task_parameters(task))


def boundary_value_run(problem: MotionProblem, tolerance: float, monitor: Monitor | None = None,
                       first: Any = None) -> Run:
    """
    Run solve_bvp with the planner's compiled right-hand side and Jacobian.

    Parameters
    ----------
    problem : MotionProblem
        The motion.
    tolerance : float
        ``tol`` of solve_bvp.
    monitor : Monitor, optional
        May stop it.
    first : optional
        What solve_bvp returned for another motion, to start from; a straight line with zero
        costates if not given.

    """
    began = time.perf_counter()
    try:
        found = _boundary_value_solution(problem, tolerance, monitor or Monitor(), first)
    except StoppedError as stop:
        return Run(method='solve_bvp', level=tolerance, seconds=time.perf_counter() - began,
                   costates=np.full(problem.size // 2, np.nan), converged=False,
                   message=str(stop))
    return Run(method='solve_bvp', level=tolerance, seconds=time.perf_counter() - began,
               intervals=found.x.size - 1, cost=_cost(problem, found),
               costates=found.y[problem.size // 2:, 0], converged=bool(found.success),
               message=str(found.message))


def warm_boundary_value_run(problem: MotionProblem, tolerance: float,
                            monitor: Monitor | None = None) -> Run:
    """Run solve_bvp from its solution of the neighbour, which is not timed."""
    try:
        first = _boundary_value_solution(neighbour(problem), tolerance, monitor or Monitor(), None)
    except StoppedError:
        first = None
    return boundary_value_run(problem, tolerance, monitor, first)


def _boundary_value_solution(problem: MotionProblem, tolerance: float, monitor: Monitor,
                             first: Any) -> Any:
    """Return the result of solve_bvp; its arrays have one column per point."""
    half, rows = problem.size // 2, np.eye(problem.size // 2, problem.size)
    none = np.zeros_like(rows)
    jacobians = np.vstack([rows, none]), np.vstack([none, rows])
    line = problem.straight_line(_FIRST_NODES - 1, GaussRule.of(2))
    mesh, values = (line.mesh, line.nodes.T) if first is None else (first.x, first.y)

    def rate(t: Array, z: Array) -> Array:
        monitor.check()
        return problem.model.optimality(z.T, problem.p).T

    def rate_jacobian(t: Array, z: Array) -> Array:
        monitor.check()
        return np.moveaxis(problem.model.optimality_jacobian(z.T, problem.p)[1], 0, 2)

    def ends(first: Array, last: Array) -> Array:
        return np.concatenate([first[:half] - problem.start, last[:half] - problem.goal])

    return solve_bvp(rate, ends, mesh, values, fun_jac=rate_jacobian,
                     bc_jac=lambda first, last: jacobians, tol=tolerance, max_nodes=_MAX_NODES)


def _cost(problem: MotionProblem, found: Any) -> float:
    """Return J along the cubic interpolant of solve_bvp, by five Gauss points per interval."""
    points, weights = np.polynomial.legendre.leggauss(5)
    steps = np.diff(found.x)
    times = found.x[:-1, None] + steps[:, None] * (points + 1) / 2
    rates = problem.model.controls(found.sol(times.ravel()).T, problem.p).cost_rate
    return float(np.sum(steps / 2 * (rates.reshape(times.shape) @ weights)))


def direct_run(problem: MotionProblem, scheme: str, intervals: float,
               monitor: Monitor | None = None, *, degree: int = 3) -> Run:
    """Run direct collocation from a straight line."""
    direct = _direct(problem, scheme, intervals, degree)
    return _direct_outcome(direct, _solve(direct, problem, monitor, None))


def warm_direct_run(problem: MotionProblem, scheme: str, intervals: float,
                    monitor: Monitor | None = None, *, degree: int = 3) -> Run:
    """Run direct collocation from its unknowns and multipliers for the neighbour, not timed."""
    direct = _direct(problem, scheme, intervals, degree)
    first = _solve(direct, neighbour(problem), monitor, None)
    return _direct_outcome(direct, _solve(direct, problem, monitor, first))


def _direct(problem: MotionProblem, scheme: str, intervals: float, degree: int) -> DirectProblem:
    return DirectProblem(problem.model, DirectSettings(
        scheme=scheme, degree=degree, intervals=int(intervals), tolerance=_IPOPT_TOLERANCE))


def _solve(direct: DirectProblem, problem: MotionProblem, monitor: Monitor | None,
           warm: DirectResult | None) -> DirectResult:
    """Return the result of direct collocation for a motion."""
    return direct.solve(problem.parameters, problem.start, problem.goal, problem.task.duration,
                        warm=warm, monitor=monitor)


def _direct_outcome(direct: DirectProblem, result: DirectResult) -> Run:
    """Return a result as a run."""
    settings = direct.settings
    points = '' if settings.scheme == 'hermite_simpson' else f' {settings.degree}'
    return Run(method=f'IPOPT, {settings.scheme}{points}', level=settings.intervals,
               seconds=result.seconds, build_seconds=direct.build_seconds,
               intervals=settings.intervals, cost=result.cost, costates=result.costates[0],
               converged=result.converged, message=result.message)
