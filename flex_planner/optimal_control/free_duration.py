"""
Motions whose duration is unknown.

It is an unknown of the boundary-value problem whose rate is zero, so its value is the same at all
points of any iterate: Newton's method keeps linear equations exactly.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationResult, CollocationSolution
from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.free_problem import append_zeros
from flex_planner.optimal_control.motion_problem import Indices, MotionProblem
import numpy as np

# of the first guess of the duration; keeps Newton's method among motions that go forwards
_SHORTEST = 1e-3


class FreeDurationProblem:
    """
    The optimality conditions of a task whose duration T is free.

    The unknowns are (z, T) over the time divided by T, from 0 to 1. With the price rho of a
    second, stationarity in T means H(T) = -rho.

    Parameters
    ----------
    motion : MotionProblem
        Of the task, whose duration is the scale of T.
    price : float
        rho, > 0 [1/s].

    Raises
    ------
    InvalidTaskError
        If the motion has via points, whose times belong to a given duration.

    """

    def __init__(self, motion: MotionProblem, price: float) -> None:
        if motion.junctions.size:
            raise InvalidTaskError('the duration of a motion with via points must be given')
        self.motion, self._price = motion, price
        self.size = motion.size + 1
        self.scale = np.append(motion.scale, _SHORTEST * motion.task.duration)
        self.explicit: Indices = motion.explicit

    def rate(self, t: Array, z: Array) -> Array:
        """Return (T z', 0)."""
        return append_zeros(z[:, -1:] * self.motion.rate(t, z[:, :-1]), 1)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return (T z', 0) and its Jacobian."""
        duration = z[:, -1:]
        rate, inner = self.motion.rate_jacobian(t, z[:, :-1])
        jacobian = np.zeros((len(z), self.size, self.size))
        jacobian[:, :-1, :-1] = duration[..., None] * inner
        jacobian[:, :-1, -1] = rate
        return append_zeros(duration * rate, 1), jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code; None without a compiler or with limits of states."""
        if self.motion.layout.torques or self.motion.compiled_rate() is None:
            return None
        return self.motion.model.compiled_rate('free_duration', self.motion.p)

    def switches(self, t: Array, z: Array) -> Array:
        """Return the motion's."""
        return self.motion.switches(t, z[:, :-1])

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the motion's rows."""
        residual, rows = self.motion.left(z[:-1])
        return residual, append_zeros(rows, 1)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the motion's rows and H + rho, whose gradient is (-psi', x')."""
        residual, rows = self.motion.right(z[:-1])
        point = z[None, :-1]
        hamiltonian = self.motion.controls(np.zeros(1), point).hamiltonian
        hamiltonian = hamiltonian + self.motion.barrier_rate(point)
        rate = self.motion.rate(np.zeros(1), point)
        gradient = append_zeros(self.motion.layout.turn(rate)[0], 1)
        return (np.concatenate([residual, hamiltonian + self._price]),
                np.vstack([append_zeros(rows, 1), gradient]))

    def extend(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with a given duration as a guess."""
        duration = float(solution.mesh[-1])
        stages = append_zeros(solution.stages * duration, 1)
        nodes = np.hstack([solution.nodes, np.full((solution.mesh.size, 1), duration)])
        return CollocationSolution(solution.mesh / duration, nodes, stages, solution.rule)

    def restrict(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the duration, and the motion over its own time."""
        duration = float(solution.nodes[0, -1])
        return duration, CollocationSolution(
            solution.mesh * duration, solution.nodes[:, :-1],
            solution.stages[..., :-1] / duration, solution.rule)

    def restrict_result(self, result: CollocationResult) -> CollocationResult:
        """Return the result of the motion with the duration found."""
        duration, solution = self.restrict(result.solution)
        return replace(result, solution=solution, errors=result.errors[:self.motion.size],
                       switches=result.switches * duration)

    def fix(self, duration: float) -> MotionProblem:
        """Return the same motion with its duration given."""
        return self.motion.with_changes(duration=duration)
