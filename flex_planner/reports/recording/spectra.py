"""Spectra of the recorded vibrations."""

from __future__ import annotations

from flex_planner.base.validation import Array
import numpy as np
from scipy.interpolate import CubicSpline

_UNEVEN = 1e-3
_FINER = 4  # than the longest step, where times are not even
_NEGLIGIBLE = 1e-5
_FEWEST = 24  # lines shown


def spectrum(times: Array, values: Array) -> tuple[Array, Array]:
    """
    Return the amplitude spectrum of signals, without what is negligible at its upper end.

    Hann window over the whole time, mean removed; scaled so that a sine of amplitude a on a
    line of the spectrum has the value a there. A cubic spline makes times even that are not.

    Parameters
    ----------
    times : numpy.ndarray, shape (k,)
        Strictly increasing [s].
    values : numpy.ndarray, shape (k, m)
        The signals.

    Returns
    -------
    frequencies : numpy.ndarray, shape (f,)
        Empty where there are no signals, or fewer than two times [Hz].
    amplitudes : numpy.ndarray, shape (f, m)
        In the unit of the signals.

    """
    if not values.size or times.size < 2:
        return np.zeros(0), np.zeros((0, values.shape[1]))
    times, values = _resample_evenly(times, values)
    window = np.hanning(times.size + 1)[:-1, None]  # periodic
    amplitudes: Array = np.abs(np.fft.rfft(window * (values - values.mean(axis=0)), axis=0))
    amplitudes *= 2 / window.sum()
    step = float(times[-1] - times[0]) / (times.size - 1)
    frequencies: Array = np.fft.rfftfreq(times.size, step).astype(np.float64)
    strong = (amplitudes > _NEGLIGIBLE * amplitudes.max()).any(axis=1)
    count = max(int(np.flatnonzero(strong)[-1]) + 2 if strong.any() else 0, _FEWEST)
    return frequencies[:count], amplitudes[:count]


def _resample_evenly(times: Array, values: Array) -> tuple[Array, Array]:
    """Return signals at times that are evenly spaced."""
    steps = np.diff(times)
    if np.ptp(steps) <= _UNEVEN * steps.mean():
        return times, values
    count = int(np.ceil(_FINER * (times[-1] - times[0]) / steps.max()))
    even = np.linspace(times[0], times[-1], count + 1)
    return even, CubicSpline(times, values)(even)
