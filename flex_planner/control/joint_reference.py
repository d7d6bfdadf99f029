"""A joint trajectory, interpolated as by joint_trajectory_controller of ros2_controllers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from flex_planner.base.validation import Array
import numpy as np


class Reference(Protocol):
    """What a joint controller follows, at times (m,) [s]."""

    def motion(self, times: Array, /) -> tuple[Array, Array]:
        """Return positions [rad] and velocities [rad/s], shape (m, n)."""

    def torque(self, times: Array, /) -> Array:
        """Return the efforts, shape (m, n) [N m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointReference:
    """
    The points of a joint trajectory.

    Parameters
    ----------
    times : numpy.ndarray, shape (k,)
        Strictly increasing from 0, see :meth:`after` [s].
    positions, velocities, accelerations, torques : numpy.ndarray, shape (k, n)
        [rad], [rad/s], [rad/s^2], [N m]; the last row is held for ever.

    """

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    torques: Array

    @classmethod
    def hold(cls, positions: Array, torques: Array) -> JointReference:
        """Return a reference that stays."""
        still = np.zeros((1, positions.size))
        return cls(times=np.zeros(1), positions=positions[None], velocities=still,
                   accelerations=still, torques=torques[None])

    def after(self, positions: Array, velocities: Array, torques: Array) -> JointReference:
        """Return the reference with a start at time 0, without acceleration, if it has none."""
        if self.times[0] == 0:
            return self
        return JointReference(
            times=np.append(0.0, self.times), positions=np.vstack([positions, self.positions]),
            velocities=np.vstack([velocities, self.velocities]),
            accelerations=np.vstack([np.zeros_like(velocities), self.accelerations]),
            torques=np.vstack([torques, self.torques]))

    def motion(self, time: Array | float) -> tuple[Array, Array]:
        """
        Return positions and velocities, shape (n,) or (m, n), at times >= 0, one or (m,).

        Quintic between the points: they have accelerations.

        """
        k, share, step = self._interval(time)
        following = np.minimum(k + 1, self.times.size - 1)
        change = self.positions[following] - self.positions[k]
        # derivatives at both ends by the share of the step
        v, w = self.velocities[k] * step, self.velocities[following] * step
        a, b = (self.accelerations[i] * step**2 / 2 for i in (k, following))
        third, fourth, fifth = (10 * change - 6 * v - 4 * w - 3 * a + b,
                                -15 * change + 8 * v + 7 * w + 3 * a - 2 * b,
                                6 * change - 3 * (v + w) - a + b)
        position: Array = self.positions[k] + share * (v + share * (a + share * (
            third + share * (fourth + share * fifth))))
        rate = v + share * (2 * a + share * (3 * third + share * (4 * fourth + share * 5 * fifth)))
        velocity: Array = rate / np.where(step > 0, step, 1.0)
        return position, np.where(step > 0, velocity, self.velocities[-1])

    def torque(self, time: Array | float) -> Array:
        """Return the torques, shape (n,) or (m, n), at times >= 0: linear between the points."""
        k, share, _ = self._interval(time)
        following = np.minimum(k + 1, self.times.size - 1)
        torque: Array = (1 - share) * self.torques[k] + share * self.torques[following]
        return torque

    def _interval(self, time: Array | float) -> tuple[Array, Array, Array]:
        """Return intervals, the share of each that has passed, its length; 0 after the last."""
        last = self.times.size - 1
        k = np.minimum(np.searchsorted(self.times, time, 'right') - 1, last)
        step = self.times[np.minimum(k + 1, last)] - self.times[k]
        share = np.where(step > 0, (time - self.times[k]) / np.where(step > 0, step, 1.0), 0.0)
        return k, share[..., None], step[..., None]
