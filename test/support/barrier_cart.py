"""A cart that a bounded force moves from rest to rest, for interior-point methods."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.collocation.interior_point import (
    BarrierOutcome,
    BarrierSchedule,
    solve_barrier,
)
import numpy as np

SCHEDULE = BarrierSchedule(first=1.0, last=1e-6)
# least effort over 1 m in 1 s takes a force from 6 to -6 N, and none under 4 N does it


@dataclass(frozen=True, kw_only=True)
class Cart:
    """
    x'' = u with |u| < most, of least integral of u^2 / 2, from 0 to 1 in a time of 1.

    z = (x, v, p, r) with u + r + l_+ - l_- = 0; y = (u, s_+, s_-, l_+, l_-).

    """

    most: float
    size: int = 4
    free: int = 1

    @property
    def explicit(self) -> Array:
        """Return no unknowns."""
        return np.zeros(0, dtype=np.intp)

    def scale(self, mu: float) -> Array:
        """Return magnitudes."""
        return np.array([1.0, 1.0, 10.0, 10.0])

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J with y eliminated."""
        step, by_costate = self._steps(z, y, mu)
        zero = np.zeros(len(z))
        rate = np.stack([z[:, 1], y[:, 0] + step, zero, -z[:, 2]], axis=1)
        jacobian = np.zeros((len(z), 4, 4))
        jacobian[:, 0, 1], jacobian[:, 1, 3], jacobian[:, 3, 2] = 1, by_costate, -1
        return rate, jacobian

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of y."""
        step, by_costate = self._steps(z, y, mu)
        u, above, below, pull, push = y.T
        du = step + by_costate * dz[:, 3]
        d_above, d_below = self.most - u - above - du, self.most + u - below + du
        return np.stack([du, d_above, d_below, mu / above - pull - pull / above * d_above,
                         mu / below - push - push / below * d_below], axis=1)

    def longest(self, node: Array, step: Array) -> float:
        """Return 1."""
        return 1.0

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return that the cart rests at 0."""
        return z[:2], np.eye(4)[:2]

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return that it rests at 1."""
        return z[:2] - [1, 0], np.eye(4)[:2]

    def _steps(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        u, above, below, pull, push = y.T
        curvature = 1 + pull / above + push / below
        gap = (u + z[:, 3] + mu / above - pull / above * (self.most - u - above)
               - mu / below + push / below * (self.most + u - below))
        return -gap / curvature, -1 / curvature


def pass_barrier(most: float, schedule: BarrierSchedule = SCHEDULE, intervals: int = 40,
                 monitor: Monitor | None = None) -> BarrierOutcome:
    """Start at rest with no force."""
    mesh = np.linspace(0, 1, intervals + 1)
    guess = CollocationSolution.from_values(mesh, np.zeros((intervals + 1, 4)), GaussRule.of(3))
    y = np.array([0.0, most, most, schedule.first / most, schedule.first / most])
    return solve_barrier(Cart(most=most), guess, np.broadcast_to(y, (intervals, 3, 5)).copy(),
                         schedule, monitor or Monitor())
