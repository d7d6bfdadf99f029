"""What is there for planar arms only, and refuses spatial ones."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError


class PlanarOnlyError(InvalidValueError):
    """A spatial arm was given to what knows planar arms only."""


def require_planar(arm: Arm, what: str) -> None:
    """
    Refuse a spatial arm.

    Parameters
    ----------
    arm : Arm
        Of either kind.
    what : str
        What does not know spatial arms, in the plural, such as ``'maps'``.

    Raises
    ------
    PlanarOnlyError
        If points of the arm are not those of a plane.

    """
    if arm.dimension != 2:
        raise PlanarOnlyError('arm', arm.name, f'a planar one: {what} do not know spatial arms')
