"""Spectra of the recorded vibrations."""

from __future__ import annotations

from flex_planner.validation import Array
import numpy as np

_UNEVEN = 1e-3
_NEGLIGIBLE = 1e-5
_FEWEST = 24  # lines shown


def spectrum(times: Array, values: Array) -> tuple[Array, Array]:
    """
    Return the amplitude spectrum of signals, without what is negligible at its upper end.

    Hann window over the whole time, mean removed; scaled so that a sine of amplitude a on a
    line of the spectrum has the value a there.

    Parameters
    ----------
    times : numpy.ndarray, shape (k,)
        Evenly spaced [s].
    values : numpy.ndarray, shape (k, m)
        The signals.

    Returns
    -------
    frequencies : numpy.ndarray, shape (f,)
        Empty where the times are not evenly spaced or there are no signals [Hz].
    amplitudes : numpy.ndarray, shape (f, m)
        In the unit of the signals.

    """
    steps = np.diff(times)
    if not values.size or np.ptp(steps) > _UNEVEN * steps.mean():
        return np.zeros(0), np.zeros((0, values.shape[1]))
    window = np.hanning(times.size + 1)[:-1, None]  # periodic
    amplitudes: Array = np.abs(np.fft.rfft(window * (values - values.mean(axis=0)), axis=0))
    amplitudes *= 2 / window.sum()
    frequencies: Array = np.fft.rfftfreq(times.size, float(steps.mean())).astype(np.float64)
    strong = (amplitudes > _NEGLIGIBLE * amplitudes.max()).any(axis=1)
    count = max(int(np.flatnonzero(strong)[-1]) + 2 if strong.any() else 0, _FEWEST)
    return frequencies[:count], amplitudes[:count]
