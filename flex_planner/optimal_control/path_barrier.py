"""
Limits on the way beside those of the motors, for the interior-point method.

At every point the limits have slacks sigma and multipliers lam of their own, with ``s(q, q') -
sigma = 0`` and ``lam sigma = mu``: a motion may start outside of its limits, sigma may not. They
are eliminated apart from the torque, which no limit on the way knows.

"""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.problem import Indices
from flex_planner.optimal_control.barrier_problem import MotionBarrier
from flex_planner.optimal_control.constrained_motion import eliminate_slacks, step_slacks
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.state_barrier import StateBarrier
import numpy as np

# slacks begin with at least so much
_FIRST_SLACK = 0.1


class PathBarrier:
    """
    A `BarrierProblem` with limits on the way added; y is (u, s, sigma, l, lam).

    Parameters
    ----------
    inner : MotionBarrier or StateBarrier
        Of the motors' limits, or of none where torques are states; its unknowns begin with those
        of a motion.
    slacks : PathSlacks
        Of the limits on the way.

    """

    def __init__(self, inner: MotionBarrier | StateBarrier, slacks: PathSlacks) -> None:
        self.inner, self.slacks = inner, slacks
        self.size: int = inner.size
        self.free: int = inner.free
        self.explicit: Indices = inner.explicit
        self.junctions = inner.junctions
        self._layout = inner.motion.layout

    def scale(self, mu: float) -> Array:
        """Return the smallest magnitudes of z that matter."""
        return self.inner.scale(mu)

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        own, sigma, lam = self.split(y)
        states, costates = self._layout.states, self._layout.costates
        rate, jacobian = self.inner.condense(z, own, mu)
        pull, stiffness = eliminate_slacks(self.slacks, self._layout.take_states(z), sigma, lam,
                                           mu)
        rate[:, costates] += pull
        jacobian[:, costates[:, None], states] += stiffness
        return rate, jacobian

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of y that goes with one of z."""
        own, sigma, lam = self.split(y)
        take = self._layout.take_states
        step = self.inner.find_step(z, own, dz, mu)
        steps = step_slacks(self.slacks, take(z), sigma, lam, take(dz), mu)
        return self._join(step, *steps)

    def longest(self, node: Array, step: Array) -> float:
        """Return the share of a step that the motion may take."""
        return self.inner.longest(node, step)

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        return self.inner.left(z)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        return self.inner.right(z)

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point."""
        return self.inner.join(junction, before, after)

    def guess(self, solution: CollocationSolution, mu: float,
              least: float = _FIRST_SLACK) -> Array:
        """Return torques inside their limits, slacks of at least so much, and multipliers."""
        own = self.inner.guess(solution, mu)
        z = solution.stage_values().reshape(-1, solution.nodes.shape[1])
        slacks = self.slacks(self._layout.take_states(z))
        sigma = np.maximum(slacks, least).reshape(*own.shape[:2], -1)
        return self._join(own, sigma, mu / sigma)

    def split(self, y: Array) -> tuple[Array, Array, Array]:
        """Return what is the motors', sigma and lam."""
        count = self.slacks.count
        middle = self.free + (y.shape[-1] - self.free) // 2
        own = np.concatenate([y[..., :middle - count], y[..., middle:-count]], axis=-1)
        return own, y[..., middle - count:middle], y[..., -count:]

    def _join(self, own: Array, sigma: Array, lam: Array) -> Array:
        middle = self.free + (own.shape[-1] - self.free) // 2
        return np.concatenate([own[..., :middle], sigma, own[..., middle:], lam], axis=-1)


def limit_states(problem: MotionProblem, slacks: PathSlacks) -> PathBarrier:
    """Return the barrier of a motion with limits of its states."""
    inner = StateBarrier(problem) if problem.layout.torques else MotionBarrier(problem)
    return PathBarrier(inner, slacks)
