"""Regions in space that are kept free: spheres, capsules and half-spaces."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.optimal_control.path_constraints.regions import Ball, Half, Pill


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere(Ball):
    """
    A ball in space.

    Parameters
    ----------
    center : tuple of float
        x, y and z in the base frame [m].
    radius : float
        > 0 [m].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    dimension = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialCapsule(Pill):
    """
    All in space within a distance of a segment, a pillar or a beam for example.

    Parameters
    ----------
    start, end : tuple of float
        Of the segment, x, y and z in the base frame, apart from one another [m].
    radius : float
        > 0 [m].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    dimension = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfSpace(Half):
    """
    All on one side of a plane, a floor or a wall for example.

    Parameters
    ----------
    point : tuple of float
        Of the plane, x, y and z in the base frame [m].
    normal : tuple of float
        Towards the side that is allowed, not zero.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    dimension = 3
