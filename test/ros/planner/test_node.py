"""The planner node in a process of its own, over Fast DDS."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from contextlib import ExitStack
import math
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

from flex_planner.arms.arm_files import find_arm_file, load_arm
from flex_planner.optimal_control.task import postures_from_points
from flex_planner.ros.messages.trajectory_rules import trajectory_violations
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.msg import (
    FeedbackGains,
    FlexibleTrajectory,
    MotionTask,
    PayloadSearch,
    PlanReport,
)
from geometry_msgs.msg import Point
import pytest
from rcl_interfaces.srv import DescribeParameters, ListParameters
from ros_support import LONG, PARAMETER_FILE, Planner, STARTING, SUPPORT
from trajectory_msgs.msg import JointTrajectory

JOINTS = ['joint1', 'joint2']
COST = 0.64717  # J of the flexible arm, to 1e-4

# A program that asks for the plan that LONG makes slow, and never hears the answer.
DOOMED_CLIENT = """
import rclpy
from flex_planner_interfaces.msg import MotionTask
from flex_planner_interfaces.srv import PlanPath
rclpy.init()
node = rclpy.create_node('doomed')
client = node.create_client(PlanPath, '/flex_planner/plan_path')
assert client.wait_for_service(60)
task = MotionTask(start_positions=[1.0, -2.0], goal_positions=[1.5, -1.5], duration=100.0,
                  start_modal_displacements=[0.02, 0.0, 0.02, 0.0], effort_weights=[0.1, 0.1],
                  allowed_planning_time=0.8, publish=True)
