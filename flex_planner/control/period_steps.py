"""Steps of an integrator through periods of a controller, cut where motors meet their limits."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np
from numpy.typing import NDArray

# a cut nearer to an end of its step, as a share of it, is no new one
_EDGE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeriodSteps:
    """
    Steps that end where periods end.

    Parameters
    ----------
    times : numpy.ndarray, shape (m,)
        When the periods begin, ascending [s].
    period : float
        Their length [s].
    begins : numpy.ndarray, shape (k,)
        When the steps begin; the times are among them [s].
    numbers : numpy.ndarray of int, shape (k,)
        In which period each step lies.

    """

    times: Array
    period: float
    begins: Array
    numbers: NDArray[np.intp]

    @classmethod
    def of(cls, times: Array, period: float, begins: Array) -> PeriodSteps:
        """Return steps that begin at times (k,)."""
        return cls(times=times, period=period, begins=begins,
                   numbers=np.searchsorted(times, begins, side='right') - 1)

    @classmethod
    def even(cls, times: Array, period: float, count: int) -> PeriodSteps:
        """Return as many equal steps in each period."""
        shares = np.arange(count) / count
        begins: Array = (times[:, None] + period * shares).ravel()
        return cls(times=times, period=period, begins=begins,
                   numbers=np.repeat(np.arange(times.size), count))

    @property
    def lengths(self) -> Array:
        """Return the lengths, shape (k,) [s]."""
        return np.diff(np.append(self.begins, self.times[-1] + self.period))

    @property
    def firsts(self) -> NDArray[np.bool_]:
        """Return which are the first of their periods, shape (k,)."""
        return np.diff(self.numbers, prepend=-1) > 0

    def shares(self) -> tuple[Array, Array]:
        """Return which share of the period has passed before and after each step, shape (k,)."""
        begin = (self.begins - self.times[self.numbers]) / self.period
        return begin, begin + self.lengths / self.period

    def cut(self, steps: NDArray[np.intp], shares: Array) -> PeriodSteps:
        """Return them with some steps (c,) cut at shares (c,) of each."""
        new = self.begins[steps] + shares * self.lengths[steps]
        return PeriodSteps.of(self.times, self.period,
                              np.sort(np.concatenate([self.begins, new])))

    def since(self, number: int) -> PeriodSteps:
        """Return what is left from the beginning of a period."""
        left = self.numbers >= number
        return PeriodSteps(times=self.times[number:], period=self.period,
                           begins=self.begins[left], numbers=self.numbers[left] - number)


def limit_crossings(limits: TorqueLimits, torques: tuple[Array, Array],
                    speeds: tuple[Array, Array]) -> tuple[NDArray[np.intp], Array]:
    """
    Return where in steps motors reach or leave their limits, if all changes are linear.

    Parameters
    ----------
    limits : TorqueLimits
        Of n motors.
    torques, speeds : tuple of numpy.ndarray, shape (k, n)
        What is asked of the motors [N m], and the speeds of the joints [rad/s], before and after
        each step.

    Returns
    -------
    steps : numpy.ndarray of int, shape (c,)
        Numbers of the steps.
    shares : numpy.ndarray, shape (c,)
        Of each that has passed at the crossing, away from both ends.

    """
    # beyond the upper and the lower bound: positive and negative
    before, after = (np.stack([torque - bound for bound in limits.bounds(speed)], axis=-1)
                     for torque, speed in zip(torques, speeds, strict=True))
    crosses = np.isfinite(before) & (np.sign(before) * np.sign(after) < 0)
    shares = before[crosses] / (before[crosses] - after[crosses])
    inside = (shares > _EDGE) & (shares < 1 - _EDGE)
    return np.nonzero(crosses)[0][inside], shares[inside]
