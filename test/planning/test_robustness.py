"""What is left of a published motion on arms that are not quite the one of the plan."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.control.controlled_motion import locked_bending
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.task import Task
from flex_planner.planning.execution import RobustnessReport
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robust.differing_arms import with_more_modes
from flex_planner.planning.robustness import assess_robustness, robustness_warnings
from flex_planner.planning.sampling import (
    judge_execution,
    sample_plan,
    SampledPlan,
    SamplingSettings,
)
from flex_planner.planning.warnings import WarningKind
from flex_planner.simulation.joint_control import Encoder
from flex_planner.simulation.plant import Control, Plant
import numpy as np
import pytest


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei5')


@pytest.fixture(scope='module')
def sampled(plan: Plan) -> SampledPlan:
    return sample_plan(plan, SamplingSettings())


@pytest.fixture(scope='module')
def robustness(plan: Plan, sampled: SampledPlan) -> RobustnessReport:
    return assess_robustness(plan, sampled)


def simulated_vibration(plan: Plan, sampled: SampledPlan, arm: Arm, payload: float) -> float:
    """Return the residual vibration of the simulated arm, which steps in Python."""
    controller = sampled.execution.controller
    plant = Plant(ArmDynamics.of(arm), Control(gains=controller.gains, encoder=Encoder()),
                  payload_mass=payload, positions=plan.task.start_positions)
    plant.follow(sampled.reference)
    plant.advance(plan.task.duration)
    return locked_bending(plant.model, plant.state, plant.parameters)


def scaled(arm: Arm, factor: float) -> Arm:
    return replace(arm, links=tuple(
        replace(link, flexural_rigidity=link.flexural_rigidity * factor) for link in arm.links))


def test_figures_are_those_of_the_simulated_arm(plan: Plan, sampled: SampledPlan,
                                                robustness: RobustnessReport) -> None:
    arm = plan.arm
    soft, stiff = (simulated_vibration(plan, sampled, scaled(arm, factor), 1.0)
                   for factor in (0.9, 1.1))
    light, heavy = (simulated_vibration(plan, sampled, arm, mass) for mass in (0.9, 1.1))
    more = simulated_vibration(plan, sampled, with_more_modes(arm), 1.0)
    assert robustness.nominal == sampled.execution.residual_vibration
    assert robustness.stiffness_differs == pytest.approx(max(soft, stiff), rel=1e-4)
    assert robustness.payload_differs == pytest.approx(max(light, heavy), rel=1e-4)
    assert robustness.more_modes == pytest.approx(more, rel=1e-3)
    assert light != pytest.approx(heavy, rel=0.01)


def test_vibration_far_above_the_nominal_one_is_warned_of(plan: Plan, sampled: SampledPlan,
                                                          robustness: RobustnessReport) -> None:
    more = replace(robustness, payload_differs=2e-4)
    warnings = robustness_warnings(sampled.execution, more, plan.arm.reach)
    assert [warning.kind for warning in warnings] == [WarningKind.SENSITIVE_TO_STIFFNESS,
                                                      WarningKind.SENSITIVE_TO_PAYLOAD]
    assert warnings[0].sentence == ('residual vibration if stiffness differs by 10%: 1 mm, but '
                                    '0.011 mm as modelled')
    small = replace(robustness, stiffness_differs=9.9e-5, payload_differs=9.9e-5)
    assert robustness_warnings(sampled.execution, small, plan.arm.reach) == []
    near = replace(robustness, nominal=1e-3, stiffness_differs=9e-3, payload_differs=0.0)
    assert robustness_warnings(sampled.execution, near, plan.arm.reach) == []


def test_feedback_that_more_modes_make_unstable_is_told() -> None:
    arm = load_arm('clamped_motors')
    plan = plan_path(Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                                         payload_mass=1.0, effort_weights=[1 / 8, 1 / 8]))
    sampled = sample_plan(plan, SamplingSettings())
    robustness = assess_robustness(plan, sampled)
    assert robustness.more_modes > 5e-3 > 1e-4 > robustness.nominal
    assert robustness.more_modes_growth > 100
    kinds = {warning.kind: warning.sentence for warning in robustness_warnings(
        sampled.execution, robustness, arm.reach)}
    assert kinds[WarningKind.FEEDBACK_UNSTABLE].startswith(
        'with 2 more modes per link the PD of the joints is unstable (100, 100 N m/rad')
    # with gains that the arm with more modes can bear, the vibration itself is told
    gentle = JointController(gains=Gains.of(2, 12.0, 1.2))
    sampled = sample_plan(plan, SamplingSettings(controller=gentle))
    robustness = assess_robustness(plan, sampled)
    assert robustness.more_modes_growth < 0.1
    kinds = {warning.kind: warning.sentence for warning in robustness_warnings(
        sampled.execution, robustness, arm.reach)}
    assert WarningKind.FEEDBACK_UNSTABLE not in kinds
    assert 'if links have 2 more modes' in kinds[WarningKind.SENSITIVE_TO_MODES]


def test_open_loop_that_magnifies_errors_is_told(plan: Plan, sampled: SampledPlan,
                                                 robustness: RobustnessReport) -> None:
    unstable = replace(sampled.execution, open_loop_amplification=345.6)
    first = robustness_warnings(unstable, robustness, plan.arm.reach)[0]
    assert first.kind is WarningKind.OPEN_LOOP_UNSTABLE
    assert 'grows to 3.5e+02 times its size' in first.sentence


def test_trajectory_that_its_controller_leads_elsewhere_is_told(plan: Plan) -> None:
    # efforts are not shifted for the period in which they are held
    slow = JointController(gains=Gains.of(2, 100.0, 10.0), rate=250.0)
    sampled = sample_plan(plan, SamplingSettings(controller=slow, controller_period=0.0))
    # the plan is solved and may be published, but not without a word
    assert judge_execution(plan, sampled).solved
    error = sampled.execution.tip_error
    assert 1e-4 * plan.arm.reach < error < 5e-3 * plan.arm.reach
    warning = robustness_warnings(sampled.execution, assess_robustness(plan, sampled),
                                  plan.arm.reach)[0]
    assert warning.kind is WarningKind.ARRIVES_ELSEWHERE
    assert warning.value == max(error, sampled.execution.residual_vibration)
    assert f'held for 4 ms leave the tip {error * 1e3:.2g} mm from its goal' in warning.sentence


def test_rigid_arm_and_empty_hand_have_no_figures_of_their_own(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid', 0.0)
    found = assess_robustness(plan, sample_plan(plan, SamplingSettings()))
    assert found.more_modes == found.stiffness_differs == found.payload_differs == 0.0


def test_links_have_at_most_eight_modes_and_rigid_ones_none(ei50_arm: Arm, rigid_arm: Arm,
                                                            workshop_arm: Arm) -> None:
    assert [link.modes for link in with_more_modes(workshop_arm).links] == [3, 4]
    assert with_more_modes(rigid_arm).n_modes == 0
    many = replace(ei50_arm, links=tuple(replace(link, modes=7) for link in ei50_arm.links))
    assert [link.modes for link in with_more_modes(many).links] == [8, 8]


def test_other_arms_start_at_their_own_rest(workshop_arm: Arm) -> None:
    task = Task(arm=workshop_arm, start_positions=np.array([-1.5, 0.1]), duration=1.0,
                goal_positions=np.array([-1.3, 0.3]), payload_mass=0.3)
    plan = plan_path(task)
    sampled = sample_plan(plan, SamplingSettings())
    found = assess_robustness(plan, sampled)
    soft = simulated_vibration(plan, sampled, scaled(workshop_arm, 0.9), 0.3)
    stiff = simulated_vibration(plan, sampled, scaled(workshop_arm, 1.1), 0.3)
    assert found.stiffness_differs == pytest.approx(max(soft, stiff), rel=1e-3)
    rest, _ = equilibrium(plan.model, task.start_positions, plan.problem.parameters)
    assert np.abs(rest[2:]).max() > 1e-4  # it sags
