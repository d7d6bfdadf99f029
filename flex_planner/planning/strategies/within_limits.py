"""
A motion within its limits on the way, from one that leaves them.

The interior-point method takes slacks that are positive, whatever the motion does, and closes the
gap between both while mu falls; its mesh follows. Then the conditions with the barrier that is
left are solved exactly, as those of any motion.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    INTERRUPTED,
    Solver,
)
from flex_planner.collocation.barrier_mesh import follow_barrier
from flex_planner.collocation.equations import magnitudes
from flex_planner.collocation.interior_point import (
    BarrierOutcome,
    BarrierSchedule,
    solve_barrier,
)
from flex_planner.collocation.junctions import double_nodes
from flex_planner.optimal_control.barrier_problem import MotionBarrier
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_barrier import limit_states
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.optimal_control.via_points import free_times
from flex_planner.planning.strategies.via_times import free_via_times
import numpy as np

# of the method, and intervals of its first mesh
STAGES, _FEWEST = 4, 40
# root mean square of what such a mesh may miss of a motion, relative to the unknowns, where it is
# much coarser than one on which nothing can be overlooked
_SHOWN, _FEWER = 0.1, 0.5
# mu in units of the cost per time of the motion that it starts from: at first, with the smallest
# slacks then, where a motion is told from others, and at last; the second of each where the first
# leads to nothing
FIRST, COARSE, _LAST = ((1e-2, 0.1), (1.0, 0.01)), 1e-3, (1e-4, 1e-3)
# at first, too: a barrier as large as the cost leads far from limits, and so to other kinds
STRONG = ((1.0, 0.1),)
# iterations on a mesh: of the interior point, at the end, of a first look from a motion like it
_PATIENCE, _FINISH, _FIRST_LOOK = 60, 30, 10
# iterations after which multipliers need not have settled, see `BarrierSchedule`
_SETTLING = 20
# mu at last and the iterations after which multipliers need not have settled, one after the other
# where the one before leads to no solution: a mesh that is cut until they do may suit better
_ENDS = (_LAST[0], _SETTLING), (_LAST[1], _SETTLING), (_LAST[1], _PATIENCE)
# at first, from a motion that limits have bent, in units of mu at last
_NEAR = 10.0
_TOLERANCE = 1e-2
# of a motion with the motors' limits in the barrier: its certificate says how exact it is
_COARSE_ERROR = 1e-4
# of the mesh at the end: more would take long and are seldom a solution
_MOST_INTERVALS, _MOST_MESHES = 1000, 8
# positions in an interval
_BETWEEN = 17
# mu from one motion to the next, where only one with a larger mu was found at first
_LOWER = 0.3
# of the smallest slacks, below which multipliers grow no more than linearly at the end
_FLOOR = 0.3
# floors below one another, of a motion that passes its limits
_MOST_FLOORS = 8


def approach_limits(problem: MotionProblem, slacks: PathSlacks, near: CollocationSolution,
                    solver: Solver,
                    first: tuple[tuple[float, float], ...] = FIRST, *,
                    solved: bool = False) -> BarrierOutcome:
    """
    Return a motion that keeps its limits at the points of a coarse mesh.

    Parameters
    ----------
    problem : MotionProblem
        Without limits on the way.
    slacks : PathSlacks
        Of the limits.
    near : CollocationSolution
        A motion of the same task, which may leave the limits.
    solver : Solver
        Its monitor may interrupt the work.
    first : tuple of (float, float)
        mu at first, in units of the cost per time, and the smallest slacks then, one after the
        other where those before lead to nothing.
    solved : bool
        Whether the motion shows what rings: where a coarser mesh than the first one shows it, too,
        that is tried before.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    barrier, rate = limit_states(problem, slacks), find_cost_rate(problem, near)
    meshes = [first_mesh(problem, solver)]
    if solved:
        meshes[:0] = _coarser_meshes(problem, near, meshes[0].size)
    for mesh in meshes:
        guess = near.on_mesh(mesh, GaussRule.of(STAGES))
        for share, slack in first:
            schedule = _schedule(share * rate, COARSE * rate, solver)
            y = barrier.guess(guess, schedule.first, slack)
            met = solve_barrier(barrier, guess, y, schedule, solver.monitor)
            if met.converged:
                return met
    return met


