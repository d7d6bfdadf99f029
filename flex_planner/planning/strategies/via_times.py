"""
Times at which via points are passed, where the task leaves them free.

First times are those at which the motion without via points comes nearest to them. From the
motion that passes at those times the jumps of H are led to zero: then no other time near them is
better.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    follow_homotopy,
    INTERRUPTED,
    Solver,
    SolverStatus,
)
from flex_planner.collocation.junctions import place_junctions
from flex_planner.optimal_control.free_via_times import FreeViaTimesProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.optimal_control.via_points import free_times
from flex_planner.planning.strategies.initial_guesses import cold_start, lift_rigid_motion
import numpy as np

# moments at which a motion is looked at, and the least share of the duration between via points
_MOMENTS, _LEAST = 401, 0.04
# a cost that grows by less than this share does not grow
_SAME = 1e-6


def choose_via_times(problem: MotionProblem, solver: Solver) -> MotionProblem:
    """Return a problem whose free via times are those of the motion without via points."""
    try:
        bare = MotionProblem(problem.model, replace(problem.task, via_points=()),
                             problem.parameters)
    except FlexPlannerError:
        return problem
    result = cold_start(bare, solver).result
    if not result.converged and result.status not in INTERRUPTED:
        lifted = lift_rigid_motion(bare, solver)
        result = result if lifted is None else lifted.result
    if not result.converged:
        return problem
    times = _nearest_times(problem, result.solution)
    return problem if times is None else problem.with_via_times(times)


def _nearest_times(problem: MotionProblem, motion: CollocationSolution) -> Array | None:
    """Return when a motion comes nearest to via points, in order; None where it does not."""
    via, duration = problem.via, problem.task.duration
    gap = _LEAST * duration
    times = np.linspace(0, duration, _MOMENTS, dtype=np.float64)
    q = motion(times)[:, :problem.model.arm.n_coordinates]
    chosen, earliest = via.times.copy(), 0.0
    for k, point in enumerate(via.points):
        if point.time is None:
            latest = next((t for t, given in zip(via.times[k:], via.given[k:], strict=True)
                           if given), duration)
            latest -= gap * (np.flatnonzero(np.append(via.given[k:], True))[0])
            inside = (times >= earliest + gap) & (times <= latest - gap / 2)
            if not inside.any():
                return None
            chosen[k] = times[inside][_distances(problem, k, q[inside]).argmin()]
        earliest = chosen[k]
    return chosen


def _distances(problem: MotionProblem, index: int, q: Array) -> Array:
    """Return how far coordinates (k, n_t) are from a via point."""
    arm, via = problem.model.arm, problem.via.points[index]
    if via.point.size:
        miss = tip_position(arm, q) - via.point
    else:
        known = np.flatnonzero(np.isfinite(via.positions))
        miss = q[:, known] - via.positions[known]
    distances: Array = np.linalg.norm(miss, axis=1)
    return distances


def free_via_times(problem: MotionProblem, result: CollocationResult,
                   solver: Solver) -> tuple[MotionProblem, CollocationResult]:
    """
    Return the motion near a given one that passes its via points at the best times.

    Parameters
    ----------
    problem : MotionProblem
        With times to start from; nothing is done if the task gives all of them.
    result : CollocationResult
        Its solution.
    solver : Solver
        Of the motion.

    """
    if not (free_times(problem.task.via_points) and result.converged):
        return problem, result
    solver.monitor.phase = 'times of via points freed'
    problem = problem.with_via_times(problem.via.times)
    first = FreeViaTimesProblem(problem)
    start = first.extend(place_junctions(problem, result.solution))
    jumps = first.jumps(start)
    found = follow_homotopy(lambda share: first.with_jumps((1 - share) * jumps), start, solver,
                            first_step=1.0)
    if found.status in INTERRUPTED:
        return problem, found
    failed = replace(result, status=SolverStatus.NEWTON_FAILED, iterations=found.iterations)
    if not found.converged or not first.goes_forwards(found.solution):
        return problem, replace(failed, message=(
            f'no times of the via points were found that are the best: {found.message}; times '
            'that are given, or near them, may do'))
    times, _ = first.restrict(found.solution)
    freed, motion = problem.with_via_times(times), first.restrict_result(found)
    before, after = (integrate_totals(each, solution).cost for each, solution in (
        (problem, result.solution), (freed, motion.solution)))
    if after > before + _SAME * abs(before):
        return problem, replace(failed, message=(
            f'the times of the via points that were found, {", ".join(f"{t:.4g}" for t in times)} '
            f's, are worse than those to begin with: give other times'))
    return freed, motion
