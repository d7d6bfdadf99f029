"""A solution at the nodes and Gauss points of its mesh, with its torques: evaluated once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.arm_model import Controls
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np

# solutions of which the points are kept: certificate, totals and warnings look at the same one
_KEPT = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledMotion:
    """
    A motion at both ends and the Gauss points of each interval, in order.

    Attributes
    ----------
    theta : numpy.ndarray, shape (s + 2,)
        Positions in an interval, 0 to 1.
    times : numpy.ndarray, shape (N (s + 2),)
        [s]; inner nodes of the mesh come twice.
    weights : numpy.ndarray, shape (N (s + 2),)
        Of a quadrature over the motion; those of nodes are 0.
    z : numpy.ndarray, shape (N (s + 2), m)
        The unknowns.
    controls : Controls
        What they determine.

    """

    theta: Array
    times: Array
    weights: Array
    z: Array
    controls: Controls


@lru_cache(maxsize=_KEPT)
def sample_motion(problem: MotionProblem, solution: CollocationSolution) -> SampledMotion:
    """
    Return a solution at the points of its mesh; the last ones are kept, and not to be changed.

    Parameters
    ----------
    problem : MotionProblem
        m unknowns.
    solution : CollocationSolution
        Of s stages on N intervals.

    """
    rule = solution.rule
    theta = np.concatenate([[0.0], rule.nodes, [1.0]])
    shares = np.concatenate([[0.0], rule.weights, [0.0]])
    z = solution.values_at(theta).reshape(-1, problem.size)
    times = solution.times_at(theta).ravel()
    points = SampledMotion(
        theta=theta, times=times,
        weights=(solution.steps[:, None] * shares).ravel(), z=z,
        controls=problem.controls(times, z))
    for values in (points.theta, points.times, points.weights, points.z):
        values.setflags(write=False)
    return points
