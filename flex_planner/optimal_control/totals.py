"""Integrals over a motion: the cost J of eq. (6), effort, energy, and saturation."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.sampled_motion import sample_motion
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Totals:
    """
    Integrals over a motion, as in `Plan`.

    J of eq. (6), effort [N^2 m^2 s], energy [J], and the share of time of each motor on its limit.

    """

    cost: float
    effort: float
    energy: float
    saturation: Array


def integrate_totals(problem: MotionProblem, solution: CollocationSolution) -> Totals:
    """Return cost, effort and energy, by Gauss quadrature on the mesh."""
    n, n_t = problem.model.arm.n_joints, problem.model.arm.n_coordinates
    points = sample_motion(problem, solution)
    z, controls, weights = points.z, points.controls, points.weights

    def integral(values: Array) -> float:
        return float(weights @ values)

    power = np.abs(controls.torque * z[:, n_t:n_t + n]).sum(axis=1)
    saturated = controls.torque != controls.free_torque
    return Totals(cost=integral(controls.cost_rate) + _terminal_cost(problem, solution),
                  effort=integral((controls.torque ** 2).sum(axis=1)), energy=integral(power),
                  saturation=weights @ saturated / problem.task.duration)


def _terminal_cost(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Return the first terms of eq. (6), and the price of the duration."""
    miss = solution.nodes[-1, :problem.goal.size] - problem.goal
    weights = np.where(np.isinf(problem.goal_weights), 0.0, problem.goal_weights)
    return float(weights @ miss**2 / 2 + problem.task.time_weight * problem.task.duration)
