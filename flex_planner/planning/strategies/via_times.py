"""
Times at which via points are passed, where the task leaves them free.

First times are those at which the motion without via points comes nearest to them. From the
motion that passes at those times the jumps of H are led to zero: then no other time near them is
better.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.arms.kinematics import tip_position
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
from flex_planner.planning.strategies.via_homotopy import (
    problems_between,
    solve_bare,
    without_via_points,
)
import numpy as np

# moments at which a motion is looked at, and the least share of the duration between via points
_MOMENTS, _LEAST = 401, 0.04
# a cost that grows by less than this share does not grow
_SAME = 1e-6
_FIRST_STEP = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class TimedMotion:
    """
    A problem with the times of its via points, and a solution, or a failure.

    Attributes
    ----------
    problem : MotionProblem
        Of the task.
    result : CollocationResult
        Of the problem.

    """

    problem: MotionProblem
    result: CollocationResult


def choose_via_times(problem: MotionProblem, solver: Solver) -> TimedMotion:
    """
    Return a problem with free via times at which the motion without via points is nearest.

    The result is that motion, if there is one: times are as they were without.

    """
    solver.monitor.phase = 'motion without via points'
    result = solve_bare(without_via_points(problem), solver)
    times = _nearest_times(problem, result.solution) if result.converged else None
    return TimedMotion(problem if times is None else problem.with_via_times(times), result)


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


def move_free_via_points(near: TimedMotion, solver: Solver) -> TimedMotion:
    """
    Move via points from where a motion passes them to where they should be, their times free.

    Parameters
    ----------
    near : TimedMotion
        The motion without via points, and when it is nearest to them.
    solver : Solver
        Of the motion.

    """
    if not near.result.converged:
        return near
    between, motion = problems_between(near.problem, near.result.solution), near.result.solution
    start = FreeViaTimesProblem(near.problem).extend(place_junctions(near.problem, motion))
    found = follow_homotopy(lambda share: FreeViaTimesProblem(between(share)), start, solver,
                            first_step=_FIRST_STEP)
    return _restrict(near.problem, found)


def free_via_times(problem: MotionProblem, result: CollocationResult,
                   solver: Solver) -> TimedMotion:
    """
    Return the motion near a given one that passes its via points at the best times.

    Parameters
    ----------
    problem : MotionProblem
        With times to start from.
    result : CollocationResult
        Its solution.
    solver : Solver
        Of the motion.

    """
    solver.monitor.phase = 'times of via points freed'
    first = FreeViaTimesProblem(problem)
    start = first.extend(place_junctions(problem, result.solution))
    jumps = first.jumps(start)
    found = follow_homotopy(lambda share: first.with_jumps((1 - share) * jumps), start, solver,
                            first_step=1.0)
    freed = _restrict(problem, found)
    if not freed.result.converged:
        return freed
    before, after = (integrate_totals(each.problem, each.result.solution).cost
                     for each in (TimedMotion(problem, result), freed))
    if after <= before + _SAME * abs(before):
        return freed
    times = ', '.join(f'{time:.4g}' for time in freed.problem.junctions)
    return TimedMotion(problem, replace(
        freed.result, status=SolverStatus.NEWTON_FAILED, message=(
            f'the times of the via points that were found, {times} s, are worse than those to '
            'begin with: give other times')))


def _restrict(problem: MotionProblem, found: CollocationResult) -> TimedMotion:
    """Return the motion of a solution with free times."""
    if found.status in INTERRUPTED:
        return TimedMotion(problem, found)
    freed = FreeViaTimesProblem(problem)
    if not (found.converged and freed.goes_forwards(found.solution)):
        return TimedMotion(problem, replace(
            found, status=SolverStatus.NEWTON_FAILED, message=(
                f'no times of the via points were found that are the best: {found.message}; '
                'given times may do')))
    times, _ = freed.restrict(found.solution)
    return TimedMotion(problem.with_via_times(times), freed.restrict_result(found))
