"""Encoders and disturbances of a simulated arm."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.control.joint_controller import MAX_RATE
import numpy as np


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
    speed_filter : float
        Corner frequency of the low pass of first order for such differences, 0 (none) to 100000
        [Hz].
    offsets : tuple of float
        What the encoder of each joint says too much, within +-1 [rad]; empty for none.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    rate: float = 0.0
    resolution: float = 0.0
    differentiates: bool = False
    speed_filter: float = 0.0
    offsets: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        number('encoder_rate', self.rate, at_least=0, at_most=MAX_RATE, unit='Hz')
        number('encoder_resolution', self.resolution, at_least=0, at_most=1, unit='rad')
        number('encoder_speed_filter', self.speed_filter, at_least=0, at_most=MAX_RATE, unit='Hz')
        vector('encoder_offsets', self.offsets, len(self.offsets), at_least=-1, at_most=1,
               unit='rad')

    def shifted(self, positions: Array) -> Array:
        """Return what exact encoders say where joints are somewhere, shape (n,) [rad]."""
        shifted: Array = positions + (np.array(self.offsets) if self.offsets else 0.0)
        return shifted


class JointSensor:
    """
    The samples of the encoders.

    Parameters
    ----------
    encoder : Encoder
        How.
    positions : numpy.ndarray, shape (n,)
        Of the joints at rest, at time 0 [rad].

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
        self.speeds = (self._filter(differences, since) if self._encoder.differentiates
                       else speeds.copy())
        self._count, self._sampled = count, time

    def _filter(self, differences: Array, since: float) -> Array:
        """Return speeds from differences over a time [s]."""
        corner = self._encoder.speed_filter
        keeps = np.exp(-2 * np.pi * corner * since) if corner else 0.0
        filtered: Array = keeps * self.speeds + (1 - keeps) * differences
        return filtered

    def _round(self, positions: Array) -> Array:
        shifted, resolution = self._encoder.shifted(positions), self._encoder.resolution
        if not resolution:
            return shifted.copy()
        rounded: Array = np.round(shifted / resolution) * resolution
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
