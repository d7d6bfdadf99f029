"""
Regions that are kept free: circles, capsules and half-planes.

Those in space are in `spatial_regions`.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import number, vector
import numpy as np

_FURTHEST = 1e6
# of the radius: rounds the tip of the cone at a centre, where a distance has no gradient
_ROUNDING = 0.1


class Region(ABC):
    """What tip and links keep out of; subclasses are frozen dataclasses."""

    __slots__ = ()
    dimension: ClassVar[int] = 2
    """Of the space that it is in, 2 or 3."""

    @property
    @abstractmethod
    def scale(self) -> float:
        """Return the length in which slacks are measured [m]."""

    @property
    @abstractmethod
    def numbers(self) -> list[float]:
        """Return its values."""

    @property
    @abstractmethod
    def middle(self) -> tuple[float, ...] | None:
        """Return its middle [m]; None if it cannot be passed on two sides."""

    @staticmethod
    @abstractmethod
    def express(point: Any, numbers: Sequence[Any], clearance: Any) -> Any:
        """Return the slack of a point that stays so far outside, of symbols."""

    def _point(self, name: str) -> tuple[float, ...]:
        """Check and keep a point in the base frame [m]."""
        point = tuple(vector(name, getattr(self, name), self.dimension, at_least=-_FURTHEST,
                             at_most=_FURTHEST, unit='m').tolist())
        object.__setattr__(self, name, point)
        return point


@dataclass(frozen=True, slots=True, kw_only=True)
class Ball(Region):
    """All within a distance of a point, in the plane or in space."""

    center: tuple[float, ...]
    radius: float

    def __post_init__(self) -> None:
        self._point('center')
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
    def middle(self) -> tuple[float, ...]:
        """Return its centre [m]."""
        return self.center

    @staticmethod
    def express(point: Any, numbers: Sequence[Any], clearance: Any) -> Any:
        """Return the slack of a point that stays so far outside, of symbols."""
        import casadi as ca

        *center, radius = numbers
        return _outside(ca.sumsqr(point - ca.vertcat(*center)), radius + clearance, radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pill(Region):
    """All within a distance of a segment, in the plane or in space."""

    start: tuple[float, ...]
    end: tuple[float, ...]
    radius: float

    def __post_init__(self) -> None:
        if self._point('start') == self._point('end'):
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
    def middle(self) -> tuple[float, ...]:
        """Return the middle of the segment [m]."""
        return tuple((np.add(self.start, self.end) / 2).tolist())

    @staticmethod
    def express(point: Any, numbers: Sequence[Any], clearance: Any) -> Any:
        """Return the slack of a point that stays so far outside, of symbols."""
        import casadi as ca

        *ends, radius = numbers
        size = len(ends) // 2
        square = distance_to_segment(point, ca.vertcat(*ends[:size]), ca.vertcat(*ends[size:]))
        return _outside(square, radius + clearance, radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class Half(Region):
    """All on one side of a line in the plane, or of a plane in space."""

    point: tuple[float, ...]
    normal: tuple[float, ...]

    def __post_init__(self) -> None:
        self._point('point')
        normal = np.array(self._point('normal'))
        length = float(np.linalg.norm(normal))
        if not length:
            raise InvalidValueError('normal', normal.tolist(), 'a direction, not zero')
        object.__setattr__(self, 'normal', tuple((normal / length).tolist()))

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

        size = len(numbers) // 2
        at, normal = ca.vertcat(*numbers[:size]), ca.vertcat(*numbers[size:])
        return ca.dot(point - at, normal) - clearance


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle(Ball):
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule(Pill):
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


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfPlane(Half):
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
