"""Where the interior-point method leaves a payload or a duration, and how a plan begins there."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.interior_point import BarrierOutcome
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.within_limits import COARSE, find_cost_rate
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReachedLimit:
    """
    Where the interior-point method ended.

    Attributes
    ----------
    value : float
        Payload or duration [kg, s].
    gap : float
        What the barrier keeps of it at most: the number of limits times mu and the duration, by
        the price. A bound where the task is convex, else the size of it [kg, s].
    motion : CollocationSolution
        With that value.
    met : BarrierOutcome or None
        The barrier's end, where the motion was found with one.
    free : int
        How many entries of its y are neither slacks nor multipliers.

    """

    value: float
    gap: float
    motion: CollocationSolution
    met: BarrierOutcome | None = None
    free: int = 0

    def unloaded(self) -> BarrierOutcome:
        """Return the barrier's end as that of a motion whose value is given."""
        assert self.met is not None
        return replace(self.met, solution=self.motion)

    def lower_price(self, problem: MotionProblem) -> BarrierOutcome:
        """
        Return a start for the motion of least cost with a value that is a little easier.

        Costates and multipliers at a price that is nearly endless are as many times as large as mu
        is; where the limit is near, they are alike.

        """
        assert self.met is not None
        motion, states = self.motion, np.ones(problem.size)
        states[problem.layout.costates] = 0
        mu = COARSE * find_cost_rate(problem, _scale(motion, states))
        ratio = mu / self.met.mu
        costates = np.ones(problem.size)
        costates[problem.layout.costates] = ratio
        multipliers = np.ones(self.met.y.shape[-1])
        multipliers[self.free + (multipliers.size - self.free) // 2:] = ratio
        near = _scale(motion, costates).stretched(problem.task.duration / motion.mesh[-1])
        return replace(self.met, solution=near, y=self.met.y * multipliers, mu=mu)


def _scale(motion: CollocationSolution, factors: Array) -> CollocationSolution:
    """Return a motion with its unknowns multiplied by factors (m,)."""
    return CollocationSolution(motion.mesh, motion.nodes * factors, motion.stages * factors,
                               motion.rule)
