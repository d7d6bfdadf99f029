"""The largest rates of torques that have no jumps."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.torque_conditions import TorqueState
import numpy as np

# positions in an interval of the mesh: rates are polynomials there, or on their bound
_POSITIONS = np.linspace(0, 1, 25, dtype=np.float64)


def find_largest_rates(problem: MotionProblem, solution: CollocationSolution) -> Array:
    """Return the largest rate of each torque, (n,) [N m/s]; empty where torques may jump."""
    if not isinstance(problem.conditions, TorqueState):
        return np.zeros(0)
    z = solution.values_at(_POSITIONS).reshape(-1, problem.size)
    largest: Array = np.abs(problem.conditions.torque_rates(z)).max(axis=0)
    return largest
