"""
A plan as samples that a joint controller follows.

A controller interpolates the torque linearly between samples and holds the last sample for
ever, so the samples are as close as the torque demands, one lies where a motor reaches or leaves
its limit, and the last torque is the one that holds the arm still.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, number
from flex_planner.planning.plan import Plan, Samples
import numpy as np
from numpy.typing import NDArray

# between the last moving sample and the holding one: any longer, and the ramp between their
# torques would leave an impulse behind
HOLD_DELAY_NS = 1000

_SMALLEST_STEP = 2.5e-4
# a controller's message and a recording should stay below some megabytes
MAX_SAMPLES = 20_000
_PROBES = 8
# of the steps: if more than these are too long, all are; else an excursion between two switches
_FEW = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledPlan:
    """
    A sampled plan.

    Attributes
    ----------
    times_ns : numpy.ndarray of int64, shape (k,)
        From 0, strictly increasing [ns].
    samples : Samples
        At these times; at rest, with the holding torque, in the last.
    torque_error : float
        Largest difference between the planned torque and its linear interpolation, found at
        eight times as many points [N m].

    """

    times_ns: NDArray[np.int64]
    samples: Samples
    torque_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplingSettings:
    """
    How densely a plan is sampled.

    Parameters
    ----------
    longest_step : float
        0.00025 to 1 [s].
    torque_tolerance : float
        Steps are halved until linear interpolation is this exact, they would fall below 0.25 ms,
        or the samples would be more than 20000: all steps while more than a tenth of them are
        too long, then those alone; > 0 [N m].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    longest_step: float = 0.01
    torque_tolerance: float = 0.02

    def __post_init__(self) -> None:
        number('longest_step', self.longest_step, at_least=_SMALLEST_STEP, at_most=1, unit='s')
        number('torque_tolerance', self.torque_tolerance, above=0, unit='N m')


def sample_plan(plan: Plan, settings: SamplingSettings,
                monitor: Monitor | None = None) -> SampledPlan:
    """
    Return samples of a solved plan, and one more that holds the arm.

    Raises
    ------
    InvalidTaskError
        If even the longest step makes more than 20000 samples, or the motion does not end at
        rest: a controller holds the last sample for ever.
    StoppedError
        If the monitor stopped it.
    ValueError
        If the plan has no solution.

    """
    watch, duration = monitor or Monitor(), plan.task.duration
    if not plan.task.ends_at_rest:
        raise InvalidTaskError('the motion does not end at rest at its goal, where a controller '
                               'would hold the arm')
    count = int(np.ceil(duration / settings.longest_step))
    if count > MAX_SAMPLES:
        raise InvalidTaskError(
            f'a motion of {duration:g} s sampled every {settings.longest_step:g} s has {count} '
            f'samples, but may have {MAX_SAMPLES}; the parameter sampling_step must be >= '
            f'{duration / MAX_SAMPLES:g} s')
    times, error = _fitting(plan, settings, watch)
    times_ns = np.round(times * 1e9).astype(np.int64)
    moving = _at_rest_at_the_ends(plan, plan.sample(np.minimum(times_ns * 1e-9, duration)))
    return SampledPlan(times_ns=np.append(times_ns, times_ns[-1] + HOLD_DELAY_NS),
                       samples=_with_hold(plan, moving), torque_error=error)


def _fitting(plan: Plan, settings: SamplingSettings, watch: Monitor) -> tuple[Array, float]:
    """Return times between which the torques are nearly straight, and the error that is left."""
    times = _first_times(plan, settings.longest_step)
    errors = _interpolation_errors(plan, times[:-1], times[1:])
    while True:
        watch.check()
        halved = _too_long(np.diff(times), errors, settings.torque_tolerance)
        if not halved.any():
            return times, float(errors.max())
        middles = (times[:-1] + times[1:])[halved] / 2
        times = np.insert(times, np.flatnonzero(halved) + 1, middles)
        new, errors = np.repeat(halved, 1 + halved), np.repeat(errors, 1 + halved)
        errors[new] = _interpolation_errors(plan, times[:-1][new], times[1:][new])


def _too_long(steps: Array, errors: Array, tolerance: float) -> NDArray[np.bool_]:
    """Return the steps to halve."""
    long: NDArray[np.bool_] = steps >= 2 * _SMALLEST_STEP
    halved = long & (errors > tolerance)
    if halved.mean() > _FEW:
        halved |= long & (steps > steps.max() / 2)
    room = MAX_SAMPLES - steps.size
    if np.count_nonzero(halved) > room:
        worst = np.argsort(-np.where(halved, errors, 0.0))[:room]
        halved &= np.isin(np.arange(steps.size), worst)
    return halved


def _first_times(plan: Plan, longest: float) -> Array:
    """Return times that are evenly spaced between the switches of the motors."""
    duration, breaks = plan.task.duration, [0.0]
    if np.ceil(duration / longest) + plan.switching_times.size <= MAX_SAMPLES:
        for time in plan.switching_times.tolist():
            if breaks[-1] + _SMALLEST_STEP <= time <= duration - _SMALLEST_STEP:
                breaks.append(time)
    pieces = [np.linspace(first, last, int(np.ceil((last - first) / longest)), endpoint=False)
              for first, last in pairwise([*breaks, duration])]
    return np.concatenate([*pieces, [duration]])


def _interpolation_errors(plan: Plan, first: Array, last: Array) -> Array:
    """Return the changes that linear interpolation makes in the torques [N m]."""
    share = np.linspace(0, 1, _PROBES + 1)
    times = first[:, None] + (last - first)[:, None] * share
    torques = plan.sample(times.ravel()).torques.reshape(*times.shape, -1)
    lines = np.stack([1 - share, share], axis=1) @ torques[:, [0, -1]]
    errors: Array = np.abs(lines - torques).max(axis=(1, 2))
    return errors


def _at_rest_at_the_ends(plan: Plan, samples: Samples) -> Samples:
    """Replace rounding errors at both ends by the exact states: controllers demand it."""
    n_t = plan.arm.n_coordinates
    coordinates, rates = samples.coordinates.copy(), samples.rates.copy()
    for row, state in ((0, plan.problem.start), (-1, plan.problem.goal)):
        coordinates[row], rates[row] = state[:n_t], state[n_t:]
    return replace(samples, coordinates=coordinates, rates=rates)


def _with_hold(plan: Plan, samples: Samples) -> Samples:
    """Append a sample at rest with the holding torque."""
    def again(values: Array) -> Array:
        return np.concatenate([values, values[-1:]])

    fields = {name: again(getattr(samples, name)) for name in Samples.__slots__}
    fields['times'][-1] += HOLD_DELAY_NS * 1e-9
    fields['accelerations'][-1] = 0
    fields['torques'][-1] = plan.problem.holding_torque
    return Samples(**fields)
