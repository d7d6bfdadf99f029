"""
A plan as samples that a joint controller follows.

A controller interpolates the torque linearly between samples and holds the last sample for
ever, so the samples are as close as the torque demands, and the last torque is the one that
holds the arm still.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.errors import InvalidTaskError
from flex_planner.plan import Plan, Samples
from flex_planner.progress import Monitor
from flex_planner.validation import Array, number
import numpy as np
from numpy.typing import NDArray

# between the last moving sample and the holding one: any longer, and the ramp between their
# torques would leave an impulse behind
HOLD_DELAY_NS = 1000

_SMALLEST_STEP = 2.5e-4
# a controller's message and a recording should stay below some megabytes
MAX_SAMPLES = 20_000
_PROBES = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """
    A sampled plan.

    Attributes
    ----------
    times_ns : numpy.ndarray of int64, shape (k,)
        From 0, strictly increasing [ns].
    samples : Samples
        At these times; at rest, with the holding torque, in the last.
    torque_error : float
        Largest difference between the planned torque and its linear interpolation found on a
        grid four times as fine [N m].

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
        The step is halved until linear interpolation is this exact, the step would fall below
        0.25 ms, or the samples would be more than 20000; > 0 [N m].

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


def sample_reference(plan: Plan, settings: SamplingSettings,
                     monitor: Monitor | None = None) -> Reference:
    """
    Return samples of a solved plan, evenly spaced, and one more that holds the arm.

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
    while True:
        watch.check()
        error = _interpolation_error(plan, count)
        finest = duration / count < 2 * _SMALLEST_STEP or 2 * count > MAX_SAMPLES
        if error <= settings.torque_tolerance or finest:
            break
        count *= 2
    times = np.linspace(0, duration, count + 1, dtype=np.float64)
    times_ns = np.round(times * 1e9).astype(np.int64)
    moving = _at_rest_at_the_ends(plan, plan.sample(times))
    return Reference(times_ns=np.append(times_ns, times_ns[-1] + HOLD_DELAY_NS),
                     samples=_with_hold(plan, moving), torque_error=error)


def _interpolation_error(plan: Plan, count: int) -> float:
    """Return what linear interpolation over `count` steps changes in the torques [N m]."""
    fine = plan.uniform_samples(_PROBES * count + 1).torques
    share = np.linspace(0, 1, _PROBES, endpoint=False)[:, None]
    ends = fine[::_PROBES]
    lines = ends[:-1, None] * (1 - share) + ends[1:, None] * share  # (count, probes, n)
    return float(np.abs(lines.reshape(-1, fine.shape[1]) - fine[:-1]).max())


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
