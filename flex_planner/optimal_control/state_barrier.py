"""Motions without limits of controls, as what limits of states are added to."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.problem import Indices
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.smoothed_torque_state import smooth_rates
import numpy as np


class StateBarrier:
    """
    A motion as a `BarrierProblem` with nothing to eliminate: y is empty.

    Its rates follow from z alone, bounded rates of torques by a barrier. `PathBarrier` adds limits
    of the states.

    Parameters
    ----------
    motion : MotionProblem
        Whose torques are states.

    """

    free = 0

    def __init__(self, motion: MotionProblem) -> None:
        self.motion, self.size = motion, motion.size
        self.explicit: Indices = motion.explicit
        self.junctions = motion.junctions

    def scale(self, mu: float) -> Array:
        """Return the smallest magnitudes of z that matter."""
        return self.motion.scale

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        return smooth_rates(self.motion.conditions, mu).rate_jacobian(z)

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of y, which is empty."""
        return np.zeros((len(z), 0))

    def longest(self, node: Array, step: Array) -> float:
        """Return 1: the motion may go anywhere."""
        return 1.0

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        return self.motion.left(z)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        return self.motion.right(z)

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point."""
        return self.motion.join(junction, before, after)

    def guess(self, solution: CollocationSolution, mu: float) -> Array:
        """Return no unknowns at the stages of a motion."""
        return np.zeros((*solution.stages.shape[:2], 0))