future = client.call_async(PlanPath.Request(task=task))
rclpy.spin_once(node, timeout_sec=0.2)
print('sent', flush=True)
rclpy.spin_until_future_complete(node, future)
"""


def check_health(planner: Planner) -> None:
    """Require that the node still runs and never raised where nobody caught it."""
    assert planner.process.process.poll() is None
    assert 'Traceback' not in planner.log()


def check_end(planner: Planner, number: signal.Signals) -> None:
    """Require that a signal ends the node in good order, whatever it is at work on."""
    memory = planner.shared_memory()
    assert memory
    assert planner.stop(number) == 0
    assert 'Traceback' not in planner.log()
    assert not [path for path in (*memory, *planner.recordings.glob('.*')) if path.exists()]


@pytest.fixture(scope='module', autouse=True)
def nodes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Planner]]:
    """Start both planners at once; in the end, stop one that is idle and one that searches."""
    folder = tmp_path_factory.mktemp('nodes')
    with Planner(folder, 'korayem_rigid', 'rigid_planner', record=False) as rigid, \
            Planner(folder, 'korayem_ei50', parameter_file=PARAMETER_FILE,
                    effort_weights=[1 / 8, 1 / 8], queue_length=1) as flexible:
        yield {'rigid': rigid, 'flexible': flexible}
        check_health(rigid)
        check_health(flexible)
        check_end(rigid, signal.SIGTERM)
        flexible.send_search(**LONG)
        flexible.spin(0.3)
        check_end(flexible, signal.SIGINT)


@pytest.fixture(scope='module')
def rigid(nodes: dict[str, Planner]) -> Planner:
    return nodes['rigid']


@pytest.fixture(scope='module')
def flexible(nodes: dict[str, Planner]) -> Planner:
    return nodes['flexible']


# Plans


def test_motion_of_the_paper_is_planned_with_its_certificate(flexible: Planner) -> None:
    report = flexible.report()
    assert (report.error_code, report.error_msg) == (PlanReport.NONE, '')
    assert report.cost == pytest.approx(COST, abs=1e-4)
    assert report.effort == pytest.approx(16 * report.cost, rel=1e-6)  # R = 1/8, no other weight
    assert report.boundary_error < 1e-3
    assert report.hamiltonian_drift < 0.02
    assert report.tip_error < 1e-5
    assert report.residual_vibration < 1e-4
    assert report.collocation_residual < 0.05
    assert 0 < report.torque_interpolation_error < 0.02
    assert report.iterations > 0
    assert report.mesh_intervals >= 60
    assert report.strategy == 'cold start'


def test_report_tells_the_peaks_and_the_time(flexible: Planner) -> None:
    began = time.monotonic()
    answer = flexible.plan()
    taken, report = time.monotonic() - began, answer.report
    points = answer.trajectory.joint_trajectory.points
    for i in range(2):
        # of the planned torques, which efforts have half a millisecond later
        largest = max(abs(point.effort[i]) for point in points)
        assert report.peak_torques[i] == pytest.approx(largest, rel=0.01)
        assert report.peak_speeds[i] == max(abs(point.velocities[i]) for point in points)
        assert report.peak_speed_shares[i] == pytest.approx(report.peak_speeds[i] / 3.5)
        assert report.peak_torques[i] / 8 < report.peak_torque_shares[i] + 1e-12 <= 1
    planning = report.planning_time.sec + report.planning_time.nanosec * 1e-9
    assert 0 < planning < taken


def test_report_tells_what_the_controller_makes_of_the_trajectory(flexible: Planner) -> None:
    report = flexible.plan().report
    assert 0 < report.executed_tip_error < 1e-5
    assert 0 < report.executed_residual_vibration < report.vibration_if_more_modes
    assert report.executed_tip_error < report.open_loop_tip_error < 1e-3
    assert report.open_loop_amplification == pytest.approx(1, abs=0.1)
    assert report.vibration_if_stiffness_differs > report.vibration_if_payload_differs > 0
    assert (report.controller_rate, report.effort_hold) == (1000.0, 'end')
    assert list(report.controller_stiffness) == [100.0, 100.0]


def test_joint_space_gives_the_motion_of_the_same_points(rigid: Planner) -> None:
    start, goal = postures_from_points(load_arm('korayem_rigid'), (0.5, 0), (0.5, 0.5), -1)
    angles = rigid.plan(space=MotionTask.JOINT, start_positions=start.tolist(),
                        goal_positions=goal.tolist(), start_point=Point(), goal_point=Point())
    points = rigid.plan()
    assert angles.report.error_code == points.report.error_code == PlanReport.NONE
    assert angles.trajectory == points.trajectory
    assert list(angles.trajectory.joint_trajectory.points[-1].positions) == goal.tolist()


def test_elbow_0_means_the_branch_of_the_parameter(rigid: Planner) -> None:
    assert rigid.parameter('elbow') == -1
    assert rigid.plan(elbow=0).trajectory == rigid.plan(elbow=-1).trajectory
    other = rigid.plan(elbow=1)
    assert other.report.error_code == PlanReport.NONE
    assert other.trajectory.joint_trajectory.points[0].positions[1] > 0


def test_controller_accepts_the_trajectory(rigid: Planner, flexible: Planner) -> None:
    for planner in (rigid, flexible):
        trajectory = planner.plan().trajectory.joint_trajectory
        assert trajectory_violations(trajectory, JOINTS) == []
        assert trajectory.joint_names == JOINTS


def test_flexible_trajectory_belongs_to_the_joints_trajectory(flexible: Planner) -> None:
    trajectory = flexible.plan().trajectory
    joints = trajectory.joint_trajectory.points
    assert trajectory.modal_names == ['link1_mode1', 'link1_mode2', 'link2_mode1', 'link2_mode2']
    assert len(trajectory.points) == len(trajectory.tip_path) == len(joints)
    for flex, joint in zip(trajectory.points, joints, strict=True):
        assert flex.time_from_start == joint.time_from_start
        assert len(flex.modal_displacements) == len(flex.modal_rates) == 4
        assert len(flex.position_costates) == len(flex.velocity_costates) == 6
    assert (trajectory.tip_path[0].x, trajectory.tip_path[0].y) == pytest.approx((0.5, 0.0))
    assert (trajectory.tip_path[-1].x, trajectory.tip_path[-1].y) == pytest.approx((0.5, 0.5))
    assert trajectory.payload_mass == 1.0
    assert trajectory.header.frame_id == 'base_link'


def test_rest_of_a_motion_is_planned_again_from_the_moving_arm(flexible: Planner) -> None:
    # unshifted: the first effort of a trajectory has nothing before it to be taken from
    period = flexible.parameter('controller_period')
    assert flexible.set_parameter('controller_period', 0.0).successful
    first = flexible.plan().trajectory
    joints, bending = first.joint_trajectory.points, first.points
    k = len(joints) // 2
    rest = flexible.plan(
        space=MotionTask.CARTESIAN_GOAL, start_point=Point(), start_positions=joints[k].positions,
        start_velocities=[*joints[k].velocities, *bending[k].modal_rates],
        start_modal_displacements=bending[k].modal_displacements,
        duration=1 - joints[k].time_from_start.nanosec * 1e-9)
    assert flexible.set_parameter('controller_period', period).successful
    assert rest.report.error_code == PlanReport.NONE
    again = rest.trajectory.joint_trajectory.points
    assert (again[0].positions, again[0].velocities) == (joints[k].positions, joints[k].velocities)
    # the same motors' torques, but for errors of the mesh
    assert list(again[0].effort) == pytest.approx(list(joints[k].effort), abs=1e-4)
    assert list(again[-1].positions) == pytest.approx(list(joints[-1].positions), abs=1e-12)


def test_motion_to_where_the_arm_is_stays_there(rigid: Planner) -> None:
    answer = rigid.plan(goal_point=Point(x=0.5, y=0.0))
    assert answer.report.error_code == PlanReport.NONE
    assert answer.report.cost == pytest.approx(0, abs=1e-20)
    assert all(not any(point.effort) for point in answer.trajectory.joint_trajectory.points)


# Topics


def test_plan_is_published_on_both_topics(flexible: Planner) -> None:
    joints = flexible.listen(JointTrajectory, '/flex_planner/joint_trajectory')
    bending = flexible.listen(FlexibleTrajectory, '/flex_planner/flexible_trajectory')
    flexible.spin(0.5)
    joints.clear()  # what was latched before
    bending.clear()
    answer = flexible.plan(publish=True, payload_mass=1.2)
    flexible.wait('trajectories', lambda: bool(joints and bending))
    assert joints == [answer.trajectory.joint_trajectory]
    assert bending == [answer.trajectory]


def test_late_subscriber_gets_the_last_published_plan(rigid: Planner) -> None:
    for payload in (0.5, 0.7):
        published = rigid.plan(publish=True, payload_mass=payload).trajectory
    rigid.plan(publish=False, payload_mass=0.9)
    late = rigid.latched(JointTrajectory, '/rigid_planner/joint_trajectory')
    assert late == published.joint_trajectory
    assert rigid.latched(FlexibleTrajectory, '/rigid_planner/flexible_trajectory') == published


@pytest.mark.parametrize('wrong', [
    {'duration': -1.0}, {'goal_point': Point(x=2.0)}, {'payload_mass': 200.0},
    {'allowed_planning_time': 1e-6}])
def test_failed_plan_publishes_nothing(rigid: Planner, wrong: dict[str, Any]) -> None:
    before = rigid.plan(publish=True).trajectory
    heard = rigid.listen(JointTrajectory, '/rigid_planner/joint_trajectory')
    rigid.wait('the plan before', lambda: bool(heard))
    answer = rigid.plan(publish=True, **wrong)
    assert answer.report.error_code != PlanReport.NONE
    assert answer.trajectory == FlexibleTrajectory()
    rigid.spin(0.2)
    assert heard == [before.joint_trajectory]
    late = rigid.latched(FlexibleTrajectory, '/rigid_planner/flexible_trajectory')
    assert late == before


# Requests that are wrong


BIG = array('d', [1.0]) * 10**6
JOINT_TASK = {'space': MotionTask.JOINT, 'start_positions': [0.0, 1.0],
              'goal_positions': [0.5, 0.7]}


@pytest.mark.parametrize(('wrong', 'code', 'field'), [
    ({'duration': math.nan}, PlanReport.NOT_FINITE, 'duration is nan'),
    ({'duration': math.inf}, PlanReport.NOT_FINITE, 'duration is inf'),
    ({'duration': -1.0}, PlanReport.OUT_OF_RANGE, 'duration is -1.0'),
    ({'duration': 0.0}, PlanReport.OUT_OF_RANGE, 'duration is 0.0'),
    ({'duration': 1e300}, PlanReport.OUT_OF_RANGE, 'duration is 1e+300'),
    ({'payload_mass': -0.1}, PlanReport.OUT_OF_RANGE, 'payload_mass is -0.1'),
    ({'payload_mass': math.nan}, PlanReport.NOT_FINITE, 'payload_mass'),
    ({'tolerance': 1.5}, PlanReport.OUT_OF_RANGE, 'tolerance is 1.5'),
    ({'tolerance': -1e-3}, PlanReport.OUT_OF_RANGE, 'tolerance'),
    ({'tolerance': math.nan}, PlanReport.NOT_FINITE, 'tolerance'),
    ({'allowed_planning_time': -1.0}, PlanReport.OUT_OF_RANGE, 'allowed_planning_time'),
    ({'allowed_planning_time': 1e9}, PlanReport.OUT_OF_RANGE, 'allowed_planning_time'),
    ({'allowed_planning_time': math.inf}, PlanReport.NOT_FINITE, 'allowed_planning_time'),
    ({'space': 3}, PlanReport.OUT_OF_RANGE, 'space is 3'),
    ({'elbow': 3}, PlanReport.OUT_OF_RANGE, 'elbow is 3'),
    ({'start_point': Point(x=math.nan)}, PlanReport.NOT_FINITE, 'start_point[0]'),
    ({'goal_point': Point(y=-math.inf)}, PlanReport.NOT_FINITE, 'goal_point[1]'),
    ({'effort_weights': [1.0]}, PlanReport.INVALID_SIZE, 'effort_weights'),
    ({'effort_weights': [1.0, 0.0]}, PlanReport.OUT_OF_RANGE, 'effort_weights[1]'),
    ({'position_weights': [1.0] * 3}, PlanReport.INVALID_SIZE, 'position_weights'),
    ({'velocity_weights': [1.0, -1.0]}, PlanReport.OUT_OF_RANGE, 'velocity_weights[1]'),
    ({'velocity_weights': [math.nan] * 2}, PlanReport.NOT_FINITE, 'velocity_weights[0]'),
    ({'velocity_weights': BIG}, PlanReport.INVALID_SIZE, 'velocity_weights'),
    ({**JOINT_TASK, 'goal_positions': BIG}, PlanReport.INVALID_SIZE, 'goal_positions'),
    ({**JOINT_TASK, 'start_positions': []}, PlanReport.INVALID_SIZE, 'start_positions'),
    ({**JOINT_TASK, 'start_positions': [0.0, 1e9]}, PlanReport.OUT_OF_RANGE,
     'start_positions[1] is 1000000000.0'),
    ({**JOINT_TASK, 'goal_positions': [math.inf, 0.0]}, PlanReport.NOT_FINITE,
     'goal_positions[0]'),
], ids=lambda value: str(value)[:60])
def test_malformed_request_is_refused_by_field(rigid: Planner, wrong: dict[str, Any], code: int,
                                               field: str) -> None:
    report = rigid.report(**wrong)
    assert report.error_code == code
    assert report.error_msg.startswith(field)
    assert 'must be' in report.error_msg
    assert report.cost == report.tip_error == math.inf


@pytest.mark.parametrize(('wrong', 'code', 'text'), [
    ({'goal_point': Point(x=0.0, y=1.5)}, PlanReport.UNREACHABLE, 'goal_point: '),
    ({'start_point': Point(x=-1.1, y=0.0)}, PlanReport.UNREACHABLE, 'start_point: '),
    ({'goal_point': Point(x=1.0, y=0.0)}, PlanReport.SINGULAR, 'goal_point: '),
    ({'start_point': Point()}, PlanReport.SINGULAR, 'start_point: '),
    ({'payload_mass': 200.0}, PlanReport.INFEASIBLE,
     'impossible for every motion: the motors give at most 14 W: moving 200 kg by 0.5 m takes'),
], ids=str)
def test_what_the_arm_cannot_do_has_its_own_code(rigid: Planner, wrong: dict[str, Any], code: int,
                                                 text: str) -> None:
    report = rigid.report(**wrong)
    assert report.error_code == code
    assert report.error_msg.startswith(text)
    assert report.cost == math.inf
    assert not report.peak_torques


# Load


def test_planning_ends_at_its_time_limit(flexible: Planner) -> None:
    report = flexible.report(**LONG, allowed_planning_time=0.5)
    assert report.error_code == PlanReport.TIMEOUT
    assert 'time limit' in report.error_msg


def test_every_request_is_answered_when_the_queue_is_full(flexible: Planner) -> None:
    futures = [flexible.send_plan(**LONG, allowed_planning_time=0.8) for _ in range(6)]
    flexible.wait('all answers', lambda: all(future.done() for future in futures))
    reports = [future.result().report for future in futures]
    codes = [report.error_code for report in reports]
    assert set(codes) == {PlanReport.TIMEOUT, PlanReport.BUSY}
    assert codes.count(PlanReport.TIMEOUT) <= 2  # one at work, one waiting
    refused = reports[codes.index(PlanReport.BUSY)]
    assert 'queue_length' in refused.error_msg
    assert refused.cost == math.inf


def test_requests_are_answered_in_order(rigid: Planner) -> None:
    payloads = [0.1 * k for k in range(8)]
    futures = [rigid.send_plan(payload_mass=payload) for payload in payloads]
    rigid.wait('all answers', lambda: all(future.done() for future in futures))
    answers = [future.result() for future in futures]
    assert [answer.trajectory.payload_mass for answer in answers] == payloads
    assert all(answer.report.error_code == PlanReport.NONE for answer in answers)


def test_planning_time_counts_from_the_arrival(flexible: Planner) -> None:
    futures = [flexible.send_plan(**LONG, allowed_planning_time=0.6)]
    flexible.spin(0.2)  # the first is at work, so that the second waits for it
    futures.append(flexible.send_plan(duration=-1.0))
    flexible.wait('all answers', lambda: all(future.done() for future in futures))
    waiting = futures[1].result().report
    assert waiting.error_code == PlanReport.OUT_OF_RANGE
    assert waiting.planning_time.sec + waiting.planning_time.nanosec * 1e-9 > 0.3


def test_client_that_dies_leaves_the_node_serving(flexible: Planner) -> None:
    with subprocess.Popen([sys.executable, '-c', DOOMED_CLIENT], stdout=subprocess.PIPE,
                          cwd=SUPPORT) as client:
        try:
            assert client.stdout is not None
            assert client.stdout.readline() == b'sent\n'
        finally:
            client.kill()
    assert client.returncode == -signal.SIGKILL
    assert flexible.report().cost == pytest.approx(COST, abs=1e-4)


# The maximum payload


MOST = 5.855  # [kg], of the rigid arm in the paper's motion, to 2e-3


def test_maximum_payload_is_found_and_its_motion_published(rigid: Planner) -> None:
    heard = rigid.listen(JointTrajectory, '/rigid_planner/joint_trajectory')
    bending = rigid.listen(FlexibleTrajectory, '/rigid_planner/flexible_trajectory')
    answer = rigid.search(publish=True)
    assert (answer.report.error_code, answer.report.error_msg) == (PlanReport.NONE, '')
    assert answer.payload == pytest.approx(MOST, abs=2e-3)
    assert answer.payload < answer.payload_upper <= answer.payload + 1e-3
    assert (answer.limiting_joint, answer.held) == (0, False)
    assert list(answer.front_payloads) == sorted(answer.front_payloads) != []
    assert answer.trajectory.payload_mass == answer.payload
    assert trajectory_violations(answer.trajectory.joint_trajectory, JOINTS) == []
    rigid.wait('trajectories', lambda: answer.trajectory in bending and
               answer.trajectory.joint_trajectory in heard)


def test_maximum_payload_is_found_step_by_step(rigid: Planner) -> None:
    answer = rigid.search(method=PayloadSearch.INCREMENTAL, payload_mass=4.0,
                          payload_accuracy=1.0)
    assert (answer.payload, answer.payload_upper) == (5.0, 6.0)
    assert list(answer.tried_payloads) == [5.0, 6.0]
    assert answer.tried_solved == [True, False]
    assert answer.tried_errors[0] < 1e-8


@pytest.mark.parametrize(('wrong', 'code', 'text'), [
    ({'payload_mass': 7.0, 'allowed_planning_time': 120.0}, PlanReport.NOT_FOUND,
     'no motion found: no motion with 7 kg in 1 s was found'),
    ({'method': 2}, PlanReport.OUT_OF_RANGE, 'method is 2, but must be'),
    ({'payload_accuracy': math.nan}, PlanReport.NOT_FINITE, 'payload_accuracy is nan, but must'),
    ({'payload_accuracy': 2e3}, PlanReport.OUT_OF_RANGE, 'payload_accuracy is 2000.0, but must'),
    ({'payload_step': -1.0}, PlanReport.OUT_OF_RANGE, 'payload_step is -1.0, but must be'),
    ({'duration': math.nan}, PlanReport.NOT_FINITE, 'duration is nan, but must be'),
    ({'goal_point': Point(x=2.0)}, PlanReport.UNREACHABLE, 'goal_point: '),
    ({'allowed_planning_time': 1e-6}, PlanReport.TIMEOUT, 'time limit reached'),
], ids=str)
def test_search_that_fails_says_why_and_publishes_nothing(rigid: Planner, wrong: dict[str, Any],
                                                          code: int, text: str) -> None:
    before = rigid.plan(publish=True).trajectory
    answer = rigid.search(publish=True, **wrong)
    assert answer.report.error_code == code
    assert answer.report.error_msg.startswith(text)
    assert (answer.payload, answer.limiting_joint, answer.held) == (0.0, -1, False)
    assert answer.payload_upper == answer.report.cost == math.inf
    assert answer.trajectory == FlexibleTrajectory()
    assert rigid.latched(FlexibleTrajectory, '/rigid_planner/flexible_trajectory') == before


def test_searches_and_plans_wait_in_one_queue(flexible: Planner) -> None:
    futures = [flexible.send_plan(**LONG, allowed_planning_time=0.8)]
    futures += [flexible.send_search(**LONG, allowed_planning_time=0.8) for _ in range(5)]
    flexible.wait('all answers', lambda: all(future.done() for future in futures))
    answers = [future.result() for future in futures]
    codes = [answer.report.error_code for answer in answers]
    assert codes.count(PlanReport.BUSY) >= 4  # one at work, one waiting
    assert set(codes) == {PlanReport.TIMEOUT, PlanReport.BUSY}
    refused = answers[max(k for k, code in enumerate(codes) if code == PlanReport.BUSY)]
    assert 'queue_length' in refused.report.error_msg
    assert (refused.payload, refused.payload_upper, refused.limiting_joint) == (0.0, math.inf, -1)


# Parameters


def test_every_parameter_is_described(rigid: Planner) -> None:
    name = rigid.name
    listed = rigid.call(ListParameters, f'{name}/list_parameters', ListParameters.Request())
    names = [n for n in listed.result.names
             if n != 'use_sim_time' and not n.startswith(('qos_overrides', 'start_type'))]
    request = DescribeParameters.Request(names=names)
    answer = rigid.call(DescribeParameters, f'{name}/describe_parameters', request)
    assert {'arm', 'tolerance', 'sampling_step', 'queue_length', 'record'} <= set(names)
    assert all(descriptor.description.endswith('.') for descriptor in answer.descriptors)


def test_node_takes_the_parameter_file_and_what_is_given_beside_it(flexible: Planner,
                                                                   rigid: Planner) -> None:
    assert flexible.parameter('effort_weights') == [1 / 8, 1 / 8]
    assert rigid.parameter('effort_weights') == [1.0, 1.0]
    assert flexible.parameter('queue_length') == 1


def test_parameter_that_is_set_counts(rigid: Planner) -> None:
    before = rigid.plan().trajectory
    assert rigid.set_parameter('sampling_step', 0.1).successful
    after = rigid.plan().trajectory
    assert rigid.parameter('sampling_step') == 0.1
    assert rigid.set_parameter('sampling_step', 0.01).successful
    assert len(after.points) < len(before.points) / 2
    assert rigid.plan().trajectory == before


def test_gains_are_published_with_a_plan_where_they_are_asked_for(rigid: Planner) -> None:
    assert rigid.set_parameter('feedback_gains', True).successful
    gains = rigid.listen(FeedbackGains, f'{rigid.name}/feedback_gains')
    assert rigid.report(publish=True).error_code == PlanReport.NONE
    rigid.wait('gains', lambda: bool(gains))
    assert gains[-1].message == 'stable on 3 arms at 1000 Hz'
    assert len(gains[-1].p) == len(gains[-1].joint_names) == 2
    assert rigid.set_parameter('feedback_gains', False).successful


@pytest.mark.parametrize(('name', 'value', 'reason'), [
    ('tolerance', 2.0, 'tolerance'),
    ('tolerance', math.nan, 'tolerance'),
    ('tolerance', 2, 'tolerance'), ('tolerance', 'small', 'DOUBLE'),
    ('intervals', 3, 'intervals'),
    ('elbow', 0, 'elbow is 0, but must be +1 or -1'),
    ('payload_accuracy', 0.0, 'payload_accuracy'),
    ('payload_step', 0.0, 'payload_step'),
    ('effort_weights', [1.0], 'effort_weights'),
    ('effort_weights', [1.0, math.nan], 'effort_weights[1]'),
    ('controller_rate', 1.0, 'controller_rate'),
    ('controller_stiffness', [1.0], 'controller_stiffness has 1 number'),
    ('controller_damping', [1.0, -1.0], 'controller_damping[1] is -1.0'),
    ('controller_period', -0.5, 'controller_period is -0.5, but must be -1, or from 0 to 0.1 s'),
    ('effort_hold', 'front', "effort_hold is 'front', but must be one of end, start, middle"),
    ('joint_names', ['a', 'b'], 'read-only'),
    ('arm', 'korayem_ei5', 'read-only'),
    ('recording_folder', '/', 'read-only'),
    ('queue_length', 3, 'read-only'),
])
def test_bad_parameter_is_refused_with_a_reason(rigid: Planner, name: str, value: Any,
                                                reason: str) -> None:
    before = rigid.parameter(name)
    result = rigid.set_parameter(name, value)
    assert not result.successful
    assert reason in result.reason
    assert rigid.parameter(name) == before


def test_parameters_answer_while_a_plan_is_being_made(flexible: Planner) -> None:
    flexible.parameter('tolerance')  # the client is connected from here on
    plan = flexible.send_plan(**LONG, allowed_planning_time=1.0)
    flexible.spin(0.1)
    assert flexible.parameter('tolerance') == 1e-3
    assert not plan.done()
    flexible.wait('plan', plan.done)


def test_request_keeps_the_parameters_of_its_arrival(flexible: Planner) -> None:
    assert flexible.set_parameter('allowed_planning_time', 0.7).successful
    plan = flexible.send_plan(**LONG)
    flexible.spin(0.2)
    assert flexible.set_parameter('allowed_planning_time', 30.0).successful
    assert not plan.done()
    flexible.wait('plan', plan.done)
    report = plan.result().report
    assert report.error_code == PlanReport.TIMEOUT
    assert report.planning_time.sec < 30  # the limit of now


# Start and end


def test_log_tells_what_was_planned_and_what_failed(rigid: Planner) -> None:
    rigid.plan()
    rigid.plan(duration=-1.0)
    rigid.search()
    log = rigid.log()
    assert 'ready to plan for Korayem 2009 two-link arm, rigid' in log
    assert 'planned in' in log
    assert 'error 103: duration is -1.0' in log
    assert 'maximum payload 5.85' in log


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_node_can_be_ended_while_it_starts(tmp_path: Path, number: signal.Signals) -> None:
    with Planner(tmp_path, 'korayem_ei50', 'newborn') as planner:
        planner.wait('start', lambda: 'preparing the dynamics' in planner.log(), STARTING)
        assert planner.stop(number) == 0
        assert 'Traceback' not in planner.log()


def test_node_with_a_bad_parameter_says_so_and_ends(tmp_path: Path) -> None:
    of_another = tmp_path / 'arm.yaml'
    shutil.copy(find_arm_file('korayem_rigid'), of_another)
    (tmp_path / 'arm_identification.yaml').write_text('parameters: []')
    wrong: list[tuple[dict[str, object], str]] = [
        ({'arm': 'no_such_arm'}, "arm 'no_such_arm' is neither a file nor one of the presets"),
        ({'arm': 'korayem_rigid', 'joint_names': []}, 'joint_names'),
        ({'arm': 'korayem_rigid', 'joint_names': ['a', 'b', 'c'],
          'effort_weights': [1.0, 1.0, 1.0], 'controller_stiffness': [1.0, 1.0, 1.0],
          'controller_damping': [1.0, 1.0, 1.0]}, 'joint_names'),
        ({'arm': 'korayem_rigid', 'tolerance': 5.0}, 'tolerance'),
        ({'arm': str(of_another)}, 'arm_identification.yaml is not what flex-planner identify')]
    with ExitStack() as stack:  # all start at once, which takes hardly longer than one
        nodes = [stack.enter_context(NodeProcess(
            'flex_planner.ros.planner.node', parameters, log=tmp_path / f'{k}.log'))
            for k, (parameters, _) in enumerate(wrong)]
        codes = [node.process.wait(STARTING) for node in nodes]
    logs = [(tmp_path / f'{k}.log').read_text() for k in range(len(wrong))]
    assert codes == [1] * len(wrong)
    for log, (_, reason) in zip(logs, wrong, strict=True):
        assert reason in log
        assert 'Traceback' not in log
