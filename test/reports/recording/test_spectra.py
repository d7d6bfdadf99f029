"""Spectra of signals."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.reports.recording.spectra import spectrum
import numpy as np
import pytest


@pytest.mark.parametrize('length', [400, 401])
def test_spectrum_has_the_amplitude_of_a_sine(length: int) -> None:
    times = np.arange(length) / length * 2.0
    values = 3.0 + 0.25 * np.sin(2 * np.pi * 20 * times + 0.3)
    frequencies, amplitudes = spectrum(times, values[:, None])
    assert frequencies[amplitudes[:, 0].argmax()] == pytest.approx(20)
    assert amplitudes.max() == pytest.approx(0.25, rel=1e-6)


def test_spectrum_of_uneven_times_is_that_of_even_ones() -> None:
    def signal(times: Array) -> Array:
        return np.stack([np.sin(2 * np.pi * 9 * times), 0.1 * np.cos(2 * np.pi * 24 * times)], 1)

    # the spectrum is of as many times as are four in the longest step
    even = np.arange(801) / 801 * 2
    uneven = np.sort(np.concatenate([even[::4], np.linspace(0.503, 0.508, 20)]))
    wanted, found = (spectrum(times, signal(times)) for times in (even, uneven))
    shown = min(len(wanted[0]), len(found[0]))
    assert wanted[0][shown - 1] > 24
    np.testing.assert_allclose(found[0][:shown], wanted[0][:shown], rtol=1e-9)
    np.testing.assert_allclose(found[1][:shown], wanted[1][:shown], atol=2e-3)
    assert wanted[1].max(axis=0) == pytest.approx([1, 0.1], rel=1e-3)


def test_spectrum_of_no_signals_or_a_single_time_is_empty() -> None:
    assert spectrum(np.array([0, 0.1, 0.3, 0.4]), np.ones((4, 0)))[1].shape == (0, 0)
    assert spectrum(np.zeros(1), np.ones((1, 2)))[1].shape == (0, 2)
