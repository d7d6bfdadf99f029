"""The times of a trajectory's points: as close as its efforts demand, and no closer."""

from __future__ import annotations

from itertools import pairwise

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.planning.published_motion import PublishedMotion
import numpy as np
from numpy.typing import NDArray

SMALLEST_STEP = 2.5e-4
# a controller's message and a recording should stay below some megabytes
MAX_SAMPLES = 20_000
_PROBES = 8
# of the steps: if more than these are too long, all are; else an excursion between two switches
_FEW = 0.1


def point_times(motion: PublishedMotion, longest_step: float, tolerance: float,
                watch: Monitor) -> tuple[Array, float]:
    """
    Return times between which the efforts are nearly straight, and the error that is left.

    Parameters
    ----------
    motion : PublishedMotion
        That the points are to represent.
    longest_step : float
        [s].
    tolerance : float
        Of the efforts; as `SamplingSettings` has it [N m].
    watch : Monitor
        May stop it.

    Returns
    -------
    times : numpy.ndarray, shape (k,)
        From the begin to the end of the motion [s].
    error : float
        [N m].

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    times = _first_times(motion, longest_step)
    errors = _interpolation_errors(motion, times[:-1], times[1:])
    while True:
        watch.check()
        halved = _too_long(np.diff(times), errors, tolerance)
        if not halved.any():
            return times, float(errors.max())
        middles = (times[:-1] + times[1:])[halved] / 2
        times = np.insert(times, np.flatnonzero(halved) + 1, middles)
        new, errors = np.repeat(halved, 1 + halved), np.repeat(errors, 1 + halved)
        errors[new] = _interpolation_errors(motion, times[:-1][new], times[1:][new])


def _too_long(steps: Array, errors: Array, tolerance: float) -> NDArray[np.bool_]:
    """Return the steps to halve."""
    long: NDArray[np.bool_] = steps >= 2 * SMALLEST_STEP
    halved = long & (errors > tolerance)
    if halved.mean() > _FEW:
        halved |= long & (steps > steps.max() / 2)
    room = MAX_SAMPLES - steps.size
    if np.count_nonzero(halved) > room:
        worst = np.argsort(-np.where(halved, errors, 0.0))[:room]
        halved &= np.isin(np.arange(steps.size), worst)
    return halved


def _first_times(motion: PublishedMotion, longest: float) -> Array:
    """Return times that are evenly spaced between those where the efforts have kinks."""
    begin, end, breaks = motion.begin, motion.end, [motion.begin]
    if begin and motion.ramp[1]:
        breaks.append(begin + motion.ramp[1])
    if np.ceil((end - begin) / longest) + motion.kinks.size <= MAX_SAMPLES:
        marks = motion.marks.tolist()
        apart = [time for time in motion.kinks.tolist()
                 if all(abs(time - mark) >= SMALLEST_STEP for mark in marks)]
        for time in sorted([*apart, *marks]):
            if breaks[-1] + SMALLEST_STEP <= time <= end - SMALLEST_STEP:
                breaks.append(time)
    pieces = [np.linspace(first, last, int(np.ceil((last - first) / longest)), endpoint=False)
              for first, last in pairwise([*breaks, end])]
    return np.concatenate([*pieces, [end]])


def _interpolation_errors(motion: PublishedMotion, first: Array, last: Array) -> Array:
    """Return the changes that linear interpolation makes in the efforts [N m]."""
    share = np.linspace(0, 1, _PROBES + 1)
    times = first[:, None] + (last - first)[:, None] * share
    torques = motion.torque(times.ravel()).reshape(*times.shape, -1)
    lines = np.stack([1 - share, share], axis=1) @ torques[:, [0, -1]]
    errors: Array = np.abs(lines - torques).max(axis=(1, 2))
    return errors
