"""
What joint_trajectory_controller of ros2_controllers commands at each of its updates.

As its source has it (`joint_trajectory_controller.cpp` and `trajectory.cpp`, version 6.9): the
state that the PID compares with is that of the time of the update, positions quintic between the
points; the effort is that of one period later, linear between them; after the last point both
stay. Where it also commands positions, the effort is that of the update itself.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bench.independent.shapes import Array
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory:
    """
    The points of a `trajectory_msgs/msg/JointTrajectory`, k of them for n joints.

    Attributes
    ----------
    times : numpy.ndarray, shape (k,)
        [s].
    positions, velocities, accelerations, efforts : numpy.ndarray, shape (k, n)
        [rad], [rad/s], [rad/s^2], [N m].

    """

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    efforts: Array

    @classmethod
    def of(cls, message: Any) -> Trajectory:
        """Return the trajectory of a message."""
        points: Sequence[Any] = message.points
        return cls(
            times=np.array([point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec
                            for point in points]),
            positions=np.array([point.positions for point in points]),
            velocities=np.array([point.velocities for point in points]),
            accelerations=np.array([point.accelerations for point in points]),
            efforts=np.array([point.effort for point in points]))

    def desired(self, time: float) -> tuple[Array, Array]:
        """Return positions and velocities (n,) at a time."""
        k = self._segment(time)
        if k is None:
            return self.positions[-1], self.velocities[-1]
        length, passed = self.times[k + 1] - self.times[k], time - self.times[k]
        ends = np.array([values[j] for j in (k, k + 1) for values in (
            self.positions, self.velocities, self.accelerations)])
        powers = np.arange(6)
        coefficients = np.linalg.solve(_end_conditions(), ends * np.tile(
            length ** np.arange(3), 2)[:, None])
        share = passed / length
        position = share**powers @ coefficients
        velocity = (powers[1:] * share**powers[:-1]) @ coefficients[1:] / length
        return position, velocity

    def effort(self, time: float) -> Array:
        """Return the efforts (n,) at a time."""
        k = self._segment(time)
        if k is None:
            last: Array = self.efforts[-1]
            return last
        slope = (self.efforts[k + 1] - self.efforts[k]) / (self.times[k + 1] - self.times[k])
        effort: Array = self.efforts[k] + slope * (time - self.times[k])
        return effort

    def _segment(self, time: float) -> int | None:
        """Return the number of the point before a time; None after the last."""
        if time >= self.times[-1]:
            return None
        return int(np.searchsorted(self.times, time, side='right')) - 1


def _end_conditions() -> Array:
    """Return position, speed and acceleration of x^0 to x^5 at 0 and at 1, shape (6, 6)."""
    powers = np.arange(6)
    slopes, bends = powers, powers * (powers - 1)
    return np.array([powers == 0, powers == 1, 2.0 * (powers == 2),
                     np.ones(6), slopes, bends], dtype=float)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Controller:
    """
    A controller as a report describes it.

    Attributes
    ----------
    rate : float
        Of its updates [Hz].
    hold : str
        `effort_hold` of the report.
    stiffness, damping : numpy.ndarray, shape (n,)
        [N m/rad], [N m s/rad].

    """

    rate: float
    hold: str
    stiffness: Array
    damping: Array

    def feedforward(self, trajectory: Trajectory, time: float) -> tuple[Array, Array]:
        """Return the efforts (n,) with which and the one to which a period begins and ends."""
        period = 1 / self.rate
        if self.hold == 'linear':
            return trajectory.effort(time), trajectory.effort(time + period)
        delay = {'start': 0.0, 'middle': 0.5, 'end': 1.0}[self.hold]
        held = trajectory.effort(time + delay * period)
        return held, held
