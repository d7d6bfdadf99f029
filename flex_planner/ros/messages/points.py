"""Points of arms in the plane, whose z is 0 and not looked at, and of arms in space."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.ros.messages.classes import Point


def point_message(values: Array) -> Point:
    """Return a point of two or three coordinates [m] as a message."""
    x, y, *z = (float(value) for value in values)
    return Point(x=x, y=y, z=z[0] if z else 0.0)


def point_coordinates(message: Any, arm: Arm) -> tuple[float, ...]:
    """Return the coordinates that a point of an arm has, two or three [m]."""
    return (message.x, message.y, message.z)[:arm.dimension]
