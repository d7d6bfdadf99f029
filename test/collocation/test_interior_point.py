"""The interior-point method on a cart that a bounded force moves from rest to rest."""

from __future__ import annotations

from dataclasses import replace

from barrier_cart import pass_barrier, SCHEDULE
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation.interior_point import BarrierOutcome
import numpy as np
import pytest


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
