"""Via points in the messages of a task."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidSizeError, InvalidValueError
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import MOST_VIA_POINTS, ViaPoint
from flex_planner.ros.messages.classes import MotionTask, Point
from flex_planner.ros.messages.points import point_coordinates, point_message
import numpy as np


def via_points_from_message(message: MotionTask, arm: Arm) -> tuple[ViaPoint, ...]:
    """
    Return the via points of a request; what depends on the arm's reach is checked by `Task`.

    Raises
    ------
    InvalidValueError
        Naming field, value and bound.

    """
    times, n = message.via_times, arm.n_joints
    count = len(times)
    if count > MOST_VIA_POINTS:
        raise InvalidSizeError('via_times', f'{count} entries', f'at most {MOST_VIA_POINTS}')
    for name, each in (('via_positions', n), ('via_points', 1)):
        size = len(getattr(message, name))
        if size not in (0, each * count):
            raise InvalidSizeError(name, f'{size} entries', f'a list of {each * count}, {each} '
                                   'for each of via_times, or empty')
    if count and not (len(message.via_positions) or len(message.via_points)):
        raise InvalidValueError('via_times', f'a list of {count}', 'empty where via_positions and '
                                'via_points are')
    positions = np.asarray(message.via_positions, dtype=np.float64).reshape(-1, n)
    found = []
    for k in range(count):
        if not times[k] >= 0:
            raise InvalidValueError(f'via_times[{k}]', times[k], 'a number >= 0 s')
        time = float(times[k]) or None
        if len(positions) and not np.isnan(positions[k]).all() or not len(message.via_points):
            found.append(ViaPoint(positions=positions[k], time=time))
        else:
            point = message.via_points[k]
            found.append(ViaPoint(point=point_coordinates(point, arm), time=time))
    return tuple(found)


def fill_via_points(message: MotionTask, task: Task) -> None:
    """Enter the via points of a task."""
    if not task.via_points:
        return
    n = task.arm.n_joints
    message.via_times = [via.time or 0.0 for via in task.via_points]
    message.via_positions = np.concatenate([
        via.positions if via.positions.size else np.full(n, np.nan)
        for via in task.via_points]).tolist()
    message.via_points = [point_message(via.point) if via.point.size else Point()
                          for via in task.via_points]
