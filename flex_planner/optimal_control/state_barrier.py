"""Motions without limits of controls, as what limits of states are added to."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.barrier_problem import BarrierOfMotion
from flex_planner.optimal_control.smoothed_torque_state import smooth_rates
import numpy as np


class StateBarrier(BarrierOfMotion):
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

    def scale(self, mu: float) -> Array:
        """Return the smallest magnitudes of z that matter."""
        return self.motion.scale

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        return smooth_rates(self.motion.conditions, mu).rate_jacobian(z)

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of y, which is empty."""
        return np.zeros((len(z), 0))

    def guess(self, solution: CollocationSolution, mu: float) -> Array:
        """Return no unknowns at the stages of a motion."""
        return np.zeros((*solution.stages.shape[:2], 0))
