"""
What a limit on the way is: slacks that must stay positive at every moment of a motion.

A slack is a smooth, dimensionless function ``s(q, q')`` of the state, >= 0 where the limit is
kept. A new limit is a class with the methods of `PathConstraint`, and changes no other file.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from flex_planner.arms.arm import Arm

if TYPE_CHECKING:  # it imports CasADi, which takes as long as a plan
    from flex_planner.optimal_control.path_constraints.symbolic_arm import SymbolicArm


@dataclass(frozen=True, slots=True, kw_only=True)
class SlackLabel:
    """
    What a slack is called, and what it is in units.

    Attributes
    ----------
    name : str
        Of the limit, shown to people.
    unit : str
        Of the margin: '' for a bare number.
    scale : float
        Margin for a slack of 1, > 0 [unit].

    """

    name: str
    unit: str
    scale: float


class PathConstraint(ABC):
    """A limit that a motion keeps at every moment; subclasses are frozen dataclasses."""

    __slots__ = ()

    @property
    def bends(self) -> bool:
        """Return whether it limits the bending of a link, which a rigid arm does not have."""
        return False

    @property
    def is_obstacle(self) -> bool:
        """Return whether it can be passed on two sides."""
        return False

    @abstractmethod
    def check(self, name: str, arm: Arm) -> None:
        """Raise InvalidValueError, whose field begins with a name, if an arm has no such part."""

    @abstractmethod
    def labels(self, arm: Arm) -> list[SlackLabel]:
        """Return the label of each of its slacks, k of them."""

    @abstractmethod
    def numbers(self, arm: Arm) -> list[float]:
        """Return the values that may change without compiling anything again."""

    @abstractmethod
    def structure(self, arm: Arm) -> str:
        """Return all else that its expressions depend on, besides the arm."""

    @abstractmethod
    def express(self, at: SymbolicArm, numbers: Sequence[Any]) -> list[Any]:
        """Return its slacks as CasADi expressions, given symbols of its numbers."""
