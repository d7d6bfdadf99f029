"""
Frames that are carried along an arm, in their own axes: how they move, and how they lie.

A frame is shifted to a point, turned about one of its axes by an angle, or by a constant rotation.
The arithmetic is that of `flex_planner.dynamics.vectors`, so that entries may be symbols.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.base.validation import Array
from flex_planner.dynamics.vectors import add, apply, cross, is_zero, Motion, product, Vector, ZERO


@dataclass(frozen=True, slots=True, eq=False)
class MovingFrame:
    """
    How a frame moves, and how it moves in a virtual motion.

    Gravity is in the acceleration: a frame at rest accelerates upwards by it.

    Parameters
    ----------
    velocity, turning : tuple
        Of its origin [m/s], and of its axes [rad/s].
    acceleration, angular_acceleration : tuple
        [m/s^2], [rad/s^2].
    virtual_velocity, virtual_turning : tuple
        In the virtual motion.

    """

    velocity: Vector
    turning: Vector
    acceleration: Vector
    angular_acceleration: Vector
    virtual_velocity: Vector
    virtual_turning: Vector

    @classmethod
    def at_base(cls, gravity: Array) -> MovingFrame:
        """Return the frame of the base."""
        x, y, z = (-float(g) if g else 0.0 for g in gravity)
        return cls(ZERO, ZERO, (x, y, z), ZERO, ZERO, ZERO)

    def shift(self, point: Motion) -> MovingFrame:
        """Return the frame at a point of it that moves."""
        around = cross(self.turning, point.value)
        twice = add(around, point.rate, point.rate)
        return MovingFrame(
            add(self.velocity, around, point.rate), self.turning,
            add(self.acceleration, cross(self.angular_acceleration, point.value),
                cross(self.turning, twice), point.acceleration),
            self.angular_acceleration,
            add(self.virtual_velocity, cross(self.virtual_turning, point.value), point.virtual),
            self.virtual_turning)

    def turn(self, axis: int, angle: Motion) -> MovingFrame:
        """Return the frame turned about an axis."""
        c, s = ca.cos(angle.value), ca.sin(angle.value)
        turned = (turn_axes(axis, c, s, vector) for vector in (
            self.velocity, self.turning, self.acceleration, self.angular_acceleration,
            self.virtual_velocity, self.virtual_turning))
        return MovingFrame(*turned).spin(axis, angle)

    def spin(self, axis: int, angle: Motion) -> MovingFrame:
        """Return a frame that turns with an angle, before it is turned by its value."""
        carried = cross(self.turning, along(axis, angle.rate))
        return MovingFrame(
            self.velocity, add(self.turning, along(axis, angle.rate)), self.acceleration,
            add(self.angular_acceleration, carried, along(axis, angle.acceleration)),
            self.virtual_velocity, add(self.virtual_turning, along(axis, angle.virtual)))

    def rotate(self, rotation: Array) -> MovingFrame:
        """Return the frame with constant other axes."""
        return MovingFrame(*(apply(rotation.T, vector) for vector in (
            self.velocity, self.turning, self.acceleration, self.angular_acceleration,
            self.virtual_velocity, self.virtual_turning)))


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """
    How a frame lies.

    Parameters
    ----------
    position : tuple
        Of its origin from the base [m].
    gravity : tuple
        [m/s^2].

    """

    position: Vector
    gravity: Vector

    @classmethod
    def at_base(cls, gravity: Array) -> Posture:
        """Return the frame of the base."""
        x, y, z = (float(g) if g else 0.0 for g in gravity)
        return cls(ZERO, (x, y, z))

    def shift(self, point: Motion) -> Posture:
        """Return the frame at a point of it."""
        return Posture(add(self.position, point.value), self.gravity)

    def turn(self, axis: int, angle: Motion) -> Posture:
        """Return the frame turned about an axis."""
        c, s = ca.cos(angle.value), ca.sin(angle.value)
        return Posture(turn_axes(axis, c, s, self.position), turn_axes(axis, c, s, self.gravity))

    def spin(self, axis: int, angle: Motion) -> Posture:
        """Return itself: nothing turns but by the value of the angle."""
        return self

    def rotate(self, rotation: Array) -> Posture:
        """Return the frame with constant other axes."""
        return Posture(apply(rotation.T, self.position), apply(rotation.T, self.gravity))


def turn_axes(axis: int, c: Any, s: Any, vector: Vector) -> Vector:
    """Return a vector in axes that are turned about one of them, by cosine and sine."""
    if is_zero(vector):
        return ZERO
    second, third = vector[axis - 2], vector[axis - 1]
    entries = list(vector)
    entries[axis - 2] = product(c, second) + product(s, third)
    entries[axis - 1] = product(c, third) - product(s, second)
    x, y, z = entries
    return x, y, z


def along(axis: int, size: Any) -> Vector:
    """Return a vector along an axis."""
    x, y, z = (size if i == axis else 0.0 for i in range(3))
    return x, y, z
