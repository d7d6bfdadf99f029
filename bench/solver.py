"""
Time to a solution of a given accuracy, against other ways to the same motion.

The reference is the planner's own solution at a tolerance of 1e-10; the rivals confirm it, since
they come as near to it as their accuracy allows.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
import statistics
import time

from bench.rivals import (
    boundary_value_run,
    direct_run,
    neighbour,
    Reference,
    Run,
    warm_boundary_value_run,
    warm_direct_run,
)
from flex_planner import load_arm, Monitor, plan_path, Task
from flex_planner.collocation import CollocationResult, Solver, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import postures_from_points
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.strategies.initial_guesses import cold_start
import numpy as np

ACCURACIES = (1e-3, 1e-6)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
INTERVALS = (40, 80, 160, 320, 640, 1280, 2560)
PAYLOADS = (1.0, 5.5)
SEARCH_SECONDS = 60.0
# a rival that takes longer is not started warm as well
WARM_SECONDS = 15.0
OURS = tuple(10.0**-k for k in range(1, 9))
Runner = Callable[[MotionProblem, float, Monitor], Run]
RIVALS: dict[str, tuple[Runner, Runner, Sequence[float]]] = {
    'solve_bvp': (boundary_value_run, warm_boundary_value_run, TOLERANCES),
    # of degree 8 as ours; of the usual degree 3 it takes many times longer
    'IPOPT, Radau 8': (lambda p, n, m: direct_run(p, 'radau', n, m, degree=8),
                       lambda p, n, m: warm_direct_run(p, 'radau', n, m, degree=8), INTERVALS),
    'IPOPT, Gauss 8': (lambda p, n, m: direct_run(p, 'gauss', n, m, degree=8),
                       lambda p, n, m: warm_direct_run(p, 'gauss', n, m, degree=8), INTERVALS),
    'IPOPT, Hermite-Simpson': (lambda p, n, m: direct_run(p, 'hermite_simpson', n, m),
                               lambda p, n, m: warm_direct_run(p, 'hermite_simpson', n, m),
                               INTERVALS),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """
    A method at an accuracy.

    Attributes
    ----------
    reached : bool
        Whether it was reached in the time; otherwise the figures are those of the best run.
    level : float
        Its tolerance or its intervals.
    seconds, warm_seconds : float
        From a straight line, and from its solution with 0.5 % other payload.
    cost_error, costate_error : float
        Relative, see `bench.rivals.relative_errors`.

    """

    method: str
    payload: float
    accuracy: float
    reached: bool
    level: float
    intervals: int
    seconds: float
    warm_seconds: float
    cost_error: float
    costate_error: float


def paper_problem(payload: float, arm: str = 'korayem_ei50') -> MotionProblem:
    """Return the motion of sections 5.2 and 5.3 of the paper."""
    chain = load_arm(arm)
    start, goal = postures_from_points(chain, (0.5, 0.0), (0.5, 0.5), elbow=-1)
    task = Task(arm=chain, start_positions=start, goal_positions=goal, duration=1.0,
                payload_mass=payload, effort_weights=np.full(2, 1 / 8))
    return MotionProblem(ArmModel(chain), task, task_parameters(task))


def measure(payload: float) -> list[Row]:
    """Return the rows of one payload."""
    problem = paper_problem(payload)
    exact = plan_path(problem.task, model=problem.model,
                      solver=Solver(SolverSettings(error_tolerance=1e-10)))
    reference = Reference.of(exact)
    rows = _rows('flex_planner', problem, reference, _cold, _warm, OURS, repeats=9)
    for name, (cold, warm, levels) in RIVALS.items():
        print(f'solver: {payload:g} kg, {name}', flush=True)
        rows += _rows(name, problem, reference, cold, warm, levels, repeats=1)
    return rows


def _rows(name: str, problem: MotionProblem, reference: Reference, cold: Runner, warm: Runner,
          levels: Sequence[float], repeats: int) -> list[Row]:
    """Search the levels that reach each accuracy, and time them."""
    met = _search_rows(problem, reference, cold, levels)
    rows = []
    for accuracy in ACCURACIES:
        good = [run for run in met if max(reference.errors(run)) < accuracy]
        run = good[0] if good else min(met, key=lambda one: max(reference.errors(one)))
        seconds = run.seconds if repeats == 1 else statistics.median(
            cold(problem, run.level, Monitor()).seconds for _ in range(repeats))
        limited = Monitor(time_limit=2 * SEARCH_SECONDS)
        quick = seconds < WARM_SECONDS
        warmed = [warm(problem, run.level, limited) for _ in range(repeats if quick else 0)]
        errors = reference.errors(run)
        rows.append(Row(
            method=name, payload=problem.task.payload_mass, accuracy=accuracy,
            reached=bool(good), level=run.level, intervals=run.intervals, seconds=seconds,
            warm_seconds=statistics.median(one.seconds for one in warmed)
            if warmed and all(one.converged for one in warmed) else float('nan'),
            cost_error=errors[0], costate_error=errors[1]))
    return rows


def _search_rows(problem: MotionProblem, reference: Reference, cold: Runner,
                 levels: Sequence[float]) -> list[Run]:
    """Return the runs at one level after another, up to the best accuracy or the time."""
    monitor, met = Monitor(time_limit=SEARCH_SECONDS), []
    for level in levels:
        met.append(cold(problem, level, monitor))
        if max(reference.errors(met[-1])) < min(ACCURACIES) or monitor.stop_reason():
            break
    return met


def _cold(problem: MotionProblem, tolerance: float, monitor: Monitor) -> Run:
    began = time.perf_counter()
    solver = Solver(SolverSettings(error_tolerance=tolerance), monitor)
    result = cold_start(problem, solver).result
    return _run(problem, tolerance, result, time.perf_counter() - began)


def _warm(problem: MotionProblem, tolerance: float, monitor: Monitor) -> Run:
    solver = Solver(SolverSettings(error_tolerance=tolerance), monitor)
    first = cold_start(neighbour(problem), solver).result.solution
    began = time.perf_counter()
    result = solver.solve(problem, first, expected_error=tolerance)
    return _run(problem, tolerance, result, time.perf_counter() - began)


def _run(problem: MotionProblem, tolerance: float, result: CollocationResult,
         seconds: float) -> Run:
    half = problem.size // 2
    return Run(method='flex_planner', level=tolerance, seconds=seconds,
               intervals=result.solution.intervals, costates=result.solution.nodes[0, half:],
               cost=integrate_totals(problem, result.solution).cost, converged=result.converged,
               message=result.message)


def plan_seconds(payload: float, repeats: int = 15) -> tuple[float, float]:
    """Return median times of whole plans at default settings, certificate included."""
    problem = paper_problem(payload)
    near = replace(problem.task, payload_mass=payload * 1.005)
    first = plan_path(problem.task, model=problem.model)
    cold = [plan_path(problem.task, model=problem.model) for _ in range(repeats)]
    warm = [plan_path(near, model=problem.model, start_from=first) for _ in range(repeats)]
    return (statistics.median(plan.planning_time for plan in cold),
            statistics.median(plan.planning_time for plan in warm))


def table(rows: Sequence[Row]) -> str:
    """Return the rows as Markdown."""
    lines = ['| payload [kg] | accuracy | method | level | intervals | error of J | of costates '
             '| cold [s] | times ours | warm [s] | times ours |', '|' + '---|' * 11]
    for row in rows:
        ours = next(one for one in rows if one.method == 'flex_planner'
                    and (one.payload, one.accuracy) == (row.payload, row.accuracy))
        missed = '' if row.reached else ' (not reached)'
        lines.append(
            f'| {row.payload:g} | {row.accuracy:g} | {row.method}{missed} | {row.level:g} '
            f'| {row.intervals} | {row.cost_error:.0e} | {row.costate_error:.0e} '
            f'| {row.seconds:.3g} | {row.seconds / ours.seconds:.3g} | {row.warm_seconds:.3g} '
            f'| {row.warm_seconds / ours.warm_seconds:.3g} |')
    return '\n'.join(lines)


def figures(rows: Sequence[Row]) -> list[dict[str, object]]:
    """Return the rows for JSON."""
    return [asdict(row) for row in rows]
