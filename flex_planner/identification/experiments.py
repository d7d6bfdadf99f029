"""
Logs as experiments: what the model is driven by, and what it has to reproduce.

Three ways, by what is known. With the law of the drive and its reference, the drive is simulated,
too, and angles are compared (closed loop). Without it, torques drive the model and angles are
compared (output error), or a stiff guide keeps the model on the measured angles, and what it must
add to the torques is the error (input error).

"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.identification.drive import Drive
from flex_planner.identification.joint_log import JointLog
from flex_planner.identification.loop_model import LoopModel
from flex_planner.identification.loop_sizes import LAGS
from flex_planner.identification.simulated_log import DriveLaw, SimulatedLog
import numpy as np

LEAST_TORQUE_RATE = 400.0
"""Of a log whose torques are to drive a model, where the rate of the drive is not known [Hz]."""

# periods at rest before a motion, in which what the drive said before is at work
_LEAD = LAGS + 1
_AT_REST = 0.05  # [rad/s]
_FIRST_SAMPLES = 5
# of the guide [rad/s], and for each period of the samples
_GUIDE, _GUIDE_ANGLE = 60.0, 0.25
# of the angles that the guide follows: what the arm does beyond it is lost, noise before it stays
_CUTOFF = 120.0  # [Hz]
_GAP = 3.5  # of samples, in periods
_WHOLE = 1e-6  # of a period, that a sample may be early
_GUESSES = 201  # of the time at which a motion began


class Method(Enum):
    """Ways to fit; the value is shown to people."""

    CLOSED_LOOP = 'closed loop: the drive is simulated'
    OUTPUT_ERROR = 'output error: torques in, angles out'
    INPUT_ERROR = 'input error: angles in, torques out'


class LogError(FlexPlannerError):
    """A log does not say what a fit needs; the message says what, and what to try."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """
    A log as a fit takes it.

    Attributes
    ----------
    name : str
        Of the log.
    method : Method
        How it is compared.
    law : DriveLaw
        That the model follows.
    followed : numpy.ndarray, shape (k, 3 n)
        Angles, speeds, efforts at each of its samples.
    start : numpy.ndarray, shape (n,)
        First angles as the encoders say them [rad].
    places : numpy.ndarray, shape (m,)
        Times that are compared, in samples; between two of them the motion is linear.
    measured : numpy.ndarray, shape (m, n)
        Angles, or torques [rad], [N m].
    noise : numpy.ndarray, shape (n,)
        Standard deviation that is expected of the error.
    late : float
        By how much later than the log says the motion is taken to begin [s].
    start_error : float
        By how much it may have begun earlier or later than that [s].
    moves : bool
        Whether the arm is not taken to be at rest when it begins.

    """

    name: str
    method: Method
    law: DriveLaw
    followed: Array
    start: Array
    places: Array
    measured: Array
    noise: Array
    late: float = 0.0
    start_error: float = 0.0
    moves: bool = False

    def errors(self, simulated: SimulatedLog, late: float = 0.0) -> tuple[Array, Array]:
        """
        Return errors over the noise, (m, n), and their derivatives, (m, n, columns + 1).

        Columns are those of the simulation; the last derivative is by the time `late` by which the
        motion began later [s].

        """
        if self.method is Method.INPUT_ERROR:
            values, slopes = simulated.guide, simulated.guide_slopes
        else:
            values, slopes = simulated.angles, simulated.angle_slopes
        places = np.clip(self.places - late / self.law.period, 0.0, len(values) - 1.0)
        k = np.floor(places + _WHOLE).astype(np.int64)
        share = np.maximum(places - k, 0.0)[:, None]
        after = np.minimum(k + 1, len(values) - 1)
        found = (1 - share) * values[k] + share * values[after]
        slope = np.concatenate([
            (1 - share[..., None]) * slopes[k] + share[..., None] * slopes[after],
            ((values[k] - values[after]) / self.law.period)[..., None]], axis=2)
        error = found if self.method is Method.INPUT_ERROR else found - self.measured
        return error / self.noise, slope / self.noise[:, None]

    @property
    def step(self) -> float:
        """Return the time between samples that are compared, by their median [s]."""
        return float(np.median(np.diff(self.places))) * self.law.period

    def fit_percent(self, errors: Array) -> Array:
        """Return how much of what was measured is explained, of each joint, shape (n,)."""
        spread = np.linalg.norm(self.measured - self.measured.mean(axis=0), axis=0)
        left = np.linalg.norm(errors * self.noise, axis=0)
        explained: Array = 100 * (1 - left / np.where(spread > 0, spread, np.inf))
        return explained


def closed_loop(log: JointLog, drive: Drive, holding: Array) -> Experiment:
    """
    Return a log of a drive whose law and reference are known.

    Parameters
    ----------
    log : JointLog
        At rest where its reference begins; samples from then on count.
    drive : Drive
        Of n joints.
    holding : numpy.ndarray, shape (n,)
        Torque that holds the arm before [N m].

    Raises
    ------
    LogError
        If the log has no reference, or ends before it begins.

    """
    if log.reference is None:
        raise LogError(f'{log.name} says not what the drive followed: record the trajectory, too, '
                       'or fit without the drive, by the torques')
    period, late, error = 1 / drive.rate, _lateness(log), log.reference_start_error
    begin = log.reference_start + late
    used = log.times >= begin
    if used.sum() < _FIRST_SAMPLES:
        raise LogError(f'{log.name} ends before its trajectory begins')
    times, angles = log.times[used] - begin, log.angles[used]
    count = int(np.ceil((times[-1] + error) / period)) + 2 + _LEAD
    at = (np.arange(count) - _LEAD) * period
    moving = at >= -period / 1e6
    clipped = np.maximum(at, 0.0)
    positions, speeds = log.reference.motion(clipped)
    first, last = drive.hold.efforts(log.reference, clipped, period)
    efforts = np.where(moving[:, None], (first + last) / 2, holding)
    rest = log.times < begin
    start = (log.angles[rest] if rest.sum() >= _FIRST_SAMPLES else angles[:1]).mean(axis=0)
    return Experiment(
        name=log.name, method=Method.CLOSED_LOOP, law=drive.law(),
        followed=np.hstack([positions, np.where(moving[:, None], speeds, 0.0), efforts]),
        start=start, places=times / period + _LEAD, measured=angles,
        noise=log.angle_noise(drive.resolution), late=late, start_error=error)


def _lateness(log: JointLog) -> float:
    """Return by how much later the motion began if the drive followed its angles exactly [s]."""
    if not log.reference_start_error or log.reference is None:
        return 0.0
    guesses = np.linspace(-1, 1, _GUESSES) * log.reference_start_error
    left = [np.sum((log.reference.motion(np.maximum(
        log.times - log.reference_start - guess, 0.0))[0] - log.angles)**2) for guess in guesses]
    return float(guesses[np.argmin(left)])


def by_torques(log: JointLog, method: Method, model: LoopModel, values: Array,
               holding: Array, drive: Drive | None = None) -> Experiment:
    """
    Return a log of torques and angles.

    Parameters
    ----------
    log : JointLog
        At rest where it begins.
    method : Method
        `OUTPUT_ERROR` or `INPUT_ERROR`.
    model : LoopModel
        For the inertia that the guide has to move.
    values : numpy.ndarray
        Of the parameters there, as `list_parameters` has them.
    holding : numpy.ndarray, shape (n,)
        Torque that holds the arm before [N m].
    drive : Drive, optional
        Whose rate the log must have, and the resolution of its encoders.

    Raises
    ------
    LogError
        If the log has no torques, or not those of every period of the drive; if it begins in
        motion, or has gaps.

    """
    _check_torques(log, drive)
    resolution = drive.resolution if drive else 0.0
    period = 1 / log.rate
    count = int((log.times[-1] - log.times[0]) / period + 1e-6) + 1
    at = log.times[0] + period * np.arange(count)
    held = np.clip(np.searchsorted(log.times, at + period / 2, 'right') - 1, 0, None)
    angles = np.stack([np.interp(at, log.times, column) for column in log.angles.T], axis=1)
    followed = np.zeros((count + _LEAD, 3 * log.angles.shape[1]))
    torques = np.vstack([np.repeat(holding[None], _LEAD, axis=0), log.torques[held]])
    n = angles.shape[1]
    followed[:, 2 * n:] = torques
    zero = np.zeros(n)
    law = DriveLaw(period=period, stiffness=zero, damping=zero, guide_stiffness=zero,
                   guide_damping=zero)
    noise, measured = log.angle_noise(resolution), angles
    if method is Method.INPUT_ERROR:
        law, smooth, speeds = _guide(law, angles, model.inertias(angles[0], values))
        followed[:, :n] = np.vstack([np.repeat(smooth[:1], _LEAD, axis=0), smooth])
        followed[_LEAD:, n:2 * n] = speeds
        measured = log.torques[held]
        # scaled by what is left of the torques later; here only the joints count
        noise = np.maximum(0.1 * measured.std(axis=0), 1e-9)
    return Experiment(
        name=log.name, method=method, law=law, followed=followed,
        start=angles[:_FIRST_SAMPLES].mean(axis=0), places=_LEAD + np.arange(count, dtype=float),
        measured=measured, noise=noise)


def _check_torques(log: JointLog, drive: Drive | None) -> None:
    """Refuse logs whose torques cannot drive a model."""
    if not log.has_torques:
        raise LogError(f'{log.name} has no torques: record them (effort), or say with --drive how '
                       'the drive makes them')
    needed = drive.rate if drive else LEAST_TORQUE_RATE
    if log.rate < 0.9 * needed:
        raise LogError(
            f'{log.name} has torques at {log.rate:.3g} Hz only, which between samples were '
            f'others: fits to them are wrong by several percent. Record every period (at '
            f'least {needed:g} Hz), or say with --drive how the drive makes them from its '
            'trajectory; then the angles are enough')
    gap = np.diff(log.times).max() * log.rate
    if gap > _GAP:
        raise LogError(f'{log.name} has a gap of {gap / log.rate:.3g} s, in which the torques are '
                       'not known: use a log without')
    moved = np.abs(log.angles[_FIRST_SAMPLES] - log.angles[0])
    noise = 6 * log.angle_noise()
    if (moved > noise + _AT_REST * (log.times[_FIRST_SAMPLES] - log.times[0])).any():
        raise LogError(f'{log.name} begins in motion: start it while the arm is at rest')


def _guide(law: DriveLaw, angles: Array, inertias: Array) -> tuple[DriveLaw, Array, Array]:
    """Return the guide, and smooth angles and speeds for it to follow."""
    from scipy.signal import butter, sosfiltfilt

    rate = 1 / law.period
    smooth = sosfiltfilt(butter(2, min(_CUTOFF, 0.4 * rate), fs=rate, output='sos'), angles,
                         axis=0)
    speed = min(_GUIDE, _GUIDE_ANGLE / law.period)
    stiff = DriveLaw(period=law.period, stiffness=law.stiffness, damping=law.damping,
                     guide_stiffness=inertias * speed**2, guide_damping=2 * inertias * speed)
    return stiff, smooth, np.gradient(smooth, law.period, axis=0)