def solve_within_limits(problem: MotionProblem, slacks: PathSlacks, met: BarrierOutcome,
                        solver: Solver, *,
                        coarse: bool = False) -> tuple[ConstrainedMotion, CollocationResult]:
    """
    Return the conditions with a small barrier, and their solution if one was found.

    Parameters
    ----------
    problem, slacks, solver
        As of `approach_limits`.
    met : BarrierOutcome
        What that returned.
    coarse : bool
        Whether only the larger barrier is tried, that more motions near the limit of the motors
        are solved with.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    rate = find_cost_rate(problem, met.solution)
    limited = ConstrainedMotion(problem, slacks, _LAST[0] * rate)
    failed: CollocationResult | None = None
    same = 0.0, False
    for last, settling in _ENDS[int(coarse):] if met.converged else ():
        if same == (last, True):  # more iterations before they need not settle change nothing
            continue
        finer = _follow(problem, slacks, met, last * rate, solver, settling)
        limited = limited.with_mu(last * rate).floored(finer.solution, _FLOOR)
        # where the interior point goes to and fro, Newton's method may still settle
        result = _finish(limited, finer.solution, solver)
        if result.converged and not _keeps(limited, result.solution):
            limited, result = _lower_floor(limited, result, solver)
        if result.converged and not coarse:
            limited, result = _lower(limited, result, _LAST[0] * rate, solver)
        limited, result = _at_best_times(limited, result, solver)
        if result.converged or result.status in INTERRUPTED:
            return limited, result
        failed = failed or result
        same = last, finer.iterations <= settling
    return limited, failed or CollocationResult.failed(met.solution, met.message)


def solve_smoothly(problem: MotionProblem, slacks: PathSlacks, met: BarrierOutcome,
                   solver: Solver) -> tuple[ConstrainedMotion, CollocationResult]:
    """
    Return what `solve_within_limits` does, with the barrier as it is, the motors' limits in it.

    Near the largest payload nearly all torques are on their limits, and where links ring they
    switch so often that Newton's method does not find out when.

    Parameters
    ----------
    problem, slacks, solver
        As of `approach_limits`.
    met : BarrierOutcome
        A motion of the problem on the mesh of the method.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    limited = ConstrainedMotion(problem, slacks, met.mu, smooth=True).floored(
        met.solution, _FLOOR)
    return limited, _finish(limited, met.solution, solver.coarse(_COARSE_ERROR))


