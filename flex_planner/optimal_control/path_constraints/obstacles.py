"""Regions that tip and links keep out of, and links that keep clear of one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import integer, number
from flex_planner.optimal_control.path_constraints.path_constraint import (
    PathConstraint,
    SlackLabel,
)
from flex_planner.optimal_control.path_constraints.regions import (
    distance_to_segment,
    Region,
    stay_apart,
)

if TYPE_CHECKING:
    from flex_planner.optimal_control.path_constraints.symbolic_arm import SymbolicArm

_MOST_STATIONS = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class KeepOut(PathConstraint):
    """
    The tip, and stations of links, stay out of a region.

    Slack of a point: its distance from the region, less the clearance it needs, by the radius of
    the region (1 m for a half-plane); the distance is rounded off at a centre. Only the stations
    are kept out, not what lies between them: `link_radius` should make up for that.

    Parameters
    ----------
    region : Region
        What is kept free: a Circle, a Capsule or a HalfPlane, of a spatial arm a Sphere, a
        SpatialCapsule or a HalfSpace.
    tip_radius : float
        Of a payload round the tip, >= 0 [m].
    stations : int
        On each link, evenly spaced, its end included; 0 for the tip alone, up to 50.
    link_radius : float
        Half the width of the links at their stations, >= 0 [m].
    name : str
        Shown to people.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    region: Region
    tip_radius: float = 0.0
    stations: int = 0
    link_radius: float = 0.0
    name: str = ''

    def __post_init__(self) -> None:
        if not isinstance(self.region, Region):
            raise InvalidValueError('region', self.region, 'a Region such as a Circle, a Capsule '
                                    'or a HalfPlane, in space a Sphere')
        number('tip_radius', self.tip_radius, at_least=0, unit='m')
        integer('stations', self.stations, at_least=0, at_most=_MOST_STATIONS)
        number('link_radius', self.link_radius, at_least=0, unit='m')

    @property
    def is_obstacle(self) -> bool:
        """Return whether the region can be passed on two sides."""
        return self.region.middle is not None

    def check(self, name: str, arm: Arm) -> None:
        """Refuse a region of the plane for a spatial arm, and one of space for a planar arm."""
        if self.region.dimension != arm.dimension:
            raise InvalidValueError(f'{name}.region', type(self.region).__name__,
                                    'a Sphere, SpatialCapsule or HalfSpace: the arm is spatial'
                                    if arm.dimension == 3 else
                                    'a Circle, Capsule or HalfPlane: the arm is planar')

    def labels(self, arm: Arm) -> list[SlackLabel]:
        """Return the names of all points."""
        region = self.name or type(self.region).__name__.lower()
        points = ['tip', *(f'link {link + 1} at {share:.3g} of its length'
                           for link, share in self._stations(arm))]
        return [SlackLabel(name=f'{point} from {region}', unit='m', scale=self.region.scale)
                for point in points]

    def numbers(self, arm: Arm) -> list[float]:
        """Return the values of region and clearances."""
        return [*self.region.numbers, self.tip_radius, self.link_radius]

    def structure(self, arm: Arm) -> str:
        """Return kind of region and points."""
        return f'keep out {type(self.region).__name__} {self.stations}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        *region, of_tip, of_links = numbers
        last = at.arm.n_joints - 1
        return [self.region.express(at.point(last, 1.0), region, of_tip),
                *(self.region.express(at.point(link, share), region, of_links)
                  for link, share in self._stations(at.arm))]

    def _stations(self, arm: Arm) -> list[tuple[int, float]]:
        """Return links and shares of their lengths; the tip is no station."""
        every = [(link, k / self.stations) for link in range(arm.n_joints)
                 for k in range(1, self.stations + 1)]
        return every[:-1] if every else []


@dataclass(frozen=True, slots=True, kw_only=True)
class SelfClearance(PathConstraint):
    """
    Links stay clear of the base, and of links that are not their neighbours.

    Stations of every link from the second on stay away from the base, and of every link from the
    third on from the chords of the links before its neighbour.

    Parameters
    ----------
    base_radius : float
        Of the base round the first joint, > 0 [m].
    link_radius : float
        Half the width of the links, >= 0 [m].
    stations : int
        On each link, evenly spaced, its end included, 1 to 50.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    base_radius: float
    link_radius: float = 0.0
    stations: int = 4

    def __post_init__(self) -> None:
        number('base_radius', self.base_radius, above=0, unit='m')
        number('link_radius', self.link_radius, at_least=0, unit='m')
        integer('stations', self.stations, at_least=1, at_most=_MOST_STATIONS)

    def check(self, name: str, arm: Arm) -> None:
        """Refuse an arm of one link."""
        if arm.n_joints < 2:
            raise InvalidValueError(name, 'SelfClearance', 'left out for an arm of one link')

    def labels(self, arm: Arm) -> list[SlackLabel]:
        """Return the names of all pairs."""
        clear = self.base_radius + self.link_radius
        return [SlackLabel(name=f'link {link + 1} at {share:.3g} of its length from ' + (
            'the base' if other is None else f'link {other + 1}'), unit='m',
            scale=clear if other is None else 2 * self.link_radius)
            for link, share, other in self._pairs(arm)]

    def numbers(self, arm: Arm) -> list[float]:
        """Return the radii."""
        return [self.base_radius, self.link_radius]

    def structure(self, arm: Arm) -> str:
        """Return the points."""
        return f'self {self.stations} {self.link_radius > 0}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        import casadi as ca

        base, width = numbers
        slacks = []
        for link, share, other in self._pairs(at.arm):
            point = at.point(link, share)
            slacks.append(stay_apart(ca.sumsqr(point - at.point(0, 0.0)), base + width)
                          if other is None else
                          stay_apart(distance_to_segment(
                              point, at.point(other, 0.0), at.point(other, 1.0)), 2 * width))
        return slacks

    def _pairs(self, arm: Arm) -> list[tuple[int, float, int | None]]:
        """Return link, share of its length, and what it stays away from: None for the base."""
        long = [i for i, link in enumerate(arm.links) if link.length]
        others = long if self.link_radius else []
        # joints of a spatial arm may be at one place: links are neighbours across such a link
        return [(link, k / self.stations, other) for link in long[1:]
                for other in (None, *(i for i in others if i < link and any(
                    i < between < link for between in long)))
                for k in range(1, self.stations + 1)]
