"""The planner node and where the arm is, which joint states of this process tell it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
from pathlib import Path
import time
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.optimal_control.task import postures_from_points
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner_interfaces.msg import MotionTask, PlanReport
from geometry_msgs.msg import Point
import numpy as np
import pytest
from rclpy.clock import Clock, ClockType
from ros_support import Planner
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

PERIOD = 0.02  # [s]
AT_ONCE = {'space': MotionTask.JOINT, 'duration': 1.0, 'publish': True}
CURRENT = {**AT_ONCE, 'start': MotionTask.CURRENT, 'goal_positions': [1.2, -1.7]}


class WatchedPlanner(Planner):
    """A planner, and an arm that says where it is."""

    def __init__(self, folder: Path, name: str, **parameters: object) -> None:
        super().__init__(folder, 'korayem_rigid', name, joint_states_topic=f'/{name}/joint_states',
                         **parameters)
        self._states = self.node.create_publisher(JointState, f'/{name}/joint_states', 10)
        self._say: Callable[[float], list[JointState]] = lambda passed: []
        self._began = time.monotonic()
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.node.create_timer(PERIOD, self._publish, clock=steady)

    def put(self, say: Callable[[float], list[JointState]] | list[JointState],
            seconds: float = 0.4) -> None:
        """Say where the arm is from now on, maybe by the time that passes, and wait [s]."""
        self._say = say if callable(say) else lambda passed: say
        self._began = time.monotonic()
        self.spin(seconds)

    def _publish(self) -> None:
        for message in self._say(time.monotonic() - self._began):
            self._states.publish(message)


def state(**positions: float) -> JointState:
    return JointState(name=list(positions), position=list(positions.values()),
                      velocity=[0.0] * len(positions))


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WatchedPlanner]:
    with WatchedPlanner(tmp_path_factory.mktemp('start'), 'watched') as planner:
        yield planner
        assert planner.process.process.poll() is None
        assert 'Traceback' not in planner.log()


@pytest.fixture(scope='module')
def start(rigid_arm: Arm) -> list[float]:
    """Return where the motion of the paper starts."""
    return postures_from_points(rigid_arm, (0.5, 0.0), (0.5, 0.5), -1)[0].tolist()


def published(planner: WatchedPlanner) -> JointTrajectory:
    """Return the latest on the topic."""
    return planner.latched(JointTrajectory, f'{planner.name}/joint_trajectory')


def test_arm_that_says_nothing_is_not_checked_and_cannot_be_started_from(
        planner: WatchedPlanner) -> None:
    planner.put([])
    report = planner.report(publish=True)
    assert (report.error_code, list(report.measured_positions)) == (PlanReport.NONE, [])
    report = planner.report(**CURRENT)
    assert report.error_code == PlanReport.ARM_STATE_UNKNOWN
    assert 'no message comes on /watched/joint_states' in report.error_msg


def test_joint_states_of_something_else_are_told_of_once(planner: WatchedPlanner) -> None:
    planner.put([state(gripper=0.1, rail=2.0)])
    assert planner.report(publish=True).error_code == PlanReport.NONE
    assert planner.log().count('name gripper, rail, but no joint of joint_names') == 1


def test_plan_that_starts_at_the_arm_is_published(planner: WatchedPlanner,
                                                  start: list[float]) -> None:
    planner.put([state(joint2=start[1] + 0.01, gripper=0.3), state(joint1=start[0])])
    answer = planner.plan(publish=True)
    assert (answer.report.error_code, answer.report.error_msg) == (PlanReport.NONE, '')
    assert list(answer.report.measured_positions) == [start[0], start[1] + 0.01]
    assert published(planner) == answer.trajectory.joint_trajectory


def test_plan_that_starts_elsewhere_is_answered_and_recorded_but_not_published(
        planner: WatchedPlanner, start: list[float]) -> None:
    before = published(planner)
    planner.put([state(joint1=start[0], joint2=start[1] + 0.2)])
    answer = planner.plan(publish=True, payload_mass=0.7)
    report = answer.report
    assert report.error_code == PlanReport.NOT_AT_START
    assert 'joint2 is at -1.894 rad, but the plan starts at -2.094 rad' in report.error_msg
    assert answer.trajectory.points
    assert published(planner) == before
    assert RecordedRequest.read(report.recording).report.error_code == PlanReport.NOT_AT_START
    assert planner.report(payload_mass=0.7).error_code == PlanReport.NONE  # not to be published
    assert planner.plan_goal(publish=True).end()[1].report.error_code == PlanReport.NOT_AT_START
    assert planner.set_parameter('check_start', False).successful
    assert planner.report(publish=True).error_code == PlanReport.NONE
    assert planner.set_parameter('check_start', True).successful


def test_plan_is_not_published_while_the_arm_moves(planner: WatchedPlanner,
                                                   start: list[float]) -> None:
    def move(passed: float) -> list[JointState]:
        position = start[0] + 0.04 * math.sin(5 * passed)
        return [JointState(name=['joint1', 'joint2'], position=[position, start[1]])]

    planner.put(move)
    answer = planner.plan(publish=True)
    assert answer.report.error_code == PlanReport.ARM_MOVES
    assert 'joint1 moves' in answer.report.error_msg
    assert answer.trajectory.points
    report = planner.report(**CURRENT)
    assert report.error_code == PlanReport.ARM_MOVES


def test_motion_starts_where_the_arm_is(planner: WatchedPlanner) -> None:
    planner.put([state(tool=7.0, joint2=-2.0), state(joint1=0.9)])
    answer = planner.plan(**CURRENT)
    first, last = (answer.trajectory.joint_trajectory.points[k] for k in (0, -1))
    assert answer.report.error_code == PlanReport.NONE, answer.report.error_msg
    assert np.allclose(first.positions, [0.9, -2.0], atol=1e-9)
    assert np.allclose(last.positions, [1.2, -1.7], atol=1e-3)
    assert list(answer.report.measured_positions) == [0.9, -2.0]
    task = RecordedRequest.read(answer.report.recording).task
    assert (task.start, list(task.start_positions)) == (MotionTask.GIVEN, [0.9, -2.0])
    to_point = planner.plan(start=MotionTask.CURRENT, goal_point=Point(x=0.5, y=0.5), elbow=-1)
    assert np.allclose(to_point.trajectory.joint_trajectory.points[0].positions, [0.9, -2.0])
    search = planner.search(**{**CURRENT, 'payload_mass': 5.0, 'payload_accuracy': 2.0})
    assert search.report.error_code == PlanReport.NONE, search.report.error_msg
    assert list(search.report.measured_positions) == [0.9, -2.0]


@pytest.mark.parametrize(('fields', 'code', 'words'), [
    ({'start': 2}, PlanReport.OUT_OF_RANGE, 'start is 2, but must be 0 (GIVEN) or 1 (CURRENT)'),
    ({'start_positions': [0.0, 1.0]}, PlanReport.INVALID_TASK, 'start_positions must be empty'),
    ({'start_velocities': [0.0, 1.0]}, PlanReport.INVALID_TASK, 'start_velocities must be empty'),
])
def test_start_that_contradicts_itself_is_refused(planner: WatchedPlanner, fields: dict[str, Any],
                                                  code: int, words: str) -> None:
    report = planner.report(**{**CURRENT, **fields})
    assert report.error_code == code
    assert words in report.error_msg


def test_arm_that_falls_silent_or_says_nonsense_is_no_longer_known(planner: WatchedPlanner,
                                                                   start: list[float]) -> None:
    planner.put([state(joint1=start[0], joint2=math.nan)])
    answer = planner.plan(publish=True)
    assert answer.report.error_code == PlanReport.ARM_STATE_UNKNOWN
    assert 'the position of joint2 is nan' in answer.report.error_msg
    assert answer.trajectory.points
    assert 'joint2 is nan' in planner.report(**CURRENT).error_msg
    planner.put([state(joint1=start[0], joint2=start[1])])
    planner.put([], seconds=1.3)
    report = planner.report(publish=True)
    assert report.error_code == PlanReport.ARM_STATE_UNKNOWN
    assert 'longer than joint_state_timeout = 1 s' in report.error_msg


def test_simulated_time_goes_with_simulated_stamps(tmp_path: Path, start: list[float]) -> None:
    with WatchedPlanner(tmp_path, 'simulated', use_sim_time=True) as planner:
        clock = planner.node.create_publisher(ClockMessage, '/clock', 10)
        now = [500.0]

        def tick(passed: float) -> list[JointState]:
            message, time_now = state(joint1=start[0], joint2=start[1]), now[0] + passed / 10
            stamp = message.header.stamp
            stamp.sec, stamp.nanosec = int(time_now), int(time_now % 1 * 1e9)
            clock.publish(ClockMessage(clock=stamp))
            return [message]

        planner.put(tick)
        report = planner.report(publish=True)
        assert report.error_code == PlanReport.NONE, report.error_msg
        assert list(report.measured_positions) == start
        planner.put([], seconds=1.3)  # the simulation is paused, and its time stands still
        report = planner.report(publish=True)
        assert report.error_code == PlanReport.NONE, report.error_msg
        planner.put([state(joint1=start[0], joint2=start[1])])  # no stamps
        assert planner.report(publish=True).error_code == PlanReport.NONE
        stale = state(joint1=start[0], joint2=start[1])
        stale.header.stamp.sec = int(time.time())  # of the wall's clock
        planner.put([stale])
        report = planner.report(publish=True)
        assert report.error_code == PlanReport.ARM_STATE_UNKNOWN
        assert 'use_sim_time' in report.error_msg
