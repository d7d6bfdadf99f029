"""Plans that forgive errors of the model."""

from __future__ import annotations

from pathlib import Path

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.optimal_control.torque_offset import OffsetProblem
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robust.differing_plans import CarriedOut, DifferingArms
from flex_planner.planning.robust.objective import Robustness, RobustSearch
from flex_planner.planning.sampling import judge_execution, sample_plan, SamplingSettings
import numpy as np
import pytest
from spatial_arms import yaw_pitch


def forgiving(plan: Plan, limit: float, controller: JointController | None = None,
              **options: object) -> Plan:
    robustness = Robustness(max_residual=limit, controller=controller)
    return plan_path(plan.task, start_from=plan, objectives=Objectives(robustness=robustness),
                     **options)  # type: ignore[arg-type]


def search_of(plan: Plan) -> RobustSearch:
    assert plan.objectives is not None and plan.objectives.robust is not None
    return plan.objectives.robust


@pytest.fixture(scope='module')
def robust_plan(clamped_plan: Plan, controller: JointController) -> Plan:
    return forgiving(clamped_plan, 1.65e-3, controller)


def test_clamped_links_bend_half_as_much_for_a_fifth_of_a_percent(clamped_plan: Plan,
                                                                  robust_plan: Plan) -> None:
    search = search_of(robust_plan)
    assert robust_plan.solved and search.met
    # found with scenarios and torques held for 2 ms: 3.17 mm, and 1.61 mm for less than 0.2 %
    assert search.plain_residual == pytest.approx(3.17e-3, rel=0.02)
    assert search.residual <= 1.65e-3 < 0.53 * search.plain_residual
    assert robust_plan.cost <= 1.002 * clamped_plan.cost


def test_robust_plan_has_the_certificate_of_every_plan(robust_plan: Plan) -> None:
    assert isinstance(robust_plan.problem, OffsetProblem)
    assert not CertificateLimits().violations(robust_plan.certificate)
    assert judge_execution(robust_plan, sample_plan(robust_plan, SamplingSettings())).solved


def test_torques_stay_within_their_bounds(clamped_task: Task, controller: JointController) -> None:
    # so little time that motors are on their limits, where responses are not linear
    task = Task(arm=clamped_task.arm, start_positions=clamped_task.start_positions,
                goal_positions=clamped_task.goal_positions, duration=0.8, payload_mass=1.0)
    plain = plan_path(task, search='fast')
    assert plain.solved and plain.saturation.max() > 0.02
    wanted = 0.7 * search_of(forgiving(plain, 1.0, controller)).plain_residual
    found = forgiving(plain, wanted, controller)
    samples = found.uniform_samples(2001)
    n_t, n = plain.arm.n_coordinates, plain.arm.n_joints
    lower, upper = TorqueLimits.of(plain.arm).bounds(samples.rates[:, :n])
    assert samples.coordinates.shape[1] == n_t
    assert (lower - 1e-9 <= samples.torques).all() and (samples.torques <= upper + 1e-9).all()
    assert found.solved


@pytest.mark.parametrize('name', ['clamped', 'ei50'])
def test_no_arm_of_the_box_is_much_worse_than_those_looked_at(
        name: str, clamped_plan: Plan, controller: JointController, plan_of: PlanFactory) -> None:
    plan = clamped_plan if name == 'clamped' else plan_of('ei50')
    used = controller if name == 'clamped' else None
    found = forgiving(plan, 1.65e-3 if name == 'clamped' else 1e-4, used)
    search = search_of(found)
    errors = np.random.default_rng(20).uniform(-0.1, 0.1, (200 if name == 'clamped' else 60, 2))
    residuals = CarriedOut(found, DifferingArms(found, search.robustness),
                           Monitor()).residuals(errors)
    # the slow vibration of ei50 makes two turns more at one corner than at another: these alone
    # are not enough there
    assert residuals.max() <= search.residual


