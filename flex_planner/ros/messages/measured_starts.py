"""Tasks that start where the arm is measured to be."""

from __future__ import annotations

import copy

from flex_planner.base.errors import InvalidTaskError, InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.ros.messages.classes import MotionTask
from flex_planner.ros.messages.request_error import RequestError

_ARRAYS = ('start_positions', 'start_velocities', 'start_modal_displacements')


class ArmStateError(RequestError):
    """The arm is not where a plan starts, or nobody knows where it is."""


def starts_at_arm(message: MotionTask) -> bool:
    """
    Return whether a task starts where the arm is.

    Raises
    ------
    InvalidValueError
        If it starts in no way that there is.
    InvalidTaskError
        If it also says where it starts.

    """
    if message.start not in (MotionTask.GIVEN, MotionTask.CURRENT):
        raise InvalidValueError('start', message.start, '0 (GIVEN) or 1 (CURRENT)')
    if message.start == MotionTask.GIVEN:
        return False
    given = [name for name in _ARRAYS if len(getattr(message, name))]
    if given:
        raise InvalidTaskError(f'{given[0]} must be empty when start is 1 (CURRENT): the motion '
                               'starts where the arm is measured to be, at rest')
    return True


def with_start(message: MotionTask, positions: Array) -> MotionTask:
    """Return the task that starts at rest at joint positions, and is the same otherwise."""
    placed = copy.deepcopy(message)
    placed.start = MotionTask.GIVEN
    placed.start_positions = positions.tolist()
    if message.space == MotionTask.CARTESIAN:
        placed.space = MotionTask.CARTESIAN_GOAL
    return placed
