"""Limits of the angle and the speed of a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint_units import units_of
from flex_planner.arms.spatial_joint import slides
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import integer, number
from flex_planner.optimal_control.path_constraints.path_constraint import (
    PathConstraint,
    SlackLabel,
)

if TYPE_CHECKING:
    from flex_planner.optimal_control.path_constraints.symbolic_arm import SymbolicArm


@dataclass(frozen=True, slots=True, kw_only=True)
class JointRange(PathConstraint):
    """
    The angle of a joint stays between two limits.

    Slacks: ``(upper - q) / w`` and ``(q - lower) / w``, with w the width of the range, or pi where
    one of them is infinite.

    Parameters
    ----------
    joint : int
        From 1.
    lower, upper : float
        [rad]; infinite for none.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    joint: int
    lower: float = -math.inf
    upper: float = math.inf

    def __post_init__(self) -> None:
        number('lower', self.lower, infinite=True, unit='rad')
        number('upper', self.upper, above=self.lower, infinite=True, unit='rad')
        if math.isinf(self.lower) and math.isinf(self.upper):
            raise InvalidValueError('upper', self.upper, 'an angle in rad, or lower is one')

    def check(self, name: str, arm: Arm) -> None:
        """Refuse a joint that the arm has not."""
        integer(f'{name}.joint', self.joint, at_least=1, at_most=arm.n_joints)

    def labels(self, arm: Arm) -> list[SlackLabel]:
        """Return the names of the finite limits."""
        unit = 'm' if slides(arm.joints[self.joint - 1]) else 'rad'
        return [SlackLabel(name=f'{kind} limit of joint {self.joint}', unit=unit,
                           scale=self._width) for kind, _ in self._sides]

    def numbers(self, arm: Arm) -> list[float]:
        """Return the finite limits and the width."""
        return [*(self.lower if kind == 'lower' else self.upper for kind, _ in self._sides),
                self._width]

    def structure(self, arm: Arm) -> str:
        """Return joint and sides."""
        return f'range {self.joint} {self._sides}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        angle, width = at.coordinates[self.joint - 1], numbers[-1]
        return [sign * (bound - angle) / width
                for (_, sign), bound in zip(self._sides, numbers, strict=False)]

    @property
    def _width(self) -> float:
        width = self.upper - self.lower
        return width if math.isfinite(width) else math.pi

    @property
    def _sides(self) -> list[tuple[str, int]]:
        return [(kind, sign) for kind, sign, bound in (
            ('upper', 1, self.upper), ('lower', -1, self.lower)) if math.isfinite(bound)]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSpeed(PathConstraint):
    """
    The speed of a joint stays below a limit in both directions.

    Slacks: ``1 - q' / w`` and ``1 + q' / w``.

    Parameters
    ----------
    joint : int
        From 1.
    limit : float
        w, > 0 [rad/s].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    joint: int
    limit: float

    def __post_init__(self) -> None:
        number('limit', self.limit, above=0, unit='rad/s')

    def check(self, name: str, arm: Arm) -> None:
        """Refuse a joint that the arm has not."""
        integer(f'{name}.joint', self.joint, at_least=1, at_most=arm.n_joints)

    def labels(self, arm: Arm) -> list[SlackLabel]:
        """Return the names of both directions."""
        unit = units_of(arm.joints[self.joint - 1]).speed
        return [SlackLabel(name=f'speed of joint {self.joint} {way}', unit=unit,
                           scale=self.limit) for way in ('forwards', 'backwards')]

    def numbers(self, arm: Arm) -> list[float]:
        """Return the limit."""
        return [self.limit]

    def structure(self, arm: Arm) -> str:
        """Return the joint."""
        return f'speed {self.joint}'

    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return the slacks."""
        share = at.rates[self.joint - 1] / numbers[0]
        return [1 - share, 1 + share]
