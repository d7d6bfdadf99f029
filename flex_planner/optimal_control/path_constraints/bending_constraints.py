"""Limits of the bending moment in a link, and of its deflection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.arms.link import Link
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.optimal_control.path_constraints.path_constraint import (
    PathConstraint,
    SlackLabel,
)
import numpy as np

if TYPE_CHECKING:
    from flex_planner.optimal_control.path_constraints.symbolic_arm import SymbolicArm

# of the largest curvature of a mode: less is none
_NO_CURVATURE = 1e-9


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


@dataclass(frozen=True, slots=True, kw_only=True)
class BendingMoment(_AlongLink):
    """
    The bending moment ``E I v''(x)`` at stations of a link stays below a limit.

    Slacks: 1 less the moment by the limit, in both directions.

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
        """Return the names of both directions at each station."""
        return [SlackLabel(name=f'bending moment of link {self.link} at {share:.3g} of its length',
                           unit='N m', scale=self.limit)
                for share, _ in self._curvatures(arm) for _ in (1, -1)]

    def numbers(self, arm: Arm) -> list[float]:
        """Return rigidity and limit."""
        return [arm.links[self.link - 1].flexural_rigidity, self.limit]

    def structure(self, arm: Arm) -> str:
        """Return link and stations."""
        return f'moment {self.link} {self.stations}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        rigidity, limit = numbers
        shares = [rigidity * at.bend(self.link - 1, row) / limit
                  for _, row in self._curvatures(at.arm)]
        return _both_ways(shares)

    def _curvatures(self, arm: Arm) -> list[tuple[float, Array]]:
        """Return the stations with a moment, and what it is there for E I = 1 and each mode."""
        link = arm.links[self.link - 1]
        rows = link.mode_shapes().curvature(np.array(self.stations) * link.length)
        rows = rows * np.array([_rigidity_at(link, share) for share in self.stations])[:, None]
        least = _NO_CURVATURE * np.abs(rows).max(initial=0.0)
        return [(share, row) for share, row in zip(self.stations, rows, strict=True)
                if np.abs(row).max() > least]


@dataclass(frozen=True, slots=True, kw_only=True)
class Deflection(_AlongLink):
    """
    The deflection at stations of a link stays below a share of its length.

    Slacks: 1 less the deflection by the limit, in both directions.

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
        """Return the names of both directions at each station."""
        scale = self.limit * arm.links[self.link - 1].length
        return [SlackLabel(name=f'deflection of link {self.link} at {share:.3g} of its length',
                           unit='m', scale=scale)
                for share in self._moving(arm) for _ in (1, -1)]

    def numbers(self, arm: Arm) -> list[float]:
        """Return the limit."""
        return [self.limit]

    def structure(self, arm: Arm) -> str:
        """Return link and stations."""
        return f'deflection {self.link} {self.stations}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        length = at.arm.links[self.link - 1].length
        shares = [at.deflection(self.link - 1, share) / (numbers[0] * length)
                  for share in self._moving(at.arm)]
        return _both_ways(shares)

    def _moving(self, arm: Arm) -> list[float]:
        """Return the stations that modes move."""
        link = arm.links[self.link - 1]
        shapes = np.abs(link.mode_shapes().shape(np.array(self.stations) * link.length))
        return [share for share, row in zip(self.stations, shapes, strict=True)
                if row.max() > _NO_CURVATURE * shapes.max()]


def _shares(given: Sequence[float]) -> tuple[float, ...]:
    """Return checked shares of a length."""
    if not len(given):
        raise InvalidValueError('stations', list(given), 'at least one share of the length')
    return tuple(vector('stations', given, len(given), at_least=0, at_most=1).tolist())


def _both_ways(shares: Sequence[Any]) -> list[Any]:
    """Return the slacks of shares of a limit, forwards and backwards."""
    return [1 - sign * share for share in shares for sign in (1, -1)]


def _rigidity_at(link: Link, share: float) -> float:
    """Return E I at a share of a link's length over that of the link."""
    end = 0.0
    for section in link.sections:
        end += section.share
        if share <= end:
            return section.rigidity
    return 1.0
