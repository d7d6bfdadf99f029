"""Regions that are kept free: circles, capsules and half-planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import number, vector
import numpy as np

_FURTHEST = 1e6
# of the radius: rounds the tip of the cone at a centre, where a distance has no gradient
_ROUNDING = 0.1


def _point(name: str, given: Sequence[float]) -> tuple[float, float]:
    """Return a checked point in the base frame [m]."""
    x, y = vector(name, given, 2, at_least=-_FURTHEST, at_most=_FURTHEST, unit='m').tolist()
    return x, y


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """
    A disc.

    Parameters
    ----------
    center : tuple of float
        In the base frame [m].
    radius : float
        > 0 [m].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    center: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, 'center', _point('center', self.center))
        number('radius', self.radius, above=0, at_most=_FURTHEST, unit='m')

    @property
    def scale(self) -> float:
        """Return the length in which slacks are measured [m]."""
        return self.radius

    @property
    def numbers(self) -> list[float]:
        """Return its values."""
        return [*self.center, self.radius]

    @property
    def middle(self) -> tuple[float, float]:
        """Return its centre [m]."""
        return self.center

    @staticmethod
    def express(point: Any, numbers: Sequence[Any], clearance: Any) -> Any:
        """Return the slack of a point that stays so far outside, of symbols."""
        import casadi as ca

        x, y, radius = numbers
        return _outside(ca.sumsqr(point - ca.vertcat(x, y)), radius + clearance, radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule:
    """
    All within a distance of a segment, a wall for example.

    Parameters
    ----------
    start, end : tuple of float
        Of the segment, in the base frame, apart from one another [m].
    radius : float
        > 0 [m].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    start: tuple[float, float]
    end: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        for name in ('start', 'end'):
            object.__setattr__(self, name, _point(name, getattr(self, name)))
        if self.start == self.end:
            raise InvalidValueError('end', list(self.end), 'another point than start')
        number('radius', self.radius, above=0, at_most=_FURTHEST, unit='m')

    @property
    def scale(self) -> float:
        """Return the length in which slacks are measured [m]."""
        return self.radius

    @property
    def numbers(self) -> list[float]:
        """Return its values."""
        return [*self.start, *self.end, self.radius]

    @property
    def middle(self) -> tuple[float, float]:
        """Return the middle of the segment [m]."""
        x, y = (np.add(self.start, self.end) / 2).tolist()
        return x, y

    @staticmethod
    def express(point: Any, numbers: Sequence[Any], clearance: Any) -> Any:
        """Return the slack of a point that stays so far outside, of symbols."""
        import casadi as ca

        *ends, radius = numbers
        square = distance_to_segment(point, ca.vertcat(*ends[:2]), ca.vertcat(*ends[2:]))
        return _outside(square, radius + clearance, radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfPlane:
    """
    All on one side of a line.

    Parameters
    ----------
    point : tuple of float
        Of the line, in the base frame [m].
    normal : tuple of float
        Towards the side that is allowed, not zero.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    point: tuple[float, float]
    normal: tuple[float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, 'point', _point('point', self.point))
        x, y = _point('normal', self.normal)
        length = float(np.hypot(x, y))
        if not length:
            raise InvalidValueError('normal', [x, y], 'a direction, not zero')
        object.__setattr__(self, 'normal', (x / length, y / length))

    @property
    def scale(self) -> float:
        """Return the length in which slacks are measured [m]."""
        return 1.0

    @property
    def numbers(self) -> list[float]:
        """Return its values."""
        return [*self.point, *self.normal]

    @property
    def middle(self) -> None:
        """Return None: it cannot be passed on two sides."""
        return None

    @staticmethod
    def express(point: Any, numbers: Sequence[Any], clearance: Any) -> Any:
        """Return the slack of a point that stays so far outside, of symbols."""
        import casadi as ca

        x, y, along, across = numbers
        return ca.dot(point - ca.vertcat(x, y), ca.vertcat(along, across)) - clearance


Region = Circle | Capsule | HalfPlane


def distance_to_segment(point: Any, start: Any, end: Any) -> Any:
    """Return the square of a point's distance to a segment, of symbols [m^2]."""
    import casadi as ca

    way = end - start
    share = ca.fmin(ca.fmax(ca.dot(point - start, way) / ca.sumsqr(way), 0), 1)
    return ca.sumsqr(point - start - share * way)


def _outside(square: Any, least: Any, scale: Any) -> Any:
    """Return the slack of a distance, given squared, that is to be at least so much."""
    import casadi as ca

    rounding = (_ROUNDING * least)**2
    return (ca.sqrt(square + rounding) - ca.sqrt(least**2 + rounding)) / scale


def stay_apart(square: Any, least: Any) -> Any:
    """Return the slack of two points, the square of whose distance is given [m^2]."""
    return _outside(square, least, least)
