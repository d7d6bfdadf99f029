"""A goal that moves while a simulated arm is on its way, with the real nodes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner.ros.messages.times import time_message, time_ns
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.msg import MotionTask, PlanReport
from geometry_msgs.msg import Point
import numpy as np
import pytest
from ros_support import LATCHED, PARAMETER_FILE, Planner, STARTING
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

LEAD = 2.5  # [s], enough for a machine that is busy
START = [np.pi / 3, -2 * np.pi / 3]  # tip at (0.5, 0) m


class Chase(Planner):
    """A planner, a simulated arm that follows it, and what both say."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, 'korayem_rigid', 'chaser', space='/chase', replan_lead=LEAD,
                         state_estimate_timeout=5.0)
        self.arm = NodeProcess(
            'flex_planner.ros.arm_simulator', {
                'arm': 'korayem_rigid', 'joint_names': ['joint1', 'joint2'], 'payload_mass': 1.0,
                'initial_positions': START, 'vibration_window': 0.5},
            {'__ns': '/chase', 'joint_trajectory': f'{self.name}/joint_trajectory'},
            log=folder / 'arm.log', parameter_file=PARAMETER_FILE)
        self.states: list[JointState] = self.listen(JointState, '/chase/joint_states', 100)
        self.stream: list[JointState] = self.listen(
            JointState, f'{self.name}/reference_states', 1000)
        self.vibrations: list[Float64] = self.listen(
            Float64, '/chase/arm_simulator/residual_vibration', LATCHED)
        self.estimates = self.node.create_publisher(JointState, f'{self.name}/state_estimate', 10)

    def now(self) -> int:
        """Return the time [ns]."""
        return int(self.node.get_clock().now().nanoseconds)

    def replace(self, plan_id: str, x: float, y: float, **fields: object) -> PlanReport:
        """Ask for a motion to another point in place of the one that is carried out."""
        return self.plan(**{
            'space': MotionTask.CARTESIAN_GOAL, 'start_point': Point(), 'duration': 0.0,
            'goal_point': Point(x=x, y=y), 'replaces': plan_id, 'publish': True,
            **fields}).report


@pytest.fixture(scope='module')
def chase(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chase]:
    with Chase(tmp_path_factory.mktemp('chase')) as chase, chase.arm:
        chase.wait('the arm', lambda: bool(chase.states), STARTING)
        chase.wait('the planner', lambda: chase.estimates.get_subscription_count() > 0, STARTING)
        yield chase
        assert 'Traceback' not in chase.log()


def check_trajectory(chase: Chase, report: PlanReport, before: JointTrajectory) -> JointTrajectory:
    """Return the latest on the topic, which goes on with the one before it."""
    message = chase.latched(JointTrajectory, f'{chase.name}/joint_trajectory')
    begin, start = time_ns(message.header.stamp), time_ns(report.start_time)
    assert begin < start
    times = begin + np.array([time_ns(point.time_from_start) for point in message.points])
    k = int(np.flatnonzero(times == start)[0])
    assert times[k - 1] == start - 1000
    for name in ('positions', 'velocities', 'effort'):
        first, last = (np.array(getattr(message.points[i], name)) for i in (k, k - 1))
        np.testing.assert_allclose(first, last, rtol=0, atol=1e-3 if name == 'effort' else 1e-5)
    known = {tuple(point.positions) for point in before.points}
    assert all(tuple(point.positions) in known for point in message.points[:k - 1])
    return message


