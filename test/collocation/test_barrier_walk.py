"""A barrier that is lowered, and a family of problems that is followed, step by step."""

from __future__ import annotations

from dataclasses import replace

from barrier_cart import Cart, pass_barrier, SCHEDULE
from flex_planner.base.progress import Monitor, StoppedError, StopReason
from flex_planner.collocation import barrier_walk
from flex_planner.collocation.barrier_walk import lower_slowly, walk_barrier
from flex_planner.collocation.interior_point import BarrierOutcome, BarrierProblem
import numpy as np
import pytest


@pytest.fixture(scope='module')
def strong() -> BarrierOutcome:
    # a force that is never on its limit
    return pass_barrier(20.0, replace(SCHEDULE, last=1.0))


def test_cart_with_less_and_less_force_ends_where_it_begins_with_little(
        strong: BarrierOutcome) -> None:
    met = walk_barrier(lambda share: (Cart(most=20.0 - 15.5 * share), 1.0), strong, Monitor())
    cold = pass_barrier(4.5, replace(SCHEDULE, last=1.0, tolerance=1e-8))
    assert met.converged and met.mu == 1.0
    np.testing.assert_allclose(met.solution.nodes, cold.solution.nodes, rtol=1e-3,
                               atol=1e-3)


def test_mu_that_is_lowered_slowly_ends_where_it_falls_to(strong: BarrierOutcome) -> None:
    slowly = lower_slowly(Cart(most=20.0), strong, 1e-4, Monitor())
    at_once = pass_barrier(20.0, replace(SCHEDULE, last=1e-4, tolerance=1e-8))
    assert slowly.converged and slowly.mu == pytest.approx(1e-4)
    np.testing.assert_allclose(slowly.solution.nodes, at_once.solution.nodes, rtol=1e-3,
                               atol=1e-3)


def test_walk_to_what_is_impossible_ends_with_the_last_that_is_not(
        strong: BarrierOutcome) -> None:
    # the least force that does it is 4 N, at a share of 0.8
    def family(share: float) -> tuple[BarrierProblem, float]:
        return Cart(most=20.0 * (1 - share)), 1e-3

    met = walk_barrier(family, lower_slowly(Cart(most=20.0), strong, 1e-3, Monitor()), Monitor())
    assert not met.converged
    assert 4.0 < np.abs(met.y[..., 0]).max() < 4.2
    assert met.message.startswith('not converged after')


def test_steps_are_shorter_where_they_fail(strong: BarrierOutcome,
                                           monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[float] = []

    def family(share: float) -> tuple[BarrierProblem, float]:
        shares.append(share)
        return Cart(most=20.0 - 15.5 * share), 1.0

    settle = barrier_walk.settle
    monkeypatch.setattr(barrier_walk, 'settle', lambda *given: replace(
        settle(*given), converged=len(shares) != 2))
    assert walk_barrier(family, strong, Monitor()).converged
    steps = np.diff([0.0, shares[0], shares[2]])
    assert shares[1] > shares[2] and steps[1] == pytest.approx((shares[1] - shares[0]) / 2)
    assert shares[-1] == 1.0


def test_walk_is_stopped(strong: BarrierOutcome) -> None:
    monitor = Monitor(canceled=lambda: True)
    with pytest.raises(StoppedError) as stopped:
        lower_slowly(Cart(most=20.0), strong, 1e-4, monitor)
    assert stopped.value.reason is StopReason.CANCELED
