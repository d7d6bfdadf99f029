"""The interior-point method on a cart that a bounded force moves from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.collocation.interior_point import (
    BarrierOutcome,
    BarrierSchedule,
    solve_barrier,
)
import numpy as np
import pytest

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


def integral(outcome: BarrierOutcome, values: Array) -> float:
    """Return the integral of values at the stages."""
    solution = outcome.solution
    return float(solution.steps @ (values @ solution.rule.weights))


def test_limits_that_are_not_reached_leave_the_free_motion() -> None:
    outcome = pass_barrier(20.0)
    assert outcome.converged and outcome.iterations <= 15
    exact = 6 - 12 * outcome.solution.stage_times()
    np.testing.assert_allclose(outcome.y[..., 0], exact, atol=1e-5)  # mu over the least slack


def saturated_cost(most: float) -> float:
    """Return the cost of full force up to a time a, a line, and full force back."""
    # x(1) = most (1 + 2 a - 2 a^2) / 6 = 1
    a = (1 - np.sqrt(3 * (1 - 4 / most))) / 2
    return most**2 * (a + (1 - 2 * a) / 6)


@pytest.mark.parametrize('most', [4.5, 5.0, 5.5])
def test_cost_exceeds_the_least_by_no_more_than_the_barrier_allows(most: float) -> None:
    for last in (1e-2, 1e-4, 1e-6):
        outcome = pass_barrier(most, replace(SCHEDULE, last=last, tolerance=1e-8), 320)
        cost = integral(outcome, outcome.y[..., 0]**2) / 2
        assert outcome.converged and outcome.mu == last
        # 2 limits for 1 s, and what 320 intervals leave of a corner
        assert -1e-7 <= cost - saturated_cost(most) <= 2 * last + 1e-7


def test_products_are_mu_at_the_end() -> None:
    outcome = pass_barrier(5.0, replace(SCHEDULE, tolerance=1e-9))
    slacks, multipliers = outcome.y[..., 1:3], outcome.y[..., 3:]
    assert (slacks > 0).all() and (multipliers > 0).all()
    np.testing.assert_allclose(slacks * multipliers, outcome.mu, rtol=1e-3)
    np.testing.assert_allclose(slacks[..., 0], 5 - outcome.y[..., 0], atol=1e-9)


def test_a_motion_that_is_impossible_does_not_converge() -> None:
    outcome = pass_barrier(3.9)
    assert not outcome.converged
    assert outcome.message == 'not converged after 80 iterations'


def test_work_does_not_grow_as_the_limits_tighten() -> None:
    assert max(pass_barrier(most).iterations for most in (4.1, 4.5, 5.5, 7.0)) <= 25


def test_monitor_hears_of_iterations_and_stops_them() -> None:
    monitor = Monitor()
    outcome = pass_barrier(5.0, monitor=monitor)
    assert monitor.iteration == outcome.iterations
    with pytest.raises(StoppedError):
        pass_barrier(5.0, monitor=Monitor(canceled=lambda: True))
