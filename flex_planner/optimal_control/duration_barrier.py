"""Motions with a free duration, and the motors' limits as a barrier."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.barrier_problem import find_slacks, MotionBarrier
from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.optimal_control.free_problem import append_zeros
from flex_planner.optimal_control.motion_problem import Indices, MotionProblem
import numpy as np

# a duration changes by no more than these shares of itself in a step
_LEAST_LEFT, _MOST_ADDED = 0.6, 1.0


class DurationBarrier(MotionBarrier):
    """
    A motion of least effort and price of its duration, of (z, T, nu) over the time divided by T.

    With ``H_b = H - mu sum_k ln (c_k / c_k0)``, c_k0 of no torque at rest, the derivative of its
    cost by T is the mean of ``H_b + rho``, which is to vanish: ``nu' = H_b + rho`` from 0 to 0.
    Without c_k0 the logarithms of limits that are large numbers would pay for long motions.

    Parameters
    ----------
    motion : MotionProblem
        Of the task, without weights but those of effort.
    price : float
        rho [1/s], > 0.

    """

    def __init__(self, motion: MotionProblem, price: float) -> None:
        super().__init__(motion)
        self.duration = FreeDurationProblem(motion, price)
        self.size, self.price = motion.size + 2, price
        # slacks of no torque at rest
        rest = np.zeros((1, self.free))
        self._at_rest = find_slacks(motion.parameters.torque_limits, rest, rest)[0]
        self.explicit: Indices = np.concatenate([motion.explicit, [self.size - 2, self.size - 1]])

    def scale(self, mu: float) -> Array:
        """Return the magnitudes of the unknowns."""
        return np.concatenate([super().scale(mu), [0.1 * self.motion.task.duration, self.price]])

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        inner, duration, half = z[:, :-2], z[:, -2:-1], self.motion.size // 2
        rate, by_state = super().condense(inner, y, mu)
        full = append_zeros(duration * rate, 2)
        full[:, -1] = self._hamiltonian(inner, rate, y, mu) + self.price
        jacobian = np.zeros((len(z), self.size, self.size))
        jacobian[:, :-2, :-2] = duration[..., None] * by_state
        jacobian[:, :-2, -2] = rate
        # z' is the gradient of H_b turned by a quarter
        jacobian[:, -1, :half], jacobian[:, -1, half:-2] = -rate[:, half:], rate[:, :half]
        return full, jacobian

    def _hamiltonian(self, z: Array, rate: Array, y: Array, mu: float) -> Array:
        """Return H_b once (torques, slacks, multipliers) have moved and z has not, shape (k,)."""
        n, half = self.free, self.motion.size // 2
        weights, count = self.motion.parameters.effort_weights, (y.shape[1] - n) // 2
        step = super().find_step(z, y, np.zeros_like(z), mu)
        torque, slacks = y[:, :n], y[:, n:n + count]
        cost = (torque * (torque / 2 + step[:, :n])) @ weights
        barrier = (np.log(slacks / self._at_rest) + step[:, n:n + count] / slacks).sum(axis=1)
        hamiltonian: Array = cost + np.sum(z[:, half:] * rate[:, :half], axis=1) - mu * barrier
        return hamiltonian

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of (torques, slacks, multipliers) that goes with one of z."""
        return super().find_step(z[:, :-2], y, np.ascontiguousarray(dz[:, :-2]), mu)

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
        """Return a motion with the duration of the task as a guess."""
        extended = self.duration.extend(solution)
        return CollocationSolution(extended.mesh, append_zeros(extended.nodes, 1),
                                   append_zeros(extended.stages, 1), extended.rule)

    def restrict(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the duration, and the motion over its own time."""
        return self.duration.restrict(CollocationSolution(
            solution.mesh, solution.nodes[:, :-1], solution.stages[..., :-1], solution.rule))


def with_end(rows: tuple[Array, Array], z: Array) -> tuple[Array, Array]:
    """Return boundary rows with nu = 0 after them."""
    residual, inner = rows
    last = np.zeros((1, z.size))
    last[0, -1] = 1
    return np.append(residual, z[-1]), np.vstack([append_zeros(inner, 2), last])


def duration_step(duration: float, change: float) -> float:
    """Return the share of a change [s] with which a duration stays positive, and is no jump."""
    room = duration * (_MOST_ADDED if change > 0 else 1 - _LEAST_LEFT)
    return min(1.0, room / max(abs(change), 1e-300))
