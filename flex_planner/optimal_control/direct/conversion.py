"""IPOPT's motions as solutions of the optimality conditions: starts for Newton's method."""

from __future__ import annotations

from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.optimal_control.direct.result import DirectResult
from flex_planner.optimal_control.motion_problem import MotionProblem


def to_solution(found: DirectResult, motion: MotionProblem) -> CollocationSolution:
    """
    Return a motion of the Gauss scheme, with its multipliers as costates.

    Parameters
    ----------
    found : DirectResult
        Of the scheme ``gauss``.
    motion : MotionProblem
        With its payload and duration.

    """
    intervals = found.times.size - 1
    degree = found.point_times.size // intervals
    rates = motion.rate(found.point_times, found.points).reshape(intervals, degree, -1)
    return CollocationSolution(found.times, found.nodes, rates, GaussRule.of(degree))
