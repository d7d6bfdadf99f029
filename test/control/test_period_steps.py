"""Steps through periods, and where motors meet their limits in them."""

from __future__ import annotations

from flex_planner.control.period_steps import limit_crossings, PeriodSteps
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

TIMES = np.array([0.2, 0.3])


def test_even_steps_fill_their_periods() -> None:
    steps = PeriodSteps.even(TIMES, 0.1, 2)
    np.testing.assert_allclose(steps.begins, [0.2, 0.25, 0.3, 0.35])
    np.testing.assert_allclose(steps.lengths, 0.05)
    assert steps.numbers.tolist() == [0, 0, 1, 1]
    assert steps.firsts.tolist() == [True, False, True, False]
    np.testing.assert_allclose(steps.shares(), [[0, 0.5, 0, 0.5], [0.5, 1, 0.5, 1]], atol=1e-12)


def test_steps_are_cut_and_what_is_left_begins_with_a_period() -> None:
    left = PeriodSteps.even(TIMES, 0.1, 1).cut(np.array([0, 1]), np.array([0.5, 0.25])).since(1)
    np.testing.assert_allclose(left.begins, [0.3, 0.325])
    np.testing.assert_allclose(left.lengths, [0.025, 0.075])
    assert left.times.tolist() == [0.3]


def test_limits_are_met_where_lines_cross() -> None:
    limits = TorqueLimits(np.array([4.0, np.inf]), np.array([2.0, 0.0]), np.full(2, np.inf))
    # upper bounds of the first motor: 4 to 2 N m, and its lower ones: -4 to -6 N m
    speeds = np.zeros((4, 2)), np.tile([1.0, 0.0], (4, 1))
    asked = (np.array([[3.0, 9.0], [0.0, 9.0], [-5.0, 9.0], [4.001, 9.0]]),
             np.array([[3.0, -9.0], [1.0, -9.0], [-5.0, -9.0], [4.001, -9.0]]))
    steps, shares = limit_crossings(limits, asked, speeds)
    # at the edge of the last step, and of the second motor, there is nothing to cut
    assert steps.tolist() == [0, 2]
    np.testing.assert_allclose(shares, [0.5, 0.5])
