"""Messages without ROS: the same defaults, constants and bytes as with the classes of ROS."""

from __future__ import annotations

from importlib import import_module
import os
from pathlib import Path
import subprocess
import sys
from typing import Any

from flex_planner.recording import StandIns
from flex_planner.ros.messages import classes
from flex_planner.ros.messages.classes import TYPES, WHY_NOT_ROS
import pytest

OWN = [f'flex_planner_interfaces/msg/{name}' for name in (
    'FeedbackGains', 'FlexiblePoint', 'FlexibleTrajectory', 'MotionTask', 'PayloadSearch',
    'PlanReport')]
OTHERS = ['builtin_interfaces/msg/Duration', 'geometry_msgs/msg/Point',
          'sensor_msgs/msg/JointState', 'trajectory_msgs/msg/JointTrajectory',
          'trajectory_msgs/msg/JointTrajectoryPoint', 'sensor_msgs/msg/CameraInfo']
ROS = ['rclpy', 'flex_planner_interfaces', 'geometry_msgs', 'sensor_msgs', 'trajectory_msgs',
       'builtin_interfaces', 'rcl_interfaces']
RECORD = """
import sys
sys.modules.update(dict.fromkeys({blocked}))
from dataclasses import replace
from pathlib import Path
from flex_planner import load_arm, plan_path, Task
from flex_planner.planning.sampling import sample_plan
from flex_planner.ros.messages.classes import MotionTask, WHY_NOT_ROS
from flex_planner.ros.messages.plans import report_from_plan, report_trajectory
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.settings.planner import PlannerSettings
arm = load_arm('korayem_rigid')
plan = plan_path(Task(arm=arm, start_positions=[0, 1], goal_positions=[1, 1], duration=1.0))
settings = replace(PlannerSettings.for_arm(arm), recording_folder=sys.argv[1])
reference = sample_plan(plan, settings.sampling())
report = report_from_plan(plan)
trajectory = report_trajectory(report, plan, reference, settings)
state = RequestState(settings=settings, stamp_ns=1_700_000_000_000_000_005)
OutcomeRecorder(arm, '/node').write(MotionTask(duration=1.0), state, Outcome(
    report=report, trajectory=trajectory, plan=plan, reference=reference))
print(bool(WHY_NOT_ROS))
"""


def of_ros(name: str) -> Any:
    package, _, kind = name.split('/')
    return getattr(import_module(f'{package}.msg'), kind)


@pytest.mark.parametrize('name', [*OWN, *OTHERS])
def test_stand_in_has_fields_defaults_and_constants_of_the_class_of_ros(name: str) -> None:
    stand_in, original = StandIns(TYPES).find(name), of_ros(name)
    assert TYPES.encode(name, stand_in()) == TYPES.encode(name, original())
    assert list(stand_in.__slots__) == list(original.get_fields_and_field_types())
    constants = TYPES.constants(name)
    assert {key: getattr(original, key) for key in constants} == constants
    with pytest.raises(AttributeError):
        stand_in(nonsense=1)
    with pytest.raises(AttributeError):
        stand_in().nonsense = 1


def test_classes_are_those_of_ros_where_it_is() -> None:
    assert WHY_NOT_ROS == ''
    assert classes.PlanReport is of_ros('flex_planner_interfaces/msg/PlanReport')


def test_recording_is_the_same_with_and_without_ros(tmp_path: Path) -> None:
    for folder, blocked in (('with', []), ('without', ROS)):
        run = subprocess.run(
            [sys.executable, '-c', RECORD.format(blocked=blocked), str(tmp_path / 'recordings')],
            capture_output=True, text=True, timeout=200, env=os.environ, check=False)
        assert (run.stdout.strip(), run.stderr) == (str(bool(blocked)), '')
        (tmp_path / 'recordings').rename(tmp_path / folder)
    (recorded,) = (tmp_path / 'with').iterdir()
    (again,) = (tmp_path / 'without').iterdir()
    assert [path.name for path in sorted(recorded.iterdir())] == [
        path.name for path in sorted(again.iterdir())]
    for file in recorded.iterdir():
        assert file.read_bytes() == (again / file.name).read_bytes()


def test_messages_of_another_version_are_not_used_and_that_is_said() -> None:
    code = ('import flex_planner_interfaces.msg as installed\n'
            'class PlanReport:\n'
            '    get_fields_and_field_types = staticmethod(dict)\n'
            'installed.PlanReport = PlanReport\n'
            'from flex_planner.ros.messages import classes\n'
            'print(classes.WHY_NOT_ROS, len(classes.PlanReport().warnings))')
    run = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=100,
                         env=os.environ, check=True)
    assert run.stdout == ('the installed flex_planner_interfaces are of another version of '
                          'flex_planner: build them again 0\n')
