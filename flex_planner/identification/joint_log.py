"""A recorded motion of an arm: what the encoders said, and what the motors were told."""

from __future__ import annotations

from dataclasses import dataclass, field

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.text import LONGEST_NAME, printable
from flex_planner.base.validation import Array, number
from flex_planner.control.joint_reference import JointReference
import numpy as np

FEWEST_SAMPLES, MOST_SAMPLES = 50, 200_000
# below which the noise of encoders is that of arithmetic [rad]
_LEAST_NOISE = 1e-6
# the fourth difference of white noise is larger than itself by the root of this
_FOURTH_DIFFERENCE = 70.0
_MEDIAN_TO_DEVIATION = 1.4826
# a log of fewer samples per second says more of the motion than of the noise by its differences
_FAST = 400.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointLog:
    """
    Joint angles over time, with torques or with the reference of the drive.

    Parameters
    ----------
    name : str
        For messages.
    times : numpy.ndarray, shape (k,)
        Strictly increasing [s].
    angles : numpy.ndarray, shape (k, n)
        [rad].
    torques : numpy.ndarray, shape (k, n) or (0, n)
        That each sample begins with, held up to the next one [N m]; none if they are not known.
    reference : JointReference, optional
        That the drive followed; its time 0 is at `reference_start`.
    reference_start : float
        On the clock of `times` [s].
    reference_start_error : float
        By how much it may be off, 0 if it is exact, to 1; a fit in closed loop finds it [s].

    Raises
    ------
    InvalidValueError
        If times do not increase, values are not finite, or there are too few or too many.

    """

    name: str
    times: Array
    angles: Array
    torques: Array = field(default_factory=lambda: np.zeros((0, 0)))
    reference: JointReference | None = None
    reference_start: float = 0.0
    reference_start_error: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, 'name', printable(self.name, LONGEST_NAME))
        count = len(self.times)
        if not FEWEST_SAMPLES <= count <= MOST_SAMPLES:
            raise InvalidValueError(f'samples of {self.name}', count,
                                    f'{FEWEST_SAMPLES} to {MOST_SAMPLES}')
        for name in ('times', 'angles', 'torques'):
            values = np.array(getattr(self, name), dtype=float)
            if not np.isfinite(values).all():
                raise InvalidValueError(f'{name} of {self.name}', 'some of them', 'finite')
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.angles.shape[0] != count or len(self.torques) not in (0, count):
            raise InvalidValueError(f'angles and torques of {self.name}',
                                    (len(self.angles), len(self.torques)), f'{count} rows each')
        number(f'reference_start_error of {self.name}', self.reference_start_error, at_least=0,
               at_most=1, unit='s')
        if not (np.diff(self.times) > 0).all():
            raise InvalidValueError(f'times of {self.name}', 'a time that comes twice or too late',
                                    'strictly increasing')

    @property
    def rate(self) -> float:
        """Return the samples per second, by their median distance [Hz]."""
        return float(1 / np.median(np.diff(self.times)))

    @property
    def has_torques(self) -> bool:
        """Return whether torques are known."""
        return len(self.torques) > 0

    def angle_noise(self, resolution: float = 0.0) -> Array:
        """
        Return the standard deviation of the angles' noise, shape (n,) [rad].

        That of rounding to a resolution, with half of it as noise beside; if none is given, by the
        fourth differences of a log that is fast enough, and by the smallest step of the angles.

        """
        n = self.angles.shape[1]
        if resolution:
            return np.full(n, max(resolution * np.sqrt(1 / 12 + 1 / 4), _LEAST_NOISE))
        steps = np.abs(np.diff(self.angles, axis=0))
        smallest = np.array([column[column > 0].min(initial=np.inf) for column in steps.T])
        noise = np.where(np.isfinite(smallest), smallest, 0.0) / np.sqrt(12)
        if self.rate >= _FAST:
            fourth = np.abs(np.diff(self.angles, 4, axis=0)) / np.sqrt(_FOURTH_DIFFERENCE)
            noise = np.hypot(noise, _MEDIAN_TO_DEVIATION * np.median(fourth, axis=0))
        noise = np.maximum(noise, _LEAST_NOISE)
        return np.array(noise)
