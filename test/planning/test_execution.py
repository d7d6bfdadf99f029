"""The published trajectory, carried out by the arm of the plan under its joint controller."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from factories import PlanFactory
from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.dynamics.integration import simulate
from flex_planner.optimal_control.task import Task
from flex_planner.planning.execution import Execution, ExecutionCertificate, ExecutionLimits
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import (
    judge_execution,
    sample_plan,
    SampledPlan,
    SamplingSettings,
)
import numpy as np
import pytest

GAINS = Gains.of(2, 100.0, 10.0)


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei50')


def message_executed(plan: Plan, sampled: SampledPlan, gains: Gains, rate: float) -> Array:
    """
    Return the state on arrival, by SciPy, as joint_trajectory_controller acts on the message.

    At t it compares the joints with the trajectory at t, and adds the effort of t + dt.

    """
    n_t, state, reference = plan.arm.n_coordinates, plan.problem.start, sampled.reference
    for k in range(round(plan.task.duration * rate)):
        position, velocity = reference.motion(k / rate)
        torque = (gains.stiffness * (position - state[:2])
                  + gains.damping * (velocity - state[n_t:n_t + 2])
                  + reference.torque((k + 1) / rate))
        state = simulate(plan.model, plan.problem.parameters.physical, state,
                         lambda t, u=torque: u, 1 / rate, rtol=1e-10, atol=1e-12)
    return state


@pytest.mark.parametrize('gains', [GAINS, Gains.of(2, 0.0, 0.0)])
def test_certificate_is_what_an_independent_controller_finds(plan: Plan, gains: Gains) -> None:
    controller = JointController(gains=GAINS, rate=100.0)
    sampled = sample_plan(plan, SamplingSettings(controller=controller, controller_period=0.0))
    state = message_executed(plan, sampled, gains, 100.0)
    n_t = plan.arm.n_coordinates
    tips = tip_position(plan.arm, np.stack([state[:n_t], plan.problem.goal[:n_t]]))
    found = sampled.execution
    expected = found.tip_error if gains is GAINS else found.open_loop_tip_error
    # 0.4 mm with feedback and 18 mm without: efforts are half a period too early
    assert np.linalg.norm(tips[0] - tips[1]) == pytest.approx(expected, rel=1e-3)
    assert expected > 2e-4


def test_effort_in_the_middle_of_its_period_is_100_times_better(plan: Plan) -> None:
    errors = [sample_plan(plan, SamplingSettings(
        torque_tolerance=1e-4, controller_period=period)).execution.tip_error
        for period in (0.0, None)]
    # 0.0400 and 0.0002 mm
    assert errors[0] == pytest.approx(4.0e-5, rel=0.05)
    assert errors[1] < 4e-7


@pytest.mark.parametrize('hold', list(EffortHold))
def test_efforts_suit_every_way_to_hold_them(plan: Plan, hold: EffortHold) -> None:
    controller = JointController(gains=GAINS, hold=hold)
    execution = sample_plan(plan, SamplingSettings(controller=controller)).execution
    assert execution.tip_error < 1e-5
    assert execution.residual_vibration < 1e-5


def test_wrong_hold_costs_what_half_a_period_does(plan: Plan) -> None:
    sampled = sample_plan(plan, SamplingSettings())
    earlier = JointController(gains=GAINS, hold=EffortHold.START)
    execution = Execution.of(plan, earlier)
    assert execution.tip_error(execution.arrive(sampled.reference)) > 5e-5


def test_amplification_is_that_of_a_standing_arm(rigid_arm: Arm) -> None:
    # both links stand: small errors of rigid arms grow by their slowest and fastest fall
    standing = replace(rigid_arm, gravity=np.array([0.0, -9.81]), joints=tuple(
        replace(joint, motor=replace(joint.motor, stall_torque=80.0)) for joint in
        rigid_arm.joints))
    amplified = []
    for start, goal in (([1.5, 0.1], [1.6, -0.1]), ([-1.5, 0.1], [-1.6, -0.1])):
        plan = plan_path(Task(arm=standing, start_positions=start, goal_positions=goal,
                              duration=1.0))
        assert plan.solved, plan.message
        amplified.append(
            sample_plan(plan, SamplingSettings()).execution.open_loop_amplification)
    assert amplified[0] > 100
    assert amplified[1] < 10


@pytest.mark.parametrize(('changes', 'word'), [
    ({'tip_error': 6e-3}, 'executed tip error is 0.006 m, but must be <= 0.005 m'),
    ({'residual_vibration': np.inf}, 'executed residual vibration is inf m'),
    ({'tip_error': np.nan, 'feedback_growth': 69.3}, 'deviations double within 10 ms')])
def test_execution_that_breaks_a_limit_fails_the_plan(plan: Plan, changes: dict[str, Any],
                                                      word: str) -> None:
    sampled = sample_plan(plan, SamplingSettings())
    good = replace(sampled.execution, tip_error=1e-6, residual_vibration=1e-6)
    assert judge_execution(plan, replace(sampled, execution=good)) is plan
    judged = judge_execution(plan, replace(sampled, execution=replace(good, **changes)))
    assert judged.status is PlanStatus.CERTIFICATE_FAILED
    assert word in judged.message


def test_limits_are_shares_of_the_reach() -> None:
    certificate = ExecutionCertificate(
        controller=JointController(gains=GAINS), tip_error=0.02, residual_vibration=0.0)
    assert ExecutionLimits().violations(certificate, 1.0)
    assert not ExecutionLimits().violations(certificate, 5.0)
