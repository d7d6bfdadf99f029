"""Frames of a bent arm as transforms for ``/tf``."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from flex_planner.arms.arm import Arm
from flex_planner.arms.frames import link_frames
from flex_planner.base.validation import Array
from flex_planner.ros.messages.orientations import quaternion_message
from geometry_msgs.msg import TransformStamped, Vector3
import numpy as np


def frame_transforms(arm: Arm, coordinates: Array, names: Sequence[str],
                     stamp: Time) -> list[TransformStamped]:
    """
    Return each frame in the one before, from the first link to the tip.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    coordinates : numpy.ndarray, shape (n_t,)
        q.
    names : sequence of str
        Of base, links and tip, n + 2 of them.
    stamp : builtin_interfaces.msg.Time
        When the arm is so.

    """
    places, axes = link_frames(arm, coordinates)
    found, origin, turn = [], np.zeros(3), np.eye(3)
    for parent, child, place, own in zip(names[:-1], names[1:], places, axes, strict=True):
        x, y, z = (float(value) for value in turn.T @ (place - origin))
        message = TransformStamped(child_frame_id=child)
        message.header.stamp, message.header.frame_id = stamp, parent
        message.transform.translation = Vector3(x=x, y=y, z=z)
        message.transform.rotation = quaternion_message(turn.T @ own)
        found.append(message)
        origin, turn = place, own
    return found
