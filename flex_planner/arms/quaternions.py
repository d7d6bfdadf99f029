"""Rotations as unit quaternions (x, y, z, w)."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
import numpy as np


def quaternion_of(axes: Array) -> tuple[float, float, float, float]:
    """
    Return a rotation (3, 3) as a unit quaternion (x, y, z, w) with w >= 0.

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
    return x, y, z, w


def axes_of_quaternion(field: str, parts: Sequence[float]) -> Array:
    """
    Return the rotation (3, 3) of a quaternion (x, y, z, w), whose length does not matter.

    Raises
    ------
    InvalidValueError
        Naming the field, if its numbers are not finite or all 0.

    """
    size = float(np.linalg.norm(parts))
    if not 0 < size < np.inf:
        raise InvalidValueError(field, list(parts),
                                'a quaternion (x, y, z, w) of finite numbers, not 0')
    x, y, z, w = (part / size for part in parts)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
