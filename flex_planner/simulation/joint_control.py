"""The reference, gains, encoders and disturbances of a simulated arm."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.planning.sampling import SampledPlan
import numpy as np

MAX_RATE = 1e5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gains:
    """
    PD gains of every joint.

    Parameters
    ----------
    stiffness : array_like, shape (n,)
        >= 0 [N m/rad].
    damping : array_like, shape (n,)
        >= 0 [N m s/rad].

    """

    stiffness: Array
    damping: Array

    def __post_init__(self) -> None:
        for name, unit in (('stiffness', 'N m/rad'), ('damping', 'N m s/rad')):
            given = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            object.__setattr__(self, name, vector(name, given, given.size, at_least=0, unit=unit))

    @classmethod
    def of(cls, count: int, stiffness: float, damping: float) -> Gains:
        """Return the same gains for every joint."""
        return cls(stiffness=np.full(count, stiffness), damping=np.full(count, damping))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointReference:
    """
    A joint trajectory, interpolated as by joint_trajectory_controller.

    Parameters
    ----------
    times : numpy.ndarray, shape (k,)
        Strictly increasing from 0, see :meth:`after` [s].
    positions, velocities, torques : numpy.ndarray, shape (k, n)
        [rad], [rad/s], [N m]; the last row is held for ever.

    """

    times: Array
    positions: Array
    velocities: Array
    torques: Array

    @classmethod
    def hold(cls, positions: Array, torques: Array) -> JointReference:
        """Return a reference that stays."""
        still = np.zeros((1, positions.size))
        return cls(times=np.zeros(1), positions=positions[None], velocities=still,
                   torques=torques[None])

    @classmethod
    def of(cls, sampled: SampledPlan) -> JointReference:
        """Return the joints of a sampled plan."""
        samples, n = sampled.samples, sampled.samples.torques.shape[1]
        times = np.multiply(sampled.times_ns, 1e-9, dtype=np.float64)
        return cls(times=times, positions=samples.coordinates[:, :n],
                   velocities=samples.rates[:, :n], torques=samples.torques)

    def after(self, positions: Array, velocities: Array, torques: Array) -> JointReference:
        """Return the reference with a start at time 0, unless it has one."""
        if self.times[0] == 0:
            return self
        return JointReference(
            times=np.append(0.0, self.times), positions=np.vstack([positions, self.positions]),
            velocities=np.vstack([velocities, self.velocities]),
            torques=np.vstack([torques, self.torques]))

    def motion(self, time: float) -> tuple[Array, Array]:
        """Return positions and velocities (n,) at a time >= 0: cubic between the samples."""
        k, share, step = self._interval(time)
        if not step:
            return self.positions[-1], self.velocities[-1]
        a, b = self.positions[k], self.positions[k + 1]
        u, v = self.velocities[k] * step, self.velocities[k + 1] * step
        bend, twist = 3 * (b - a) - 2 * u - v, 2 * (a - b) + u + v
        position: Array = a + share * (u + share * (bend + share * twist))
        velocity: Array = (u + share * (2 * bend + share * 3 * twist)) / step
        return position, velocity

    def torque(self, time: float) -> Array:
        """Return the torques (n,) at a time >= 0: linear between the samples."""
        k, share, _ = self._interval(time)
        following = min(k + 1, self.times.size - 1)
        torque: Array = (1 - share) * self.torques[k] + share * self.torques[following]
        return torque

    def _interval(self, time: float) -> tuple[int, float, float]:
        """Return an interval, the share of it that has passed, its length; 0 after the last."""
        if time >= self.times[-1]:
            return self.times.size - 1, 0.0, 0.0
        k = int(np.searchsorted(self.times, time, 'right')) - 1
        step = float(self.times[k + 1] - self.times[k])
        return k, float(time - self.times[k]) / step, step


@dataclass(frozen=True, slots=True, kw_only=True)
class Encoder:
    """
    Measurement of the joints; by default exact, at every period of the controller.

    Parameters
    ----------
    rate : float
        Of the samples, 0 to 100000 [Hz]; a sample is seen at the next period of the controller,
        and 0 makes one for each.
    resolution : float
        Angles are rounded to multiples of it, 0 (exact) to 1 [rad].
    differentiates : bool
        Whether speeds come from differences of the samples.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    rate: float = 0.0
    resolution: float = 0.0
    differentiates: bool = False

    def __post_init__(self) -> None:
        number('encoder_rate', self.rate, at_least=0, at_most=MAX_RATE, unit='Hz')
        number('encoder_resolution', self.resolution, at_least=0, at_most=1, unit='rad')


class JointSensor:
    """
    The samples of the encoders.

    Parameters
    ----------
    encoder : Encoder
        How.
    positions : numpy.ndarray, shape (n,)
        At rest, at time 0 [rad].

    Attributes
    ----------
    positions, speeds : numpy.ndarray, shape (n,)
        Sampled last [rad], [rad/s].

    """

    def __init__(self, encoder: Encoder, positions: Array) -> None:
        self._encoder = encoder
        self.positions, self.speeds = self._round(positions), np.zeros_like(positions)
        self._count, self._sampled = 0, 0.0

    def look(self, time: float, positions: Array, speeds: Array) -> None:
        """Take a sample if it is time for one."""
        count = int(time * self._encoder.rate + 1e-6)
        if self._encoder.rate and count == self._count:
            return
        before, since = self.positions, time - self._sampled
        self.positions = self._round(positions)
        differences: Array = (self.positions - before) / since
        self.speeds = differences if self._encoder.differentiates else speeds.copy()
        self._count, self._sampled = count, time

    def _round(self, positions: Array) -> Array:
        resolution = self._encoder.resolution
        if not resolution:
            return positions.copy()
        rounded: Array = np.round(positions / resolution) * resolution
        return rounded


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """
    A pulse of torque from outside, beyond what the motors do; by default none.

    Parameters
    ----------
    joint : int
        From the base outwards, 1 to 8; 0 for none.
    torque : float
        Within +-1e6 [N m].
    start : float
        Since the motion began, 0 to 1e6 [s].
    duration : float
        0 to 1e6 [s].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    joint: int = 0
    torque: float = 0.0
    start: float = 0.0
    duration: float = 0.0

    def __post_init__(self) -> None:
        integer('disturbance_joint', self.joint, at_least=0, at_most=8)
        number('disturbance_torque', self.torque, at_least=-1e6, at_most=1e6, unit='N m')
        for name in ('start', 'duration'):
            number(f'disturbance_{name}', getattr(self, name), at_least=0, at_most=1e6, unit='s')

    def mean(self, begin: float, end: float, joints: int) -> Array:
        """Return its mean over a span of time, shape (joints,): the impulse is kept exactly."""
        torque = np.zeros(joints)
        overlap = min(end, self.start + self.duration) - max(begin, self.start)
        if self.joint and overlap > 0:
            torque[self.joint - 1] = self.torque * overlap / (end - begin)
        return torque
