"""Limits on the way of a study, of which an axis may give a number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.maps.axes import Axis
from flex_planner.optimal_control.path_constraints import PathConstraint, read_constraint

LIMIT_AXIS = 'limit_value'
# stands in a limit for the number that the axis gives
PLACE = 'VALUE'


def read_limits(texts: Sequence[str], values: Mapping[str, float],
                arm: Arm) -> tuple[PathConstraint, ...]:
    """
    Return the limits of a cell.

    Parameters
    ----------
    texts : sequence of str
        As of ``--limit``, with `PLACE` for the number of the axis ``limit_value``.
    values : mapping
        Of the axes, by name.
    arm : Arm
        Whose motion keeps them.

    Raises
    ------
    InvalidValueError
        Naming the limit by its place in the study file.

    """
    number = repr(values[LIMIT_AXIS]) if LIMIT_AXIS in values else PLACE
    found = []
    for i, text in enumerate(texts):
        found.append(read_constraint(f'limits[{i}]', text.replace(PLACE, number)))
        found[-1].check(f'limits[{i}]', arm)
    return tuple(found)


def check_limit_axis(texts: Sequence[str], axes: Sequence[Axis]) -> None:
    """Refuse an axis that no limit takes a number of, and a limit that lacks its number."""
    given = any(axis.name == LIMIT_AXIS for axis in axes)
    taken = any(PLACE in text for text in texts)
    if given and not taken:
        raise InvalidValueError(f'axes.{LIMIT_AXIS}', 'given',
                                f'left out: no limit has {PLACE} in the place of a number')
    if taken and not given:
        raise InvalidValueError('limits', list(texts),
                                f'without {PLACE}, or the axis {LIMIT_AXIS} given')
