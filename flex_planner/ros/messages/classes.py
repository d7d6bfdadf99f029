"""
The classes of messages: those that ROS has generated or, where it is missing, stand-ins.

A request is so recorded in the same way, and in the same bytes, with ROS and without.

"""

from __future__ import annotations

from typing import Any, Final

from flex_planner.recording import definition_folder, MessageTypes, StandIns

PACKAGE: Final = 'flex_planner_interfaces'
TYPES: Final = MessageTypes.load([definition_folder(PACKAGE)])

try:
    from builtin_interfaces.msg import Duration, Time
    from flex_planner_interfaces.msg import (
        FeedbackGains,
        FlexiblePoint,
        FlexibleTrajectory,
        MotionTask,
        PayloadSearch,
        PlanReport,
    )
    from geometry_msgs.msg import Point, Quaternion
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    for _class in (FeedbackGains, FlexiblePoint, FlexibleTrajectory, MotionTask, PayloadSearch,
                   PlanReport):
        _known = TYPES.fields(f'{PACKAGE}/msg/{_class.__name__}')
        if list(_class.get_fields_and_field_types()) != list(_known):
            raise ImportError(f'the installed {PACKAGE} are of another version of flex_planner: '
                              'build them again')
    WHY_NOT_ROS = ''
except ImportError as _error:
    WHY_NOT_ROS = str(_error)
    _find: Any = StandIns(TYPES).find
    Duration = _find('builtin_interfaces/msg/Duration')
    Time = _find('builtin_interfaces/msg/Time')
    FeedbackGains = _find(f'{PACKAGE}/msg/FeedbackGains')
    FlexiblePoint = _find(f'{PACKAGE}/msg/FlexiblePoint')
    FlexibleTrajectory = _find(f'{PACKAGE}/msg/FlexibleTrajectory')
    MotionTask = _find(f'{PACKAGE}/msg/MotionTask')
    PayloadSearch = _find(f'{PACKAGE}/msg/PayloadSearch')
    PlanReport = _find(f'{PACKAGE}/msg/PlanReport')
    Point = _find('geometry_msgs/msg/Point')
    Quaternion = _find('geometry_msgs/msg/Quaternion')
    JointState = _find('sensor_msgs/msg/JointState')
    JointTrajectory = _find('trajectory_msgs/msg/JointTrajectory')
    JointTrajectoryPoint = _find('trajectory_msgs/msg/JointTrajectoryPoint')

__all__ = [
    'Duration',
    'FeedbackGains',
    'FlexiblePoint',
    'FlexibleTrajectory',
    'JointState',
    'JointTrajectory',
    'JointTrajectoryPoint',
    'MotionTask',
    'PayloadSearch',
    'PlanReport',
    'Point',
    'Quaternion',
    'TYPES',
    'Time',
    'WHY_NOT_ROS',
]
