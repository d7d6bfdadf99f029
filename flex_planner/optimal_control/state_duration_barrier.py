"""Motions with a free duration whose torques are states, for the interior-point method."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.problem import Indices
from flex_planner.optimal_control.duration_barrier import duration_step, with_end
from flex_planner.optimal_control.free_problem import append_zeros
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_barrier import PathBarrier
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.state_barrier import StateBarrier
import numpy as np


class StateDurationBarrier(PathBarrier):
    """
    A motion of least effort and price of its duration, of (z, T, nu) over the time divided by T.

    With ``H_b``, H and the barriers of rates and of states, the derivative of its cost by T is the
    mean of ``H_b + rho``, which is to vanish: ``nu' = H_b + rho`` from 0 to 0.

    Parameters
    ----------
    motion : MotionProblem
        Whose torques are states.
    slacks : PathSlacks
        Of the limits of states.
    price : float
        rho [1/s], > 0.

    """

    def __init__(self, motion: MotionProblem, slacks: PathSlacks, price: float) -> None:
        self.states = StateBarrier(motion)
        super().__init__(self.states, slacks)
        self.motion, self.price, inner = motion, price, motion.size
        self.size = inner + 2
        self.explicit: Indices = np.concatenate([motion.explicit, [inner, inner + 1]])

    def scale(self, mu: float) -> Array:
        """Return the magnitudes of the unknowns."""
        scale = self.motion.scale.copy()
        scale[self.motion.layout.costates] *= self.states.growth(mu)
        return np.concatenate([scale, [0.1 * self.motion.task.duration, self.price]])

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        inner, duration, layout = np.ascontiguousarray(z[:, :-2]), z[:, -2:-1], self.motion.layout
        rate, by_state = super().condense(inner, y, mu)
        rates, sigma, lam = self.split(y)
        free, _ = self.states.condense(inner, rates, mu)
        slacks, slopes, _ = self.slacks.linearise(layout.take_states(inner), lam)
        barrier = (np.log(sigma) + (slacks - sigma) / sigma).sum(axis=1)
        full = append_zeros(duration * rate, 2)
        full[:, -1] = self.states.hamiltonian(inner, rates, mu) - mu * barrier + self.price
        jacobian = np.zeros((len(z), self.size, self.size))
        jacobian[:, :-2, :-2] = duration[..., None] * by_state
        jacobian[:, :-2, -2] = rate
        # without limits of states z' is the gradient of H turned by a quarter
        pull = ((mu / sigma)[:, None, :] @ slopes)[:, 0]
        jacobian[:, -1, layout.states] = -free[:, layout.costates] - pull
        jacobian[:, -1, layout.costates] = free[:, layout.states]
        return full, jacobian

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of y that goes with one of z."""
        return super().find_step(z[:, :-2], y, dz[:, :-2], mu)

    def longest(self, node: Array, step: Array) -> float:
        """Return the share of a step with which the duration stays positive, and is no jump."""
        return duration_step(float(node[-2]), float(step[-2]))

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        return with_end(self.motion.left(z[:-2]), z)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        return with_end(self.motion.right(z[:-2]), z)

    def extend(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with its own duration as a guess."""
        duration = float(solution.mesh[-1])
        nodes = append_zeros(solution.nodes, 2)
        nodes[:, -2] = duration
        return CollocationSolution(solution.mesh / duration, nodes,
                                   append_zeros(duration * solution.stages, 2), solution.rule)

    def restrict(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the duration, and the motion over its own time."""
        duration = float(solution.nodes[0, -2])
        return duration, CollocationSolution(
            duration * solution.mesh, solution.nodes[:, :-2],
            solution.stages[..., :-2] / duration, solution.rule)
