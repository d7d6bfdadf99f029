"""
A second formulation of via points, for comparison: phases that run beside one another.

The phase before the via point runs forwards over [0, 1], that after it backwards, so that all
that holds at the via point stands at one end. Multipliers nu and the time are unknowns.

"""

from __future__ import annotations

from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class StackedPhases:
    """The conditions of a task with one via point, of (z_before, z_after, t_1, nu)."""

    def __init__(self, motion: MotionProblem) -> None:
        self.motion, self.m = motion, motion.size
        self.count = motion.task.via_points[0].conditions
        self.size = 2 * self.m + 1 + self.count
        costate = motion.scale[self.m // 2:3 * self.m // 4].max()
        self.scale = np.concatenate([motion.scale, motion.scale, [1e-3],
                                     np.full(self.count, costate)])
        self.explicit = np.zeros(0, dtype=np.intp)

    def rate(self, t: Array, z: Array) -> Array:
        return self.rate_jacobian(t, z)[0]

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        m, first = self.m, z[:, 2 * self.m, None]
        last = first - self.motion.task.duration  # backwards
        rate, jacobian = np.zeros_like(z), np.zeros((len(z), self.size, self.size))
        for part, length in ((slice(0, m), first), (slice(m, 2 * m), last)):
            own, inner = self.motion.rate_jacobian(t, z[:, part])
            rate[:, part], jacobian[:, part, part] = length * own, length[..., None] * inner
            jacobian[:, part, 2 * m] = own
        return rate, jacobian

    def switches(self, t: Array, z: Array) -> Array:
        m = self.m
        return np.hstack([self.motion.switches(t, z[:, :m]),
                          self.motion.switches(t, z[:, m:2 * m])])

    def left(self, z: Array) -> tuple[Array, Array]:
        m, half = self.m, self.m // 2
        rows = np.zeros((m, self.size))
        rows[:half, :half] = rows[half:, m:m + half] = np.eye(half)
        return rows @ z - np.concatenate([self.motion.start, self.motion.goal]), rows

    def right(self, z: Array) -> tuple[Array, Array]:
        residual = self._meet(z)
        steps = 1e-6 * np.eye(self.size)
        rows = np.stack([(self._meet(z + step) - self._meet(z - step)) / 2e-6
                         for step in steps], axis=1)
        return residual, rows

    def _meet(self, z: Array) -> Array:
        """Return what does not hold at the via point."""
        m, n_t = self.m, self.m // 4
        before, after, time, nu = z[:m], z[m:2 * m], z[2 * m], z[2 * m + 1:]
        miss, C = self.motion.via.miss(0, before[:n_t])
        gap = after - before
        gap[2 * n_t:3 * n_t] += C.T @ nu
        given = self.motion.task.via_points[0].time
        controls = self.motion.model.controls(np.stack([before, after]), self.motion.p)
        last = time - given if given is not None else np.diff(controls.hamiltonian)[0]
        return np.concatenate([gap, miss, [last]])

    def guess(self, near: CollocationSolution, intervals: int = 20) -> CollocationSolution:
        """Return a motion that passes its via point as a guess."""
        T, time = self.motion.task.duration, float(self.motion.via.times[0])
        s = np.linspace(0, 1, intervals + 1)
        ends = np.clip(s * time, 0, time - 1e-9), T - s * (T - time)
        nodes = np.column_stack([near(ends[0]), near(ends[1]), np.full(s.size, time),
                                 np.zeros((s.size, self.count))])
        return CollocationSolution.from_values(s, nodes, GaussRule.of(8))

    def cost(self, solution: CollocationSolution) -> tuple[float, float]:
        """Return J, and when the via point is passed."""
        z = solution.stage_values().reshape(-1, self.size)
        weights, time = (solution.steps[:, None] * solution.rule.weights).ravel(), z[0, 2 * self.m]
        parts = (self.motion.model.controls(z[:, k * self.m:(k + 1) * self.m],
                                            self.motion.p).cost_rate for k in (0, 1))
        before, after = (float(weights @ part) for part in parts)
        return time * before + (self.motion.task.duration - time) * after, float(time)
