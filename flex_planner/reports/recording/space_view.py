"""What a view of a motion in space needs besides the arm: a floor, a middle, the hand's axes."""

from __future__ import annotations

import math
from typing import Any

from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_joint import slides
from flex_planner.arms.spatial_kinematics import tip_frame
from flex_planner.base.validation import Array
import numpy as np

_DIGITS, _MILLI = 4, 1e3
# squares of the floor along its longer side, about
_SQUARES = 8
# of the distance from the middle to what is farthest from it
_MARGIN = 1.08


def space_view(arm: SpatialArm, coordinates: Array, points: Array) -> dict[str, Any]:
    """
    Return what space.js needs besides links and path.

    Parameters
    ----------
    arm : SpatialArm
        n joints, n_t coordinates.
    coordinates : numpy.ndarray, shape (F, n_t)
        Of the frames.
    points : numpy.ndarray, shape (k, 3)
        All that is drawn [m].

    Returns
    -------
    dict
        ``centre`` (3,) and ``radius`` of a ball that holds arm and path [mm]; ``floor``, lines of
        two points each [mm], at the height ``ground`` [mm]; ``base`` (3,), the first joint [mm];
        ``hand`` (F, 9), the axes of the tip's frame one after another; which joints ``slides``.

    """
    base = np.array(arm.base)
    everything = np.concatenate([points, base[None], np.zeros((1, 3))])
    low, high = everything.min(axis=0), everything.max(axis=0)
    centre = (low + high) / 2
    radius = _MARGIN * np.linalg.norm(everything - centre, axis=1).max()
    _, axes = tip_frame(arm, coordinates)
    return {'centre': _milli(centre), 'radius': round(float(radius) * _MILLI, _DIGITS),
            'floor': [_milli(line.ravel()) for line in _floor(low, high)],
            'ground': float(_milli(low)[2]), 'base': _milli(base),
            'hand': np.swapaxes(axes, -1, -2).reshape(-1, 9).round(_DIGITS).tolist(),
            'slides': [slides(joint) for joint in arm.joints]}


def _floor(low: Array, high: Array) -> Array:
    """Return the lines of a floor beneath points, shape (lines, 2, 3) [m]."""
    step = _round_step(max(float((high - low)[:2].max()), float(high[2] - low[2])) / _SQUARES)
    first, last = np.floor(low[:2] / step), np.ceil(high[:2] / step)
    (left, near), (right, far) = first * step, np.maximum(last, first + 1) * step
    ground = low[2]
    lines = [[(x, near, ground), (x, far, ground)] for x in _marks(left, right, step)]
    lines += [[(left, y, ground), (right, y, ground)] for y in _marks(near, far, step)]
    return np.array(lines)


def _marks(first: float, last: float, step: float) -> Array:
    """Return evenly spaced places, both ends included."""
    return np.linspace(first, last, round((last - first) / step) + 1, dtype=np.float64)


def _round_step(length: float) -> float:
    """Return the least of 1, 2, 5, 10 ... times a power of ten that is not less."""
    power = 10.0 ** math.floor(math.log10(length))
    return power * next(factor for factor in (1, 2, 5, 10) if factor * power >= length)


def _milli(values: Array) -> list[float]:
    """Return lengths in millimetres, to a tenth of a micrometre."""
    shown: list[float] = (values * _MILLI).round(_DIGITS).tolist()
    return shown