def test_moving_goal_is_followed_by_the_arm(chase: Chase, rigid_arm: Arm) -> None:
    # with a price on the rates of torques, so that these do not jump
    plain = chase.plan(publish=True, duration=10.0, torque_rate_weight=[1e-3])
    report, trajectory = plain.report, plain.trajectory.joint_trajectory
    assert report.error_code == PlanReport.NONE, report.error_msg
    assert time_ns(trajectory.header.stamp) == time_ns(report.start_time) == 0
    for x, y in ((0.52, 0.48), (0.55, 0.45)):
        report = chase.replace(report.plan_id, x, y)
        assert (report.error_code, report.continuation) == (PlanReport.NONE, 'REPLANNED'), (
            report.error_msg)
        assert np.abs(report.torque_step).max() < 1e-9
        trajectory = check_trajectory(chase, report, trajectory)
    chase.vibrations.clear()
    chase.wait('the arrival', lambda: bool(chase.vibrations))
    assert chase.vibrations[0].data < 1e-3
    tip = tip_position(rigid_arm, np.array(chase.next_of(chase.states).position))
    np.testing.assert_allclose(tip, [0.55, 0.45], atol=2e-3)
    stamps = [time_ns(state.header.stamp) for state in chase.stream]
    assert stamps == sorted(stamps)
    # as the rates say, by the trapezoidal rule, also where one plan replaces another
    positions, rates = (np.array([getattr(state, name)[:2] for state in chase.stream])
                        for name in ('position', 'velocity'))
    steps = np.diff(stamps)[:, None] * 1e-9
    np.testing.assert_allclose(np.diff(positions, axis=0), (rates[1:] + rates[:-1]) / 2 * steps,
                               rtol=0, atol=1e-5)


def test_motion_of_its_own_may_begin_at_a_given_time(chase: Chase) -> None:
    start = time_message(chase.now() + 600 * 10**9)
    answer = chase.plan(duration=10.0, start_time=start)
    assert answer.report.error_code == PlanReport.NONE, answer.report.error_msg
    assert answer.report.start_time == answer.trajectory.header.stamp == start
    assert answer.trajectory.joint_trajectory.header.stamp == start
    assert answer.report.plan_id


def test_what_cannot_be_replaced_is_said_and_nothing_is_published(chase: Chase) -> None:
    before = chase.latched(JointTrajectory, f'{chase.name}/joint_trajectory')
    for fields, code, sentence in (
            ({'replaces': 'nobody'}, PlanReport.INVALID_TASK, "replaces is 'nobody', but"),
            ({'start_time': time_message(chase.now() - 10**8)}, PlanReport.START_TIME_PASSED,
             'start_time is'),
            ({'replaces': ''}, PlanReport.INVALID_SIZE, 'start_positions'),
            ({'replaces': '', 'keep_time': True}, PlanReport.INVALID_TASK, 'keep_time is given')):
        report = chase.replace('', 0.5, 0.5, **fields)
        assert (report.error_code, sentence in report.error_msg) == (code, True), report.error_msg
    search = chase.search(replaces='nobody').report
    assert search.error_code == PlanReport.INVALID_TASK
    assert 'a search for the maximum payload replaces none' in search.error_msg
    assert chase.latched(JointTrajectory, f'{chase.name}/joint_trajectory') == before


def test_stop_is_carried_out_and_recorded_as_a_failure(chase: Chase) -> None:
    back = chase.plan(publish=True, start=MotionTask.CURRENT, space=MotionTask.CARTESIAN_GOAL,
                      start_point=Point(), goal_point=Point(x=0.5, y=0.1), duration=10.0).report
    assert back.error_code == PlanReport.NONE, back.error_msg
    stream = chase.stream[-1]
    estimate = JointState(name=stream.name, position=stream.position, velocity=stream.velocity)
    estimate.header.stamp = stream.header.stamp
    chase.estimates.publish(estimate)
    chase.vibrations.clear()
    report = chase.replace(back.plan_id, 0.9, 0.2, duration=0.05, keep_time=True,
                           on_failure=MotionTask.STOP)
    assert (report.error_code, report.continuation) == (PlanReport.STOPS, 'STOPS'), (
        report.error_msg)
    assert 'the arm stops on the path of the plan before' in report.error_msg
    assert report.bending_source == 'ESTIMATE'
    chase.wait('the recording', Path(report.recording).exists)  # written after the answer
    recorded = RecordedRequest.read(report.recording)
    assert recorded.report.error_code == PlanReport.STOPS
    assert recorded.report.plan_id == report.plan_id
    chase.wait('the stop', lambda: bool(chase.vibrations))
    assert chase.vibrations[0].data < 1e-3
    assert np.abs(chase.next_of(chase.states).velocity).max() < 1e-3
