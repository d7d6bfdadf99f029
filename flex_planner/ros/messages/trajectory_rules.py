"""
The rules of ros2_controllers' joint_trajectory_controller for trajectories.

Rules of ``validate_trajectory_msg`` and of its handling of effort, Jazzy 4.22 and later. Works
on any object with the fields of ``trajectory_msgs/msg/JointTrajectory``.

"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flex_planner.base.text import shown_value
from flex_planner.optimal_control.task import MAX_JOINT_ANGLE, MAX_VELOCITY
import numpy as np

_FIELDS = ('positions', 'velocities', 'accelerations', 'effort')
_STILL = float(np.finfo(np.float32).eps)
# beyond every arm that could be meant: absolute values of the fields above, with their units
_LARGEST = (MAX_JOINT_ANGLE, 'rad'), (MAX_VELOCITY, 'rad/s'), (1e7, 'rad/s^2'), (1e7, 'N m')


def trajectory_violations(trajectory: Any, joint_names: Sequence[str], *,
                          stamped: bool = False) -> list[str]:
    """
    Return a sentence for each rule that a joint trajectory breaks; none if it is accepted.

    Parameters
    ----------
    trajectory : trajectory_msgs.msg.JointTrajectory
        Or anything with its fields.
    joint_names : sequence of str
        Joints of the controller; their order does not matter.
    stamped : bool
        Whether the motion may begin at a given time; otherwise it begins on arrival.

    """
    found = []
    if sorted(trajectory.joint_names) != sorted(joint_names):
        found.append(f'joint_names is {shown_value(list(trajectory.joint_names))}, but must be a '
                     f'permutation of {shown_value(list(joint_names))}')
    stamp = trajectory.header.stamp
    if not stamped and (stamp.sec or stamp.nanosec):
        found.append('header.stamp must be 0, which starts the motion on arrival')
    if not trajectory.points:
        return [*found, 'points must not be empty']
    found += _time_violations(trajectory.points)
    for index, point in enumerate(trajectory.points):
        found += _point_violations(index, point, len(joint_names))
    last = trajectory.points[-1]
    if any(abs(speed) > _STILL for speed in last.velocities):
        found.append('the last velocities must be 0')
    return found


def range_violations(trajectory: Any) -> list[str]:
    """Return a sentence for each field of a full and finite trajectory with values too large."""
    found = []
    for name, (largest, unit) in zip(_FIELDS, _LARGEST, strict=True):
        values = np.array([getattr(point, name) for point in trajectory.points], dtype=float)
        point, joint = np.unravel_index(np.abs(values).argmax(), values.shape)
        value = float(values[point, joint])
        if abs(value) > largest:
            found.append(f'points[{point}].{name}[{joint}] is {value:g}, but must be a number '
                         f'>= {-largest:g} and <= {largest:g} {unit}')
    return found


def _time_violations(points: Sequence[Any]) -> list[str]:
    """Check that times start at 0 or later and strictly increase."""
    times = [point.time_from_start.sec * 10**9 + point.time_from_start.nanosec
             for point in points]
    if times[0] < 0:
        return ['points[0].time_from_start must be >= 0']
    return [f'points[{i}].time_from_start must be later than that of the point before'
            for i, (a, b) in enumerate(zip(times[:-1], times[1:], strict=True), 1) if b <= a]


def _point_violations(index: int, point: Any, joints: int) -> list[str]:
    """Check that a point is full and finite."""
    found = []
    for name in _FIELDS:
        values = np.asarray(getattr(point, name), dtype=float)
        if values.shape != (joints,):
            found.append(f'points[{index}].{name} has {values.size} entries, but must have '
                         f'{joints}')
        elif not np.isfinite(values).all():
            found.append(f'points[{index}].{name} must be finite')
    return found
