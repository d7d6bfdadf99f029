"""Warnings: each kind where it belongs, with its figures, and none where nothing is to be said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link, Node
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.warnings import (
    find_arm_warnings,
    find_warnings,
    PlanWarning,
    WarningKind,
)
import numpy as np
from plan_checks import problem_of
import pytest

RULE = GaussRule.of(4)


def kinds(warnings: Sequence[PlanWarning]) -> set[WarningKind]:
    return {one.kind for one in warnings}


def warning(plan: Plan, kind: WarningKind) -> PlanWarning:
    (found,) = [one for one in plan.warnings if one.kind is kind]
    return found


def through(model: ArmModel, *postures: Sequence[float]) -> tuple[PlanWarning, ...]:
    """Return the warnings of a motion along straight lines from posture to posture, unloaded."""
    points = np.array(postures)
    task = Task(arm=model.arm, start_positions=points[0], goal_positions=points[-1], duration=1.0)
    problem = problem_of(model, task)
    nodes = np.zeros((21, problem.size))
    mesh = np.linspace(0, 1, 21, dtype=np.float64)
    for joint, angles in enumerate(points.T):
        nodes[:, joint] = np.interp(mesh, np.linspace(0, 1, len(points)), angles)
    return find_warnings(problem, CollocationSolution.from_values(mesh, nodes, RULE))


# The motion of the paper


def test_only_its_jumps_are_told_of_the_motion_of_the_paper(plan_of: PlanFactory) -> None:
    plan = plan_of('ei50')
    assert kinds(plan.warnings) == {WarningKind.TORQUE_JUMPS}
    told = warning(plan, WarningKind.TORQUE_JUMPS)
    assert told.value == pytest.approx(5.555 / 8, abs=1e-3)
    assert told.time == 0
    assert '69% at the start (joint 1), 0% on the way' in told.sentence


def test_gentle_motion_has_no_warnings(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    # half of the acceleration in 1.4 times the time
    assert plan_path(paper_task(rigid_model.arm, duration=1.5), model=rigid_model).warnings == ()


def test_heavy_payload_is_braked_with_more_than_the_stall_torque(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid', 5.5)
    told = warning(plan, WarningKind.BRAKING_TORQUE)
    samples = plan.uniform_samples(4001)
    braking = np.where(samples.torques * samples.rates < 0, np.abs(samples.torques), 0)
    assert told.value == pytest.approx(braking.max() / 8, rel=1e-3)
    assert told.value > 1.2
    assert told.sentence.startswith(f'joint {braking.max(axis=0).argmax() + 1} brakes with ')
    assert kinds(plan_of('rigid').warnings).isdisjoint({WarningKind.BRAKING_TORQUE})


def test_speed_above_no_load_is_told(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    fast = paper_task(rigid_model.arm, start_velocities=[0.0, 3.7])
    told = warning(plan_path(fast, model=rigid_model), WarningKind.SPEED_ABOVE_NO_LOAD)
    assert told.sentence.startswith('joint 2 turns at ')
    assert told.value is not None
    assert told.value >= 3.7 / 3.5
    slower = plan_path(paper_task(rigid_model.arm, start_velocities=[0.0, 2.0]), model=rigid_model)
    assert kinds(slower.warnings).isdisjoint({WarningKind.SPEED_ABOVE_NO_LOAD})


# Where the arm is in its own way


def test_tip_near_the_base_is_told_with_its_distance(rigid_model: ArmModel) -> None:
    found = through(rigid_model, [0.0, -2.0], [0.5, -3.0], [1.0, -2.0])
    (told,) = [one for one in found if one.kind is WarningKind.TIP_NEAR_BASE]
    assert told.value == pytest.approx(np.linalg.norm(
        tip_position(rigid_model.arm, np.array([0.5, -3.0]))), rel=1e-9)
    assert told.time == pytest.approx(0.5)
    # 2 * 0.5 m * cos(168.5 deg / 2) is a tenth of 1 m
    for fold, near in ((168.0, False), (169.0, True)):
        found = through(rigid_model, [0.0, 0.0], [0.0, np.radians(fold)])
        assert (WarningKind.TIP_NEAR_BASE in kinds(found)) is near


@pytest.mark.parametrize(('angle', 'folded'), [(169.5, False), (170.5, True), (-175.0, True),
                                               (190.5, False), (185.0, True), (535.0, True)])
def test_links_folded_over_one_another_are_told(rigid_model: ArmModel, angle: float,
                                                folded: bool) -> None:
    found = through(rigid_model, [0.0, np.radians(angle)], [0.3, np.radians(angle)])
    assert (WarningKind.LINKS_OVERLAP in kinds(found)) is folded
    told = [one.sentence for one in found if one.kind is WarningKind.LINKS_OVERLAP]
    assert all(sentence.startswith('links 1 and 2 lie within ') for sentence in told)


def test_links_that_cross_are_told_from_the_moment_on() -> None:
    link = Link(length=0.5, linear_density=1.0)
    arm = Arm(name='three', links=(link,) * 3, joints=(Joint(),) * 3)
    # an equilateral triangle closes at 120 deg; more lets the third link cross the first
    found = through(ArmModel(arm), np.radians([0, 100, 100]), np.radians([0, 140, 140]))
    (told,) = [one for one in found if one.kind is WarningKind.LINKS_OVERLAP]
    assert told.sentence.startswith('links 1 and 3 cross at ')
    assert told.time == pytest.approx(0.5, abs=0.02)
    found = through(ArmModel(arm), np.radians([0, 100, 100]), np.radians([0, 119, 119]))
    assert WarningKind.LINKS_OVERLAP not in kinds(found)


# Arms, and plans that fail


def test_clamped_link_on_a_joint_without_inertia_is_told() -> None:
    arm = load_arm('clamped_motors')
    # a link has 0.25 kg m^2 about its joint, of which a hundredth counts as none
    for first, second, start in (
            (0.1, 0.1, None), (0.1, 0.0, 'joint 2 has hardly any'), (0.0024, 0.1, 'joint 1 has'),
            (0.0026, 0.1, None), (0.0, 0.0, 'joints 1 and 2 have hardly any')):
        nodes = (Node(inertia=first), Node(mass=1.0, inertia=second), Node())
        found = find_arm_warnings(replace(arm, nodes=nodes))
        assert [one.kind for one in found] == [] if start is None else [
            WarningKind.JOINT_WITHOUT_INERTIA]
        assert all(one.sentence.startswith(str(start)) for one in found)


@pytest.mark.parametrize('name', ['korayem_rigid', 'korayem_ei50', 'clamped_motors',
                                  'de_luca_siciliano', 'single_link', 'three_links'])
def test_presets_have_no_joints_without_inertia_that_matters(name: str) -> None:
    assert find_arm_warnings(load_arm(name)) == ()


@pytest.fixture(scope='module')
def light_model() -> ArmModel:
    link = Link(length=0.5, linear_density=6.0, flexural_rigidity=50.0, modes=1,
                mode_family='clamped_free')
    return ArmModel(Arm(name='light joints', links=(link, link),
                        joints=load_arm('korayem_ei50').joints))


def test_plan_and_failure_both_hint_at_a_joint_without_inertia(light_model: ArmModel,
                                                               paper_task: TaskFactory) -> None:
    task = paper_task(light_model.arm)
    plan = plan_path(task, model=light_model)
    assert plan.solved, plan.message
    assert WarningKind.JOINT_WITHOUT_INERTIA in kinds(plan.warnings)
    failed = plan_path(task, model=light_model, monitor=Monitor(time_limit=0.0))
    assert failed.status is PlanStatus.TIMEOUT
    assert kinds(failed.warnings) == {WarningKind.JOINT_WITHOUT_INERTIA}
    searched = find_max_payload(task, model=light_model, monitor=Monitor(time_limit=0.0))
    assert searched.plan is None
    assert kinds(searched.warnings) == {WarningKind.JOINT_WITHOUT_INERTIA}


def test_clamped_links_with_two_modes_have_too_few() -> None:
    arm = load_arm('clamped_motors')
    plan = plan_path(Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                                         payload_mass=1.0, effort_weights=[1 / 8, 1 / 8]))
    told = warning(plan, WarningKind.TOO_FEW_MODES)
    # 3.4 mm in a simulation with three modes, see test_mode_count
    assert told.value == pytest.approx(3.5e-3, abs=0.3e-3)
    assert 'would leave about 3.5 mm of vibration' in told.sentence
    assert 'a certificate allows 0.1 mm' in told.sentence


def test_warnings_of_a_largest_payload_are_those_of_its_plan(rigid_model: ArmModel,
                                                             paper_task: TaskFactory) -> None:
    found = find_max_payload(paper_task(rigid_model.arm, 4.0), model=rigid_model, accuracy=0.1)
    assert found.plan is not None
    assert found.warnings == found.plan.warnings
    assert kinds(found.warnings) >= {WarningKind.TORQUE_JUMPS, WarningKind.BRAKING_TORQUE}
