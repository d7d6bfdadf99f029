"""Tasks that replace a plan in motion: what they may say, and what is told of the rest."""

from __future__ import annotations

from typing import Any

from factories import PlanFactory
from flex_planner.base.errors import FlexPlannerError, InvalidTaskError
from flex_planner.planning.plan import Plan
from flex_planner.planning.replan import replan
from flex_planner.ros.messages.plans import error_code, task_from_message
from flex_planner.ros.messages.replacements import (
    check_alone,
    replacement_from_message,
    with_motion,
)
from flex_planner.ros.messages.times import time_message, time_ns
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import MotionTask, PlanReport
from geometry_msgs.msg import Point
import numpy as np
import pytest


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei50')


@pytest.fixture(scope='module')
def settings(plan: Plan) -> PlannerSettings:
    return PlannerSettings.for_arm(plan.arm)


def message(**fields: Any) -> MotionTask:
    return MotionTask(**{'replaces': 'plan', 'goal_positions': [1.2, -1.7], **fields})


def test_goal_and_time_are_taken_from_the_message(plan: Plan, settings: PlannerSettings) -> None:
    plain = replacement_from_message(message(), plan, settings)
    assert plain.goal.tolist() == [1.2, -1.7]
    assert (plain.duration, plain.keep_time, plain.torque_rate_weight, plain.stops) == (
        None, False, None, False)
    full = replacement_from_message(message(
        duration=0.8, keep_time=True, torque_rate_weight=[1e-5], on_failure=MotionTask.STOP,
        payload_mass=1.0, effort_weights=[1 / 8, 1 / 8]), plan, settings)
    assert (full.duration, full.keep_time, full.stops) == (0.8, True, True)
    assert full.torque_rate_weight is not None and full.torque_rate_weight.tolist() == [1e-5]


def test_point_is_reached_with_the_elbow_that_is_asked_for(plan: Plan,
                                                           settings: PlannerSettings) -> None:
    point = {'space': MotionTask.CARTESIAN_GOAL, 'goal_point': Point(x=0.5, y=0.5),
             'goal_positions': []}
    same = replacement_from_message(message(**point), plan, settings)
    np.testing.assert_allclose(same.goal, plan.problem.goal[:2], rtol=0, atol=1e-9)
    other = replacement_from_message(message(**point, elbow=1), plan, settings)
    assert other.goal[1] == pytest.approx(-same.goal[1])


@pytest.mark.parametrize(('fields', 'code', 'sentence'), [
    ({'start': MotionTask.CURRENT}, PlanReport.INVALID_TASK, 'start is given, but must be left'),
    ({'start_positions': [0.0, 0.0]}, PlanReport.INVALID_TASK, 'start_positions is given'),
    ({'start_modal_displacements': [0.0] * 4}, PlanReport.INVALID_TASK, 'start_modal_disp'),
    ({'path_constraints': ['joint_speed:1']}, PlanReport.INVALID_TASK, 'path_constraints is'),
    ({'max_residual': 1e-3}, PlanReport.INVALID_TASK, 'max_residual is given'),
    ({'kind': 2}, PlanReport.INVALID_TASK, 'kind is given'),
    ({'payload_mass': 1.1}, PlanReport.OUT_OF_RANGE, 'payload_mass is 1.1, but must be 0 or'),
    ({'effort_weights': [1.0, 1.0]}, PlanReport.OUT_OF_RANGE, 'must be empty or those of the'),
    ({'space': MotionTask.CARTESIAN}, PlanReport.OUT_OF_RANGE, 'space is 1, but must be 0'),
    ({'on_failure': 2}, PlanReport.OUT_OF_RANGE, 'on_failure is 2, but must be 0'),
    ({'space': 2, 'goal_point': Point(x=9.0)}, PlanReport.UNREACHABLE, 'goal_point: ')])
def test_what_the_plan_before_decides_is_refused(plan: Plan, settings: PlannerSettings,
                                                 fields: dict[str, Any], code: int,
                                                 sentence: str) -> None:
    with pytest.raises(FlexPlannerError, match=sentence) as caught:
        replacement_from_message(message(**fields), plan, settings)
    assert error_code(caught.value) == code


@pytest.mark.parametrize('fields', [{'keep_time': True}, {'on_failure': MotionTask.STOP}])
def test_what_is_for_replacing_needs_a_plan_to_replace(fields: dict[str, Any]) -> None:
    with pytest.raises(InvalidTaskError, match='must be left out where replaces does not name'):
        check_alone(MotionTask(**fields))
    check_alone(MotionTask())


def test_motion_is_the_same_as_a_task_of_its_own(plan: Plan, settings: PlannerSettings) -> None:
    found = replan(plan, 0.3, goal=plan.problem.goal[:2] + 0.05, torque_rate_weight=1e-5,
                   budget=10.0).plan.task
    whole = with_motion(message(space=2, goal_positions=[], goal_point=Point(x=0.4)), found)
    task = task_from_message(whole, plan.arm, settings)
    for name in ('start_positions', 'start_velocities', 'start_modal_displacements', 'duration',
                 'goal_positions', 'payload_mass', 'payload_inertia', 'effort_weights',
                 'torque_rate_weight', 'tolerance'):
        np.testing.assert_array_equal(getattr(task, name), getattr(found, name))
    assert whole.replaces == 'plan'


def test_times_go_there_and_back() -> None:
    for nanoseconds in (0, 1, 10**9, 1_700_000_000_123_456_789):
        assert time_ns(time_message(nanoseconds)) == nanoseconds
    assert time_ns(time_message(-5)) == 0