def test_plan_that_forgives_enough_is_left_as_it_is(clamped_plan: Plan,
                                                    controller: JointController) -> None:
    found = forgiving(clamped_plan, 4e-3, controller)
    search = search_of(found)
    assert found.solved and search.met and search.weight == 0
    assert found.cost == pytest.approx(clamped_plan.cost, rel=1e-9)
    assert len(search.trials) == 1


def test_what_joints_answer_no_plan_repairs(clamped_plan: Plan,
                                            controller: JointController) -> None:
    found = forgiving(clamped_plan, 1e-5, controller)
    search = search_of(found)
    assert found.status is PlanStatus.OBJECTIVE_NOT_MET and not search.met
    assert 'must be <= 1e-05 m' in found.message and 'higher gains' in found.message
    assert search.residual < 0.6 * search.plain_residual  # the closest motion that was found
    assert found.solution is not None


def test_robust_plan_is_saved_and_loaded(robust_plan: Plan, tmp_path: Path) -> None:
    robust_plan.save(tmp_path / 'plan.flex')
    again = Plan.load(tmp_path / 'plan.flex')
    times = np.linspace(0, 1, 11)
    np.testing.assert_array_equal(again.sample(times).torques, robust_plan.sample(times).torques)
    assert search_of(again).residual == search_of(robust_plan).residual


def test_search_can_be_cancelled(clamped_plan: Plan, controller: JointController) -> None:
    asked = [0]

    def canceled() -> bool:
        asked[0] += 1
        return asked[0] > 60

    found = forgiving(clamped_plan, 1e-5, controller, monitor=Monitor(canceled=canceled))
    assert found.status is PlanStatus.CANCELED


def test_rigid_links_leave_nothing_to_forgive(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    with pytest.raises(InvalidTaskError, match='links of the arm are rigid'):
        plan_path(paper_task(rigid_arm),
                  objectives=Objectives(robustness=Robustness(max_residual=1e-3)))


def test_other_objectives_are_kept_or_said_to_be_broken(clamped_plan: Plan,
                                                        controller: JointController) -> None:
    robustness = Robustness(max_residual=2e-3, controller=controller)
    kept = plan_path(clamped_plan.task, start_from=clamped_plan, objectives=Objectives(
        max_joint_speeds=[3.0, 3.0], robustness=robustness))
    assert kept.solved and search_of(kept).met
    fastest = np.abs(clamped_plan.uniform_samples(2001).rates[:, :2]).max(axis=0)
    both = plan_path(clamped_plan.task, start_from=clamped_plan, objectives=Objectives(
        max_joint_speeds=0.97 * fastest, robustness=robustness))
    assert both.solved or 'joint speeds' in both.message


def test_unstable_controller_is_named() -> None:
    arm = load_arm('clamped_motors')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0, payload_mass=1.0)
    plan = plan_path(task, search='fast')
    found = forgiving(plan, 1e-3, JointController(gains=Gains.of(2, 4000.0, 400.0), rate=100.0))
    assert found.status is PlanStatus.OBJECTIVE_NOT_MET
    assert 'the PD of the joints' in found.message and 'is unstable' in found.message
    assert len(search_of(found).trials) == 1


@pytest.mark.thorough
def test_arm_in_space_rings_less_for_a_quarter_of_a_percent() -> None:
    task = Task(arm=yaw_pitch(), start_positions=[0, -0.2], goal_positions=[1.2, 0.3],
                duration=0.8, payload_mass=0.4)
    plan = plan_path(task, search='fast')
    found = forgiving(plan, 3e-3, JointController(gains=Gains.of(2, 200.0, 20.0)))
    search = search_of(found)
    assert found.solved and search.met
    assert search.residual <= 3e-3 < 0.85 * search.plain_residual
    assert plan.cost < found.cost <= 1.003 * plan.cost
    assert not CertificateLimits().violations(found.certificate)
