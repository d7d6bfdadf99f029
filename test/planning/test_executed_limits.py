"""Limits on the way of the motion that a joint controller makes of the published points."""

from __future__ import annotations

from dataclasses import replace

from factories import TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.control.controlled_motion import ControlledMotion
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.path_constraints import JointRange, JointSpeed, PathSlacks
from flex_planner.planning.executed_limits import find_executed_slack
from flex_planner.planning.execution import RobustnessReport
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robustness import robustness_warnings
from flex_planner.planning.sampling import sample_plan, SampledPlan, SamplingSettings
from flex_planner.planning.warnings import WarningKind
from flex_planner.reports.execution import execution_rows
import numpy as np
import pytest


@pytest.fixture(scope='module')
def slow(rigid_model: ArmModel, paper_task: TaskFactory) -> Plan:
    limits = JointSpeed(joint=1, limit=0.8), JointSpeed(joint=2, limit=0.9)
    plan = plan_path(paper_task(rigid_model.arm, path_constraints=limits), model=rigid_model,
                     search='fast')
    assert plan.solved, plan.message
    return plan


def carried_out(plan: Plan, rate: float) -> SampledPlan:
    controller = JointController(gains=Gains.of(2, 100.0, 10.0), rate=rate)
    return sample_plan(plan, SamplingSettings(controller=controller))


def swing(upper: float) -> tuple[PathSlacks, ControlledMotion]:
    """Return a limit of an angle that is sin t, and that motion at updates that miss its top."""
    arm = Arm(name='bar', links=(Link(length=1.0, linear_density=3.0),), joints=(Joint(),))
    times = np.array([1.0, 1.3, 1.6, 1.9]) + np.pi / 2 - 1.45
    motion = ControlledMotion(times=times, states=np.stack([np.sin(times), np.cos(times)], 1))
    return PathSlacks(arm, (JointRange(joint=1, lower=-1.0, upper=upper),)), motion


def test_limit_that_is_passed_between_two_updates_is_seen() -> None:
    highest = float(np.sin(np.pi / 2 + 0.15))  # at the updates
    slacks, motion = swing(upper=highest)
    found = find_executed_slack(slacks, motion)
    # the cubic polynomial is exact to h^4 / 384
    assert found.margin == pytest.approx(highest - 1.0, abs=0.3**4 / 384)
    assert found.time == pytest.approx(np.pi / 2, abs=1e-9)
    assert found.name == 'upper limit of joint 1'
    assert 'beyond the limit' in str(found)


def test_slack_is_infinite_without_limits_and_unknown_of_an_arm_that_ran_away() -> None:
    slacks, motion = swing(upper=2.0)
    assert find_executed_slack(None, motion).slack == np.inf
    away = ControlledMotion(times=motion.times, states=np.full_like(motion.states, np.nan))
    assert find_executed_slack(slacks, away).slack == -np.inf
    assert not find_executed_slack(slacks, away).kept


def test_executed_slack_is_that_of_the_simulated_arm(slow: Plan) -> None:
    sampled = carried_out(slow, 1000.0)
    peak = np.abs(sampled.samples.rates[:, :2]).max(axis=0)
    # the plan is inside by a hair, the executed motion next to it
    assert 1 - (peak / [0.8, 0.9]).max() > 0
    assert abs(sampled.execution.limit_slack) < 1e-3
    assert sampled.execution.limits.name.startswith('speed of joint')
    rows = dict(execution_rows(sampled.execution))
    assert rows['  executed limits'] == str(sampled.execution.limits)


@pytest.mark.parametrize(('rate', 'warned'), [(1000.0, False), (15.0, True)])
def test_controller_that_leads_the_arm_beyond_a_limit_is_warned_of(slow: Plan, rate: float,
                                                                   warned: bool) -> None:
    execution = carried_out(slow, rate).execution
    calm = RobustnessReport(nominal=0.0, more_modes=0.0, stiffness_differs=0.0,
                            payload_differs=0.0, more_modes_growth=0.0)
    found = [one for one in robustness_warnings(execution, calm, slow.arm.reach)
             if one.kind is WarningKind.LIMIT_PASSED]
    assert (execution.limit_slack < -1e-3) is warned is bool(found)
    for one in found:
        assert one.value == execution.limit_slack and one.time == execution.limits.time
        assert 'passes a limit that the plan keeps: speed of joint' in one.sentence


def test_plan_without_limits_has_no_row_of_them(rigid_model: ArmModel, slow: Plan) -> None:
    task = replace(slow.task, path_constraints=())
    sampled = sample_plan(plan_path(task, model=rigid_model, search='fast'), SamplingSettings())
    assert sampled.execution.limit_slack == np.inf
    assert '  executed limits' not in dict(execution_rows(sampled.execution))
