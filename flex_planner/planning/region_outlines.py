"""Outlines of regions that are kept free, for pictures and markers."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import (
    Capsule,
    Circle,
    HalfPlane,
    KeepOut,
    PathConstraint,
    Region,
)
import numpy as np

_CORNERS = 49  # of a whole turn


def outline_region(region: Region, extent: float) -> Array:
    """
    Return the corners of a region's outline, shape (k, 2), closed [m].

    Parameters
    ----------
    region : Circle, Capsule or HalfPlane
        The region.
    extent : float
        To which a half-plane is drawn, from its point along its line and into what is not allowed,
        > 0 [m].

    """
    if isinstance(region, Circle):
        return _arc(region.center, region.radius, 0.0, 2 * np.pi)
    if isinstance(region, Capsule):
        along = np.arctan2(region.end[1] - region.start[1], region.end[0] - region.start[0])
        outline = np.vstack([
            _arc(region.end, region.radius, along - np.pi / 2, along + np.pi / 2),
            _arc(region.start, region.radius, along + np.pi / 2, along + 3 * np.pi / 2)])
        return np.vstack([outline, outline[:1]])
    assert isinstance(region, HalfPlane)
    point, normal = np.array(region.point), np.array(region.normal)
    along = extent * np.array([-normal[1], normal[0]])
    inward = -extent * normal
    return np.array([point - along, point + along, point + along + inward,
                     point - along + inward, point - along])


def find_keep_outs(constraints: Sequence[PathConstraint]) -> list[KeepOut]:
    """Return the constraints that keep a region free."""
    return [one for one in constraints if isinstance(one, KeepOut)]


def _arc(center: Sequence[float], radius: float, first: float, last: float) -> Array:
    """Return points of an arc, shape (k, 2)."""
    angles = np.linspace(first, last, _CORNERS, dtype=np.float64)
    return np.array(center) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
