"""From messages to tasks and from plans to messages, without a middleware."""

from __future__ import annotations

from dataclasses import replace
from itertools import takewhile
import math
import re
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import (
    FlexPlannerError,
    InvalidSizeError,
    InvalidTaskError,
    InvalidValueError,
    NotFiniteError,
    RecordingError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.progress import Monitor
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.path_constraints import JointSpeed
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robustness import assess_robustness
from flex_planner.planning.sampling import sample_plan, SampledPlan, SamplingSettings
from flex_planner.planning.verdict import judge
from flex_planner.planning.warnings import WarningKind
from flex_planner.recording import definition_folder
from flex_planner.ros.messages.plans import (
    add_reference,
    duration_message,
    error_code,
    flexible_trajectory,
    joint_trajectory,
    planning_time_limit,
    report_from_plan,
    STATUS_CODES,
    task_from_message,
)
from flex_planner.ros.messages.trajectory_rules import trajectory_violations
from flex_planner.ros.planner.outcome import busy_outcome, unknown_failure
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import MotionTask, PlanReport
from geometry_msgs.msg import Point
import numpy as np
import pytest
from ros_support import task
from scipy.integrate import simpson

NAMES = ['joint1', 'joint2']
JOINT_TASK = {'space': MotionTask.JOINT, 'start_positions': [0.1, 0.2],
              'goal_positions': [0.3, 0.4]}
NUMBERS = ('cost', 'effort', 'energy', 'collocation_residual', 'boundary_error',
           'hamiltonian_drift', 'tip_error', 'residual_vibration', 'torque_interpolation_error')


@pytest.fixture(scope='module')
def settings(ei50_arm: Arm) -> PlannerSettings:
    return replace(PlannerSettings.for_arm(ei50_arm), effort_weights=[0.25, 0.5], tolerance=2e-4,
                   elbow=1, allowed_planning_time=7.0)


@pytest.fixture(scope='module')
def plan(ei50_arm: Arm, ei50_model: ArmModel, paper_task: Any) -> Plan:
    return plan_path(paper_task(ei50_arm), model=ei50_model)


@pytest.fixture(scope='module')
def reference(plan: Plan) -> SampledPlan:
    return sample_plan(plan, SamplingSettings())


# Messages to tasks


def test_empty_fields_take_the_defaults_of_the_parameters(ei50_arm: Arm,
                                                          settings: PlannerSettings) -> None:
    message = MotionTask(**JOINT_TASK, duration=2.0)
    made = task_from_message(message, ei50_arm, settings)
    assert made.effort_weights.tolist() == [0.25, 0.5]
    assert made.position_weights.tolist() == made.velocity_weights.tolist() == [0.0] * 6
    assert made.tolerance == 2e-4
    assert (made.payload_mass, made.allow_large_bending) == (0.0, False)
    assert planning_time_limit(message, settings) == 7.0


def test_fields_that_are_given_count(ei50_arm: Arm, settings: PlannerSettings) -> None:
    message = MotionTask(**JOINT_TASK, duration=2.0, payload_mass=0.7, effort_weights=[2.0, 3.0],
                         position_weights=[1.0] * 6, velocity_weights=[4.0, 5.0],
                         torque_rate_weight=[1e-4], max_torque_rate=[np.inf, 50.0],
                         tolerance=1e-5, allowed_planning_time=0.5, allow_large_bending=True)
    made = task_from_message(message, ei50_arm, settings)
    assert made.torque_rate_weight.tolist() == [1e-4, 1e-4]
    assert made.max_torque_rate.tolist() == [np.inf, 50.0]
    assert made.start_positions.tolist() == [0.1, 0.2]
    assert made.goal_positions.tolist() == [0.3, 0.4]
    assert (made.duration, made.payload_mass, made.tolerance) == (2.0, 0.7, 1e-5)
    assert made.allow_large_bending
    assert made.effort_weights.tolist() == [2.0, 3.0]
    assert made.position_weights.tolist() == [1.0] * 6
    assert made.velocity_weights.tolist() == [4.0, 5.0, 0.0, 0.0, 0.0, 0.0]
    assert planning_time_limit(message, settings) == 0.5


@pytest.mark.parametrize(('elbow', 'sign'), [(-1, -1), (1, 1), (0, 1)])
def test_points_become_joint_angles_of_the_branch(ei50_arm: Arm, settings: PlannerSettings,
                                                  elbow: int, sign: int) -> None:
    made = task_from_message(task(elbow=elbow), ei50_arm, settings)
    assert np.sign([made.start_positions[1], made.goal_positions[1]]).tolist() == [sign, sign]


@pytest.mark.parametrize(('fields', 'error', 'text'), [
    ({'space': 7}, InvalidValueError, 'space is 7, but must be 0'),
    ({'elbow': -2}, InvalidValueError, 'elbow is -2'),
    ({'tolerance': 1.01}, InvalidValueError, 'tolerance is 1.01'),
    ({'duration': math.inf}, NotFiniteError, 'duration is inf'),
    ({'effort_weights': [1.0] * 3}, InvalidSizeError, 'effort_weights'),
    ({'goal_point': Point(x=3.0)}, UnreachableError, 'goal_point: '),
    ({'goal_point': Point(x=1.0)}, SingularError, 'goal_point: ')])
def test_bad_message_raises_with_the_name_of_its_field(ei50_arm: Arm, text: str,
                                                       settings: PlannerSettings,
                                                       fields: dict[str, Any],
                                                       error: type[FlexPlannerError]) -> None:
    with pytest.raises(error, match=text) as caught:
        task_from_message(task(**fields), ei50_arm, settings)
    assert type(caught.value) is error


def test_points_determine_the_postures_of_three_links_too() -> None:
    link = Link(length=0.3, linear_density=1.0)
    arm = Arm(name='three', links=(link,) * 3, joints=(Joint(),) * 3)
    made = task_from_message(task(effort_weights=[]), arm, PlannerSettings.for_arm(arm))
    tips = tip_position(arm, np.stack([made.start_positions, made.goal_positions]))
    np.testing.assert_allclose(tips, [[0.5, 0.0], [0.5, 0.5]], atol=1e-9)  # of the search


@pytest.mark.parametrize('value', [-1.0, 3601.0, math.nan])
def test_bad_time_limit_is_refused(settings: PlannerSettings, value: float) -> None:
    with pytest.raises(InvalidValueError, match='allowed_planning_time'):
        planning_time_limit(task(allowed_planning_time=value), settings)


def test_start_in_angles_goes_with_a_goal_at_a_point(ei50_arm: Arm,
                                                     settings: PlannerSettings) -> None:
    message = task(space=MotionTask.CARTESIAN_GOAL, start_positions=[1.1, -2.0], elbow=-1,
                   start_velocities=[0.1, 0.2], start_modal_displacements=[1.0, 2.0, 3.0, 4.0])
    made = task_from_message(message, ei50_arm, settings)
    assert made.start_positions.tolist() == [1.1, -2.0]
    assert (made.start_point.size, made.goal_point.tolist()) == (0, [0.5, 0.5])
    assert made.start_velocities.tolist() == [0.1, 0.2, 0.0, 0.0, 0.0, 0.0]
    assert made.start_modal_displacements.tolist() == [1.0, 2.0, 3.0, 4.0]
    points = task_from_message(task(), ei50_arm, settings)
    assert (points.start_point.tolist(), points.goal_point.tolist()) == ([0.5, 0], [0.5, 0.5])


@pytest.mark.parametrize(('fields', 'error', 'text'), [
    ({'start_modal_displacements': [0.0] * 4}, InvalidValueError,
     'start_modal_displacements is .* left out where the start is a point'),
    ({'start_velocities': [0.0] * 3}, InvalidSizeError, 'start_velocities'),
    ({'space': MotionTask.CARTESIAN_GOAL}, InvalidSizeError, 'start_positions'),
    ({'space': MotionTask.CARTESIAN_GOAL, 'start_positions': [0.0, math.nan]}, NotFiniteError,
     r'start_positions\[1\]')])
def test_bad_start_raises_with_the_name_of_its_field(
        ei50_arm: Arm, settings: PlannerSettings, text: str, fields: dict[str, Any],
        error: type[FlexPlannerError]) -> None:
    with pytest.raises(error, match=text) as caught:
        task_from_message(task(**fields), ei50_arm, settings)
    assert type(caught.value) is error


def test_rest_of_a_published_motion_is_planned_again_as_it_was(crane_model: ArmModel) -> None:
    # Bellman's principle, under gravity, from the messages alone
    arm, settings = crane_model.arm, PlannerSettings.for_arm(crane_model.arm)
    fields: dict[str, Any] = {
        'start_point': Point(x=0.1, y=-0.8), 'goal_point': Point(x=0.3, y=-0.75), 'elbow': 1,
        'payload_mass': 0.2, 'effort_weights': []}
    first = plan_path(task_from_message(task(duration=0.6, **fields), arm, settings),
                      model=crane_model)
    sampled = sample_plan(first, SamplingSettings())
    joints = joint_trajectory(sampled, NAMES)
    bent = flexible_trajectory(first, sampled, joints, 'base_link').points
    k = len(bent) // 2
    here, bending = joints.points[k], bent[k]
    time = here.time_from_start.nanosec * 1e-9
    rest = task(duration=0.6 - time, space=MotionTask.CARTESIAN_GOAL,
                start_positions=here.positions,
                start_velocities=[*here.velocities, *bending.modal_rates],
                start_modal_displacements=bending.modal_displacements, **fields)
    again = plan_path(task_from_message(rest, arm, settings), model=crane_model)
    assert again.solved, again.message
    later = first.sample(np.linspace(time, 0.6, 20001))
    cost_to_go = simpson((later.torques**2).sum(axis=1) / 2, x=later.times)
    assert again.cost == pytest.approx(float(cost_to_go), rel=1e-6)
    published = joint_trajectory(sample_plan(again, SamplingSettings()), NAMES)
    assert published.points[0].velocities == here.velocities
    assert trajectory_violations(published, NAMES) == []


# Errors and failed plans


@pytest.mark.parametrize(('error', 'code'), [
    (InvalidSizeError('a', 1, '2'), PlanReport.INVALID_SIZE),
    (NotFiniteError('a', 1, '2'), PlanReport.NOT_FINITE),
    (InvalidValueError('a', 1, '2'), PlanReport.OUT_OF_RANGE),
    (InvalidTaskError('a'), PlanReport.INVALID_TASK),
    (UnreachableError('a'), PlanReport.UNREACHABLE),
    (SingularError('a'), PlanReport.SINGULAR),
    (RecordingError('a'), PlanReport.UNKNOWN),
    (FlexPlannerError('a'), PlanReport.UNKNOWN),
    (ZeroDivisionError('a'), PlanReport.UNKNOWN)])
def test_every_error_has_its_code(error: Exception, code: int) -> None:
    assert error_code(error) == code


def test_every_status_has_its_code() -> None:
    assert set(STATUS_CODES) == set(PlanStatus)
    assert len(set(STATUS_CODES.values())) == len(PlanStatus)


def test_report_of_a_failed_plan_is_infinite_and_says_why(rigid_arm: Arm, rigid_model: ArmModel,
                                                          paper_task: Any) -> None:
    settings = SolverSettings(stages=2, intervals=4, max_intervals=4, error_tolerance=1e-11)
    failed = plan_path(paper_task(rigid_arm), model=rigid_model,
                       solver=Solver(settings))
    report = report_from_plan(failed)
    assert report.error_code == PlanReport.NOT_FOUND
    assert report.error_msg.startswith('no motion found: cold start: an error of ')
    assert {getattr(report, name) for name in NUMBERS} == {math.inf}
    assert report.iterations == failed.iterations > 0
    assert report.mesh_intervals == 0
    assert not (report.peak_torques or report.peak_speeds or report.recording)


def test_report_of_an_impossible_motion_gives_the_proof(rigid_arm: Arm, rigid_model: ArmModel,
                                                        paper_task: Any) -> None:
    report = report_from_plan(plan_path(paper_task(rigid_arm, payload_mass=200.0),
                                        model=rigid_model))
    assert report.error_code == PlanReport.INFEASIBLE
    assert 'the motors give at most 14 W: moving 200 kg by 0.5 m takes' in report.error_msg
    assert report.error_msg.endswith('(POWER)')
    assert report.cost == math.inf


def test_warnings_are_told_by_stable_names_and_in_sentences(plan: Plan) -> None:
    report = report_from_plan(plan)
    assert report.error_code == PlanReport.NONE
    assert report.warning_kinds == ['TORQUE_JUMPS']
    assert report.warnings == [plan.warnings[0].sentence]


def test_every_kind_of_warning_is_explained_beside_its_field() -> None:
    folder = definition_folder('flex_planner_interfaces')
    lines = (folder / 'msg' / 'PlanReport.msg').read_text().splitlines()
    end = lines.index('string[] warning_kinds')
    comment = ' '.join(takewhile(lambda line: line.startswith('#'), lines[end - 1::-1]))
    assert set(re.findall('[A-Z_]{6,}', comment)) == {kind.name for kind in WarningKind}


def test_report_of_a_limit_on_the_way_has_its_code(rigid_arm: Arm, rigid_model: ArmModel,
                                                   paper_task: Any) -> None:
    joint = replace(rigid_arm.joints[0], motor=Motor(stall_torque=8.0, no_load_speed=3.5,
                                                     max_speed=0.9))
    slow = replace(rigid_arm, joints=(joint, rigid_arm.joints[1]))
    # the free motion; a plan would keep the limit
    free = plan_path(paper_task(rigid_arm), model=rigid_model)
    limited = paper_task(slow)
    plan = judge(replace(free, task=limited, problem=MotionProblem(
        rigid_model, limited, task_parameters(limited))))
    report = report_from_plan(plan)
    assert report.error_code == PlanReport.LIMIT_VIOLATED
    assert report.error_msg.startswith('solved, but the motion leaves a limit of the arm on its '
                                       'way: joint 1 turns at 1.022 rad/s at ')
    assert report.cost == plan.cost


def test_limits_of_a_request_are_kept_and_reported(rigid_arm: Arm, rigid_model: ArmModel,
                                                   paper_task: Any) -> None:
    message = task(duration=1.0, path_constraints=['joint_speed:1,0.8'])
    asked = task_from_message(message, rigid_arm, PlannerSettings())
    assert asked.path_constraints == (JointSpeed(joint=1, limit=0.8),)
    limited = paper_task(rigid_arm, path_constraints=asked.path_constraints)
    report = report_from_plan(plan_path(limited, model=rigid_model, search='fast'))
    assert report.error_code == PlanReport.NONE
    assert report.limit_names == ['speed of joint 1 forwards', 'speed of joint 1 backwards']
    assert list(report.limit_units) == ['rad/s', 'rad/s']
    assert 0 < report.limit_margins[0] < 1e-3 and 0 < report.limit_times[0] < 1
    assert -1e-6 < report.limit_slack <= report.limit_shares[1]
    assert 0 < report.barrier_gap < 1e-3
    with pytest.raises(InvalidValueError, match=r'path_constraints\[0\] is '):
        task_from_message(task(path_constraints=['wall']), rigid_arm, PlannerSettings())


@pytest.mark.parametrize(('monitor', 'code', 'word'), [
    (Monitor(time_limit=0.0), PlanReport.TIMEOUT, 'time limit'),
    (Monitor(canceled=lambda: True), PlanReport.CANCELED, 'canceled')])
def test_report_of_a_stopped_plan_has_its_own_code(rigid_arm: Arm, rigid_model: ArmModel,
                                                   paper_task: Any, monitor: Monitor, code: int,
                                                   word: str) -> None:
    report = report_from_plan(plan_path(paper_task(rigid_arm), model=rigid_model,
                                        monitor=monitor))
    assert report.error_code == code
    assert word in report.error_msg
    assert report.cost == math.inf


def test_outcomes_without_a_plan_are_not_publishable() -> None:
    for outcome, code, word in (
            (busy_outcome('3 requests wait'), PlanReport.BUSY, '3 requests wait'),
            (unknown_failure(KeyError('x')), PlanReport.UNKNOWN, "KeyError: 'x'")):
        assert not outcome.publishable
        assert outcome.report.error_code == code
        assert word in outcome.report.error_msg
        assert {getattr(outcome.report, name) for name in NUMBERS} == {math.inf}
        # infinite would mean that there were no limits to pass
        assert outcome.report.limit_slack == outcome.report.executed_limit_slack == -math.inf


# Plans to messages


def test_report_of_a_plan_repeats_its_numbers(plan: Plan, reference: SampledPlan) -> None:
    report = report_from_plan(plan)
    add_reference(report, plan, reference)
    assert (report.error_code, report.error_msg) == (PlanReport.NONE, '')
    assert (report.cost, report.effort, report.energy) == (plan.cost, plan.effort, plan.energy)
    assert report.tip_error == plan.certificate.tip_error
    assert report.residual_vibration == plan.certificate.residual_vibration
    assert (report.iterations, report.mesh_intervals) == (plan.iterations, plan.mesh_intervals)
    assert report.torque_interpolation_error == reference.torque_error
    assert list(report.peak_torques) == np.abs(reference.samples.torques).max(axis=0).tolist()
    assert all(0 < share < 1 for share in report.peak_torque_shares)


def test_report_tells_what_a_controller_makes_of_the_trajectory(plan: Plan,
                                                                reference: SampledPlan) -> None:
    report, execution = report_from_plan(plan), reference.execution
    robustness = assess_robustness(plan, reference)
    add_reference(report, plan, replace(reference, robustness=robustness))
    assert report.executed_tip_error == execution.tip_error < 1e-5
    assert report.executed_residual_vibration == execution.residual_vibration
    assert report.executed_limit_slack == execution.limit_slack == math.inf  # without limits
    assert report.open_loop_tip_error == execution.open_loop_tip_error
    assert report.open_loop_residual_vibration == execution.open_loop_residual_vibration
    assert report.open_loop_amplification == execution.open_loop_amplification
    assert report.vibration_if_more_modes == robustness.more_modes
    assert report.vibration_if_stiffness_differs == robustness.stiffness_differs
    assert report.vibration_if_payload_differs == robustness.payload_differs
    assert report.feedback_growth == execution.feedback_growth < 0
    assert report.feedback_growth_if_more_modes == robustness.more_modes_growth
    assert (report.controller_rate, report.effort_hold) == (1000.0, 'end')
    assert list(report.controller_stiffness) == [100.0, 100.0]
    assert list(report.controller_damping) == [10.0, 10.0]
    assert report.controller_period == 1e-3


def test_speed_shares_are_left_out_without_a_speed_limit(ei50_arm: Arm, paper_task: Any) -> None:
    free = replace(ei50_arm, joints=(Joint(), Joint())).rigid()
    free_plan = plan_path(paper_task(free))
    report = report_from_plan(free_plan)
    add_reference(report, free_plan, sample_plan(free_plan, SamplingSettings()))
    assert len(report.peak_speeds) == 2
    assert list(report.peak_speed_shares) == []
    assert list(report.peak_torque_shares) == [0.0, 0.0]


def test_messages_hold_the_samples(plan: Plan, reference: SampledPlan) -> None:
    joints = joint_trajectory(reference, NAMES)
    message = flexible_trajectory(plan, reference, joints, 'base')
    samples, k = reference.samples, 37
    point, bend = joints.points[k], message.points[k]
    assert point.time_from_start == bend.time_from_start
    assert [*point.positions, *bend.modal_displacements] == samples.coordinates[k].tolist()
    assert [*point.velocities, *bend.modal_rates] == samples.rates[k].tolist()
    assert point.accelerations.tolist() == samples.accelerations[k, :2].tolist()
    assert point.effort.tolist() == reference.efforts[k].tolist()
    assert bend.position_costates.tolist() == samples.position_costates[k].tolist()
    assert bend.velocity_costates.tolist() == samples.velocity_costates[k].tolist()
    assert (message.tip_path[k].x, message.tip_path[k].y) == tuple(samples.tip[k])
    assert (message.header.frame_id, message.payload_mass) == ('base', 1.0)


@pytest.mark.parametrize(('nanoseconds', 'expected'), [
    (0, (0, 0)), (1, (0, 1)), (999_999_999, (0, 999_999_999)), (10**9, (1, 0)),
    (np.int64(1_000_000_001_000), (1000, 1000)), (-1, (-1, 999_999_999)),
    ((2**31 - 1) * 10**9 + 999_999_999, (2**31 - 1, 999_999_999))])
def test_durations_are_exact(nanoseconds: int, expected: tuple[int, int]) -> None:
    message = duration_message(nanoseconds)
    assert (message.sec, message.nanosec) == expected
    assert type(message.sec) is type(message.nanosec) is int
