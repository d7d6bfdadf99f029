"""
Limits of the bending moment in a link, and of its deflection.

A link of a planar arm bends to one side or the other, each of which has a slack; one in space
bends in two planes, and what is limited is the length of the resultant.

"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.optimal_control.path_constraints.path_constraint import (
    PathConstraint,
    SlackLabel,
)
import numpy as np

if TYPE_CHECKING:
    from flex_planner.optimal_control.path_constraints.symbolic_arm import SymbolicArm

# of what is most along the link: less is nothing
_NOTHING = 1e-9
# of the limit: rounds the tip of the cone where a link in space is straight
_ROUNDING = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class _AlongLink(PathConstraint):
    """A limit at stations of a link, in both directions."""

    link: int
    limit: float
    stations: tuple[float, ...]

    @property
    def bends(self) -> bool:
        """Return True."""
        return True

    def check(self, name: str, arm: Arm) -> None:
        """Refuse a link that the arm has not, or that does not bend."""
        integer(f'{name}.link', self.link, at_least=1, at_most=arm.n_joints)
        if not arm.links[self.link - 1].modes:
            raise InvalidValueError(f'{name}.link', self.link, 'a link with modes: a rigid one '
                                    'does not bend')
        if not self._bending(arm):
            raise InvalidValueError(f'{name}.link', self.link, 'a link that bends at one of the '
                                    'stations')

    @abstractmethod
    def _shapes(self, arm: Arm) -> Array:
        """Return what modes make of the limited quantity, shape (k, planes, modes)."""

    def _bending(self, arm: Arm) -> list[tuple[float, Array]]:
        """Return the stations at which there is any, and what modes make of it there."""
        rows = np.abs(shapes := self._shapes(arm)).max(axis=(1, 2), initial=0.0)
        return [(share, shape) for share, shape, row in zip(self.stations, shapes, rows,
                                                            strict=True)
                if row > _NOTHING * rows.max()]

    def _labels(self, arm: Arm, what: str, unit: str, scale: float) -> list[SlackLabel]:
        """Return a name for each slack."""
        return [SlackLabel(name=f'{what} of link {self.link} at {share:.3g} of its length',
                           unit=unit, scale=scale)
                for share, shape in self._bending(arm) for _ in range(2 // len(shape))]

    def _express(self, at: SymbolicArm, factor: Any) -> list[Any]:
        """Return the slacks of what is so many times the sum of modes."""
        return [slack for _, shape in self._bending(at.arm)
                for slack in _within([factor * at.bend(self.link - 1, row) for row in shape])]


@dataclass(frozen=True, slots=True, kw_only=True)
class BendingMoment(_AlongLink):
    """
    The bending moment ``E I v''(x)`` at stations of a link stays below a limit.

    Slacks: 1 less the moment by the limit, in both directions; in space
    ``sqrt(1 + r^2) - sqrt(|M|^2 / limit^2 + r^2)`` of the moments M in both planes, r = 0.1.

    Parameters
    ----------
    link : int
        From 1; it must have modes.
    limit : float
        > 0 [N m].
    stations : tuple of float
        Shares of the link's length, 0 to 1; where no mode has curvature there is no moment.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    link: int
    limit: float
    stations: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75)

    def __post_init__(self) -> None:
        number('limit', self.limit, above=0, unit='N m')
        object.__setattr__(self, 'stations', _shares(self.stations))

    def labels(self, arm: Arm) -> list[SlackLabel]:
        """Return the names of all directions at each station."""
        return self._labels(arm, 'bending moment', 'N m', self.limit)

    def numbers(self, arm: Arm) -> list[float]:
        """Return rigidity and limit."""
        return [arm.links[self.link - 1].flexural_rigidity, self.limit]

    def structure(self, arm: Arm) -> str:
        """Return link and stations."""
        return f'moment {self.link} {self.stations}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        rigidity, limit = numbers
        return self._express(at, rigidity / limit)

    def _shapes(self, arm: Arm) -> Array:
        """Return the moments of modes for E I = 1, shape (k, planes, modes)."""
        return arm.links[self.link - 1].moment_shapes(np.array(self.stations))


@dataclass(frozen=True, slots=True, kw_only=True)
class Deflection(_AlongLink):
    """
    The deflection at stations of a link stays below a share of its length.

    Slacks: 1 less the deflection by the limit, in both directions; in space as of a
    `BendingMoment`, of the deflections in both planes.

    Parameters
    ----------
    link : int
        From 1; it must have modes.
    limit : float
        Share of the link's length, > 0.
    stations : tuple of float
        Shares of the link's length, 0 to 1.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    link: int
    limit: float
    stations: tuple[float, ...] = (0.25, 0.5, 0.75, 1.0)

    def __post_init__(self) -> None:
        number('limit', self.limit, above=0)
        object.__setattr__(self, 'stations', _shares(self.stations))

    def labels(self, arm: Arm) -> list[SlackLabel]:
        """Return the names of all directions at each station."""
        return self._labels(arm, 'deflection', 'm', self.limit * arm.links[self.link - 1].length)

    def numbers(self, arm: Arm) -> list[float]:
        """Return the limit."""
        return [self.limit]

    def structure(self, arm: Arm) -> str:
        """Return link and stations."""
        return f'deflection {self.link} {self.stations}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        return self._express(at, 1 / (numbers[0] * at.arm.links[self.link - 1].length))

    def _shapes(self, arm: Arm) -> Array:
        """Return the deflections of modes, shape (k, planes, modes)."""
        return arm.links[self.link - 1].bend_shapes(np.array(self.stations))


def _shares(given: Sequence[float]) -> tuple[float, ...]:
    """Return checked shares of a length."""
    if not len(given):
        raise InvalidValueError('stations', list(given), 'at least one share of the length')
    return tuple(vector('stations', given, len(given), at_least=0, at_most=1).tolist())


def _within(shares: Sequence[Any]) -> list[Any]:
    """Return the slacks of shares of a limit: in both directions, or of those of two planes."""
    if len(shares) == 1:
        return [1 - shares[0], 1 + shares[0]]
    square = sum(share * share for share in shares)
    return [math.sqrt(1 + _ROUNDING**2) - (square + _ROUNDING**2)**0.5]
