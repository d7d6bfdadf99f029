"""Start and goal of a motion as points where the tip of the arm rests."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.inverse_kinematics import posture_near_point
from flex_planner.base.errors import SingularError, UnreachableError
from flex_planner.base.validation import Array, vector
from numpy.typing import ArrayLike

MAX_COORDINATE = 1e6  # of a point [m]


def ends_at_points(arm: Arm, start: ArrayLike | None, goal: ArrayLike | None,
                   elbow: int, start_positions: Array | None = None) -> dict[str, Any]:
    """
    Return the fields of `Task` for a motion between points where the tip rests.

    The goal is looked for from the posture nearest to the start, so that the arm does not make a
    needless full turn.

    Parameters
    ----------
    arm : Arm
        n joints.
    start, goal : array_like, shape (2,) or, of a spatial arm, (3,); or None
        Tip positions in the base frame [m]; None where joint angles are given instead.
    elbow : int
        See :func:`flex_planner.arms.inverse_kinematics.inverse_kinematics`, +1 or -1.
    start_positions : numpy.ndarray, shape (n,), optional
        Joint angles at the start if there is no point [rad].

    Returns
    -------
    dict
        ``start_point`` and ``start_positions``, ``goal_point`` and ``goal_positions``, of the
        ends that have a point.

    Raises
    ------
    UnreachableError, SingularError, InvalidValueError
        See `posture_near_point`; the message says which point.

    """
    fields: dict[str, Any] = {}
    if start is not None:
        fields |= _end(arm, 'start', start, elbow, None)
    if goal is not None:
        near = fields.get('start_positions', start_positions)
        fields |= _end(arm, 'goal', goal, elbow, near)
    return fields


def _end(arm: Arm, name: str, point: ArrayLike, elbow: int,
         near: Array | None) -> dict[str, Any]:
    """Return the fields of one end at a point; errors say which."""
    field = f'{name}_point'
    checked = vector(field, point, arm.dimension, at_least=-MAX_COORDINATE,
                     at_most=MAX_COORDINATE, unit='m')
    try:
        return {field: checked, f'{name}_positions': posture_near_point(arm, checked, elbow, near)}
    except (UnreachableError, SingularError) as error:
        raise type(error)(f'{field}: {error}') from None