def solve_again(problem: MotionProblem, slacks: PathSlacks, near: CollocationSolution,
                solver: Solver) -> tuple[ConstrainedMotion, CollocationResult]:
    """
    Return what `solve_within_limits` does, from a motion that limits have bent already.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    rate = find_cost_rate(problem, near)
    limited = ConstrainedMotion(problem, slacks, _LAST[0] * rate).floored(near, _FLOOR)
    quick = solver.with_settings(stages=STAGES).patient(_FIRST_LOOK)
    result = quick.solve(limited, near)
    limited, result = _at_best_times(limited, result, quick)
    kept = result.converged and _keeps(limited, result.solution)
    if kept or result.status in INTERRUPTED:
        return limited, result
    barrier = limit_states(problem, slacks)
    guess, mu = near.on_mesh(first_mesh(problem, solver), GaussRule.of(STAGES)), limited.mu
    met = solve_barrier(barrier, guess, barrier.guess(guess, _NEAR * mu),
                        _schedule(_NEAR * mu, _NEAR * mu, solver), solver.monitor)
    return solve_within_limits(problem, slacks, met, solver)


def first_count(problem: MotionProblem, solver: Solver) -> int:
    """Return how many intervals the interior-point method begins with."""
    return min(max(_FEWEST, problem.fewest_intervals(STAGES)), solver.settings.max_intervals)


def first_mesh(problem: MotionProblem, solver: Solver) -> Array:
    """Return the times of the first mesh, those of via points twice."""
    times = np.linspace(0, problem.task.duration, first_count(problem, solver) + 1,
                        dtype=np.float64)
    return double_nodes(times, problem.junctions)


def _coarser_meshes(problem: MotionProblem, near: CollocationSolution, size: int) -> list[Array]:
    """Return the coarsest even mesh of fewer nodes that shows a motion nearly, if there is one."""
    between, count = np.linspace(0, 1, STAGES + 1, dtype=np.float64), _FEWEST
    scale = magnitudes(problem, near)
    while count < _FEWER * size:
        mesh = double_nodes(np.linspace(0, problem.task.duration, count + 1, dtype=np.float64),
                            problem.junctions)
        shown = near.on_mesh(mesh, GaussRule.of(STAGES))
        there = shown.steps > 0
        values = near(shown.times_at(between)[there].ravel()).reshape(-1, between.size, scale.size)
        gaps = (shown.values_at(between)[there] - values) / scale
        if np.sqrt(np.mean(gaps**2)) < _SHOWN:
            return [mesh]
        count *= 2
    return []


def _schedule(first: float, last: float, solver: Solver) -> BarrierSchedule:
    return BarrierSchedule(first=first, last=last, tolerance=_TOLERANCE, settling=_SETTLING,
                           max_iterations=min(_PATIENCE, solver.settings.max_iterations))


def _follow(problem: MotionProblem, slacks: PathSlacks, met: BarrierOutcome, last: float,
            solver: Solver, settling: int) -> BarrierOutcome:
    """Return the motion at the end of the barrier, which keeps its limits between points, too."""
    states, barrier = problem.layout.states, limit_states(problem, slacks)
    schedule = replace(_schedule(met.mu, min(last, met.mu), solver), settling=settling)
    return follow_barrier(
        barrier, met.solution, met.y, schedule, solver.monitor,
        slacks=lambda z: slacks(z[:, states]), count=slacks.count,
        most_intervals=solver.settings.max_intervals)


def _finish(limited: ConstrainedMotion, near: CollocationSolution,
            solver: Solver) -> CollocationResult:
    """Solve the conditions with their barrier from a motion within the limits."""
    settings = solver.settings
    quick = solver.with_settings(
        stages=STAGES, max_intervals=min(_MOST_INTERVALS, settings.max_intervals),
        max_meshes=min(_MOST_MESHES, settings.max_meshes)).patient(_FINISH)
    result = quick.solve(limited, near)
    if result.converged or result.status in INTERRUPTED:
        return result
    return quick.with_settings(exact=True).solve(limited, near)


def _lower_floor(limited: ConstrainedMotion, soft: CollocationResult,
                 solver: Solver) -> tuple[ConstrainedMotion, CollocationResult]:
    """Return the motion that keeps its limits, from one whose slacks are below their floor."""
    lower = limited.floored(soft.solution, _FLOOR)
    result = _finish(lower, soft.solution, solver)
    for _ in range(_MOST_FLOORS):
        if result.status in INTERRUPTED or (
                result.converged and _keeps(lower, result.solution)):
            break
        # step by step, which is slower than at once
        lower = ConstrainedMotion(limited, limited.slacks, limited.mu, _FLOOR * limited.floor,
                                  smooth=limited.smooth)
        result = _finish(lower, soft.solution, solver)
        if not result.converged:
            break
        limited, soft = lower, result
    return lower, result


def _lower(limited: ConstrainedMotion, result: CollocationResult, least: float,
           solver: Solver) -> tuple[ConstrainedMotion, CollocationResult]:
    """Return the motion with a smaller barrier, as small as it can still be solved with."""
    while limited.mu > least:
        mu = max(least, _LOWER * limited.mu)
        lower = limited.with_mu(mu).floored(result.solution, _FLOOR * mu / limited.mu)
        found = _finish(lower, result.solution, solver)
        if not (found.converged and _keeps(lower, found.solution)):
            break
        limited, result = lower, found
    return limited, result


def _at_best_times(limited: ConstrainedMotion, result: CollocationResult,
                   solver: Solver) -> tuple[ConstrainedMotion, CollocationResult]:
    """Return the motion that passes via points with free times when it is best within limits."""
    if not (result.converged and free_times(limited.task.via_points)):
        return limited, result
    timed = free_via_times(limited, result, solver)
    return limited.with_via_times(timed.problem.junctions), timed.result


def _keeps(limited: ConstrainedMotion, solution: CollocationSolution) -> bool:
    """Return whether a motion keeps its limits between the points of its mesh, too."""
    between = np.linspace(0, 1, _BETWEEN, dtype=np.float64)
    z = solution.values_at(between).reshape(-1, limited.size)
    return bool((limited.slacks(z[:, limited.layout.states]) > 0).all())


def find_cost_rate(problem: MotionProblem, near: CollocationSolution) -> float:
    """Return the cost per time of a motion, or what the motors may spend if it costs nothing."""
    cost = integrate_totals(problem, near).cost / problem.task.duration
    return cost if cost > 0 else MotionBarrier(problem).cost_rate
