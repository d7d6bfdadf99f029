"""Outlines in space of regions that are kept free, as lines for pictures and markers."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import Region
from flex_planner.optimal_control.path_constraints.regions import Ball, Half, Pill
import numpy as np

_CORNERS = 33  # of a whole turn


def outline_in_space(region: Region, extent: float) -> list[Array]:
    """
    Return lines that show a region, each of shape (k, 3) [m].

    Parameters
    ----------
    region : Region
        A Sphere, a SpatialCapsule or a HalfSpace: three great circles; a circle at each end, the
        lines between and half circles over the ends; a square with a line to the side that is
        free.
    extent : float
        Half the side of the square [m].

    """
    if isinstance(region, Ball):
        centre, size = np.array(region.center), region.radius * np.eye(3)
        return [_arc(centre, size[i], size[(i + 1) % 3], 2 * np.pi) for i in range(3)]
    if isinstance(region, Pill):
        return _outline_capsule(np.array(region.start), np.array(region.end), region.radius)
    assert isinstance(region, Half)
    point, normal = np.array(region.point), np.array(region.normal)
    first, second = (extent * side for side in _across(normal))
    corners = [(1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1)]
    return [np.array([point + a * first + b * second for a, b in corners]),
            np.array([point, point + extent / 4 * normal])]


def _outline_capsule(start: Array, end: Array, radius: float) -> list[Array]:
    """Return the lines of a capsule between two points."""
    along = (end - start) / np.linalg.norm(end - start)
    first, second = (radius * side for side in _across(along))
    lines = [_arc(place, first, second, 2 * np.pi) for place in (start, end)]
    for side in (first, second):
        over = _arc(end, side, radius * along, np.pi)
        under = _arc(start, -side, -radius * along, np.pi)
        lines.append(np.vstack([over, under, over[:1]]))
    return lines


def _across(direction: Array) -> tuple[Array, Array]:
    """Return two unit vectors across a unit vector, and across one another."""
    helper = np.eye(3)[int(np.abs(direction).argmin())]
    side = np.cross(direction, helper)
    first: Array = np.asarray(side / np.linalg.norm(side), dtype=np.float64)
    second: Array = np.asarray(np.cross(direction, first), dtype=np.float64)
    return first, second


def _arc(centre: Array, first: Array, second: Array, angle: float) -> Array:
    """Return points of an arc that begins along one vector and turns towards another, (k, 3)."""
    angles = np.linspace(0.0, angle, _CORNERS, dtype=np.float64)[:, None]
    return centre + np.cos(angles) * first + np.sin(angles) * second
