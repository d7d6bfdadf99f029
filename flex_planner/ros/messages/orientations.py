"""Orientations in messages: quaternions, which are rotations as matrices elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flex_planner.arms.quaternions import axes_of_quaternion, quaternion_of
from flex_planner.base.errors import InvalidSizeError
from flex_planner.base.validation import Array
from flex_planner.ros.messages.classes import Quaternion


def quaternion_message(axes: Array) -> Quaternion:
    """Return a rotation (3, 3) as a message."""
    x, y, z, w = quaternion_of(axes)
    return Quaternion(x=x, y=y, z=z, w=w)


def orientation_axes(field: str, messages: Sequence[Any]) -> Array | None:
    """
    Return the axes (3, 3) of an orientation that a message may have; None if it has none.

    Parameters
    ----------
    field : str
        For messages to people.
    messages : sequence of Quaternion
        One, of any length but 0, or none.

    Raises
    ------
    InvalidSizeError, InvalidValueError
        Naming the field.

    """
    if not len(messages):
        return None
    if len(messages) > 1:
        raise InvalidSizeError(field, f'{len(messages)} quaternions', 'one, or none')
    return axes_of_quaternion(field, [float(getattr(messages[0], name)) for name in 'xyzw'])
