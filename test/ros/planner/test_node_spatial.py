"""The planner node with an arm in space: as the library plans, with points in space."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.kinematics import link_points
from flex_planner.arms.quaternions import quaternion_of
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_kinematics import tip_frame
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SampledPlan
from flex_planner.reports.recording import check_motion, RecordedRequest
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import FlexibleTrajectory, MotionTask, PlanReport
from flex_planner_interfaces.srv import PlanPath
from geometry_msgs.msg import Point, Quaternion
import numpy as np
import pytest
from ros_support import LATCHED, Planner
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import Marker, MarkerArray

NAME = 'tudor_like'
START, GOAL = [0.0, 0.0, 0.5], (0.52, 0.53, -0.05)
MOTION: dict[str, Any] = {
    'space': MotionTask.CARTESIAN_GOAL, 'start_positions': START, 'start_point': Point(),
    'goal_point': Point(x=GOAL[0], y=GOAL[1], z=GOAL[2]), 'payload_mass': 0.1,
    'effort_weights': []}
ANGLES: dict[str, Any] = {
    **MOTION, 'space': MotionTask.JOINT, 'goal_positions': [0.8, -0.3, 0.9]}
NO_POST = 'keep_out:0.5,0.5,0.1'


@dataclass(frozen=True)
class Answer:
    """What the node has planned, and what the library plans of the same task."""

    planner: Planner
    response: PlanPath.Response
    plan: Plan
    sampled: SampledPlan
    stream: list[JointState]


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    with Planner(tmp_path_factory.mktemp('spatial'), NAME, search='fast',
                 allowed_planning_time=120.0) as planner:
        yield planner
        assert planner.process.process.poll() is None
        assert 'Traceback' not in planner.log()


@pytest.fixture(scope='module')
def answer(planner: Planner) -> Answer:
    arm = load_arm(NAME)
    task = Task.to_point(arm, START, GOAL, duration=1.0, payload_mass=0.1)
    settings = replace(PlannerSettings.for_arm(arm), search='fast')
    plan = plan_path(task, model=ArmModel.of(arm), search=SearchEffort.FAST)
    stream = planner.listen(JointState, f'{planner.name}/reference_states', 1000)
    planner.wait('who streams', lambda: bool(
        planner.node.count_publishers(f'{planner.name}/reference_states')))
    return Answer(planner, planner.plan(**MOTION, publish=True), plan,
                  sample_plan(plan, settings.sampling()), stream)


def tips(trajectory: FlexibleTrajectory) -> np.ndarray[Any, Any]:
    return np.array([(point.x, point.y, point.z) for point in trajectory.tip_path])


def test_plan_is_that_of_the_library(answer: Answer) -> None:
    report, trajectory = answer.response.report, answer.response.trajectory
    assert report.error_code == PlanReport.NONE, report.error_msg
    assert report.space == 'CARTESIAN_GOAL'
    assert report.cost == pytest.approx(answer.plan.cost, rel=1e-9)
    samples = answer.sampled.samples
    np.testing.assert_allclose(tips(trajectory), samples.tip, atol=1e-9)
    np.testing.assert_allclose([point.effort for point in trajectory.joint_trajectory.points],
                               answer.sampled.efforts, atol=1e-6)
    np.testing.assert_allclose(tips(trajectory)[-1], GOAL, atol=1e-6)
    assert trajectory.joint_trajectory.joint_names == ['joint1', 'joint2', 'joint3']
    assert trajectory.modal_names == ['link2_y1', 'link2_z1', 'link3_y1', 'link3_z1']


def test_plan_is_published(answer: Answer) -> None:
    name, trajectory = answer.planner.name, answer.response.trajectory
    latched = answer.planner.latched
    assert latched(JointTrajectory, f'{name}/joint_trajectory') == trajectory.joint_trajectory
    assert latched(FlexibleTrajectory, f'{name}/flexible_trajectory') == trajectory


def test_reference_states_lead_to_the_goal(answer: Answer) -> None:
    samples = answer.sampled.samples
    rest = samples.coordinates[-1]
    # the state before the last is as near, but for its efforts
    answer.planner.wait('the end of the stream', lambda: bool(answer.stream) and bool(
        np.allclose(answer.stream[-1].position, rest, atol=1e-6)
        and np.allclose(answer.stream[-1].effort[:3], samples.torques[-1], atol=1e-4)))
    last = answer.stream[-1]
    assert last.name == ['joint1', 'joint2', 'joint3', *answer.plan.arm.modal_names]
    assert list(last.effort[3:]) == [0.0] * 4


def test_markers_are_the_bent_links_in_space(answer: Answer) -> None:
    markers = answer.planner.latched(MarkerArray, f'{answer.planner.name}/markers').markers
    lines = [marker for marker in markers if marker.ns == 'links']
    assert {(line.type, line.header.frame_id) for line in lines} == {
        (Marker.LINE_STRIP, 'base_link')}
    last = np.array([[(point.x, point.y, point.z) for point in line.points]
                     for line in lines[-3:]])
    bent = answer.sampled.samples.coordinates[-1]
    expected = link_points(answer.plan.arm, bent, last.shape[1])
    np.testing.assert_allclose(last, expected, atol=1e-6)
    assert np.ptp(last[..., 2]) > 0.1
    (goal,) = (marker for marker in markers if marker.ns == 'goal')
    place = goal.pose.position
    np.testing.assert_allclose([place.x, place.y, place.z], GOAL, atol=1e-6)


def test_recording_is_of_the_same_arm_and_passes_its_check(answer: Answer) -> None:
    request = RecordedRequest.read(answer.response.report.recording)
    assert request.arm.name == answer.plan.arm.name
    assert request.motion is not None
    np.testing.assert_array_equal(request.motion.tip, tips(answer.response.trajectory))
    check = check_motion(request)
    assert check.passed, [str(finding) for finding in check.findings]


def test_recording_is_replayed_in_space(answer: Answer, tmp_path: Path) -> None:
    planner, again = answer.planner, '/again'
    names = [f'{planner.name}/{topic}'
             for topic in ('flexible_trajectory', 'joint_trajectory', 'reference_states')]
    found = [planner.listen(kind, again + name, qos) for kind, name, qos in zip(
        (FlexibleTrajectory, JointTrajectory, JointState), names, (LATCHED, LATCHED, 10),
        strict=True)]
    # beside the planner, whose own topics are latched
    with NodeProcess('flex_planner.ros.replay',
                     {'recording': answer.response.report.recording, 'rate': 10.0, 'delay': 4.0},
                     {name: again + name for name in names}, log=tmp_path / 'log') as replay:
        planner.wait('the end of the replay', lambda: replay.process.poll() is not None)
        planner.wait('what was recorded', lambda: all(found))
    assert replay.process.returncode == 0
    assert 'Traceback' not in (tmp_path / 'log').read_text()
    trajectory, motion, state = (messages[-1] for messages in found)
    assert trajectory == answer.response.trajectory
    assert motion == answer.response.trajectory.joint_trajectory
    assert np.ptp(tips(trajectory)[:, 2]) > 0.1
    assert state.name == ['joint1', 'joint2', 'joint3', *answer.plan.arm.modal_names]


def test_largest_payload_is_found_and_certified(planner: Planner) -> None:
    found = planner.search(**ANGLES, payload_accuracy=0.05)
    assert found.report.error_code == PlanReport.NONE, found.report.error_msg
    assert 0.1 < found.payload <= found.payload_local_upper
    assert found.trajectory.payload_mass == found.payload
    assert np.isinf(found.payload_proved_upper)


def test_region_of_the_plane_is_refused(planner: Planner) -> None:
    report = planner.report(**MOTION, path_constraints=[NO_POST])
    assert report.error_code == PlanReport.OUT_OF_RANGE
    assert ("path_constraints[0].region is 'Circle', but must be a Sphere, SpatialCapsule or "
            'HalfSpace') in report.error_msg


def test_tip_comes_to_rest_in_a_pose(planner: Planner) -> None:
    arm, angles = load_arm(NAME), np.array([0.8, -0.3, 0.9])
    assert isinstance(arm, SpatialArm)
    rest, _ = equilibrium(ArmModel.of(arm), angles, Parameters.of(arm, payload_mass=0.1))
    place, axes = tip_frame(arm, rest)
    x, y, z, w = (2 * part for part in quaternion_of(axes))  # of any length
    fields = {**MOTION, 'goal_point': Point(x=place[0], y=place[1], z=place[2]),
              'goal_orientation': [Quaternion(x=x, y=y, z=z, w=w)]}
    response = planner.plan(**fields)
    assert response.report.error_code == PlanReport.NONE, response.report.error_msg
    last = response.trajectory.joint_trajectory.points[-1].positions
    np.testing.assert_allclose(last, angles, atol=1e-8)
    check = check_motion(RecordedRequest.read(response.report.recording))
    assert check.passed, [str(finding) for finding in check.findings]
    (found,) = (one for one in check.findings if 'orientation' in one.name)
    assert found.value < 1e-8
    bad = planner.report(**{**fields, 'goal_orientation': [Quaternion(w=0.0)]})
    assert bad.error_code == PlanReport.OUT_OF_RANGE
    assert bad.error_msg.startswith('goal_orientation is [0.0, 0.0, 0.0, 0.0]')
    refused = planner.search(**{**ANGLES, **fields}, payload_accuracy=0.05)
    assert 'goal_orientation cannot be combined' in refused.report.error_msg


def test_point_that_is_too_high_is_out_of_reach(planner: Planner) -> None:
    report = planner.report(**{**MOTION, 'goal_point': Point(x=0.3, y=0.3, z=2.0)})
    assert report.error_code == PlanReport.UNREACHABLE
    assert report.error_msg.startswith('goal_point: ')
