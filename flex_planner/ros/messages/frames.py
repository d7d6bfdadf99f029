"""Frames of a bent arm as transforms for ``/tf``."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from flex_planner.arms.arm import Arm
from flex_planner.arms.frames import link_frames
from flex_planner.base.validation import Array
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
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
        message.transform.rotation = _quaternion(turn.T @ own)
        found.append(message)
        origin, turn = place, own
    return found


def _quaternion(axes: Array) -> Quaternion:
    """
    Return a rotation as a unit quaternion with w >= 0.

    The eigenvector of K. Itzhack's matrix (Journal of Guidance, Control, and Dynamics 23(6),
    2000) to its largest eigenvalue: as exact for half turns as for small ones.

    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = axes
    matrix = np.array([
        [xx - yy - zz, xy + yx, xz + zx, zy - yz],
        [xy + yx, yy - xx - zz, yz + zy, xz - zx],
        [xz + zx, yz + zy, zz - xx - yy, yx - xy],
        [zy - yz, xz - zx, yx - xy, xx + yy + zz]])
    vector = np.linalg.eigh(matrix)[1][:, -1]
    x, y, z, w = (float(value) for value in (vector if vector[3] >= 0 else -vector))
    return Quaternion(x=x, y=y, z=z, w=w)
