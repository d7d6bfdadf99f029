"""Intervals of a fit hold the truth about as often as they say."""

from __future__ import annotations

from bench.coverage import Coverage
from flex_planner.identification.intervals import half_widths
import numpy as np
import pytest
from scipy.signal import lfilter

SEEDS, SAMPLES = 200, 1000
TIMES = np.linspace(0, 6, SAMPLES)
# a line, two swings, and something that the errors say nothing of
JACOBIAN = np.stack([np.ones(SAMPLES), TIMES, np.sin(3 * TIMES), np.cos(TIMES),
                     np.zeros(SAMPLES)], axis=1)


def cover(keeps: float, blocks: range) -> Coverage:
    """Return the coverage of a linear fit whose errors keep a share of the one before."""
    rng, errors, widths = np.random.default_rng(7), [], []
    for _ in range(SEEDS):
        noise = lfilter([1], [1, -keeps], rng.normal(size=SAMPLES))
        found = np.linalg.lstsq(JACOBIAN[:, :4], noise, rcond=None)[0]
        left = noise - JACOBIAN[:, :4] @ found
        errors.append(found)
        widths.append(half_widths(left, JACOBIAN, left @ left / (SAMPLES - 4), blocks)[:4])
    return Coverage(names=('a', 'b', 'c', 'd'), errors=np.array(errors),
                    half_widths=np.array(widths))


def test_intervals_of_noise_hold_the_truth_as_often_as_they_say() -> None:
    found = cover(0.0, range(0))
    # of 800 intervals, whose share has a deviation of 0.8 %
    assert found.share == pytest.approx(0.95, abs=0.02)
    assert found.deviations == pytest.approx(1, abs=0.2)


def test_errors_that_are_alike_need_blocks() -> None:
    alone, blocks = cover(0.8, range(0)), cover(0.8, range(0, SAMPLES, 25))
    assert alone.share < 0.6
    # forty blocks are few, and neighbours are a little alike, too
    assert 0.87 < blocks.share < 0.96


def test_what_errors_say_nothing_of_has_no_bound() -> None:
    widths = half_widths(np.ones(SAMPLES), JACOBIAN, 1.0, range(0, SAMPLES, 100))
    assert np.isinf(widths[4]) and np.isfinite(widths[:4]).all()


def test_interval_that_is_withheld_does_not_hold_the_truth() -> None:
    found = Coverage(names=('a', 'b'), errors=np.array([[0.1, 0.1], [-0.3, 0.1]]),
                     half_widths=np.array([[0.2, np.nan], [0.2, 0.2]]))
    assert found.share == 0.5 and found.shares.tolist() == [0.5, 0.5]
