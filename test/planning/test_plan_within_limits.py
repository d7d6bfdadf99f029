"""
Motions that limits on the way bend: against closed forms, against IPOPT, and by their duals.

The costs of the paper's arm within limits are those of IPOPT on Gauss collocation of four points,
80 intervals (60 of flexible links), with the limits at its points.

"""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path
from typing import Any

from factories import TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor, StopReason
from flex_planner.capacity import certify_reached, within_limits
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.capacity.results import PayloadMethod
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion
from flex_planner.optimal_control.path_constraints import (
    BendingMoment,
    Circle,
    HalfPlane,
    JointRange,
    JointSpeed,
    KeepOut,
    PathConstraint,
    PathSlacks,
)
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.certificate import hamiltonian_drift
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_kind, plan_path
import numpy as np
from plan_checks import solution_of
import pytest

POST = KeepOut(region=Circle(center=(0.52, 0.25), radius=0.1), name='post')
SPEEDS = (JointSpeed(joint=1, limit=0.8), JointSpeed(joint=2, limit=0.9))
# of J, that mu at its end costs, see solver.md
CLOSE = 1e-4


def within(model: ArmModel, task: Task, *constraints: PathConstraint) -> Plan:
    return plan_path(replace(task, path_constraints=constraints), model=model, search='fast')


@pytest.fixture(scope='module')
def past_post(rigid_model: ArmModel, paper_task: TaskFactory) -> Plan:
    return within(rigid_model, paper_task(rigid_model.arm), POST)


@pytest.fixture(scope='module')
def slow(rigid_model: ArmModel, paper_task: TaskFactory) -> Plan:
    return within(rigid_model, paper_task(rigid_model.arm), *SPEEDS)


def test_single_link_with_a_speed_limit_moves_by_parabolas_and_a_straight_line() -> None:
    # the acceleration falls to nothing until t_1 = 3/2 (T - D / w), J = 4/3 I^2 w^2 / t_1
    arm = Arm(name='bar', links=(Link(length=1.0, linear_density=3.0),), joints=(Joint(),))
    task = Task(arm=arm, start_positions=[0.0], goal_positions=[1.0], duration=2.0)
    plan = within(ArmModel.of(arm), task, JointSpeed(joint=1, limit=0.6))
    assert plan.solved, plan.message
    t_1 = 1.5 * (2.0 - 1.0 / 0.6)
    exact = 4 / 3 * 0.6**2 / t_1
    # the barrier costs something, and never more than the bound: this task is convex
    assert exact < plan.cost <= exact + plan.barrier_gap
    (first, last), = plan.constraints[0].active
    assert first < t_1 < 0.3 + t_1 and last > 2.0 - t_1
    # dJ/dw by the multiplier, to what the barrier leaves
    by_limit = 4 / 3 * (2 * 0.6 / t_1 - 0.6**2 / t_1**2 * 1.5 / 0.6**2)
    assert -plan.constraints[0].price == pytest.approx(by_limit, rel=0.01)


def test_costs_are_those_of_direct_collocation(past_post: Plan, slow: Plan) -> None:
    for plan, cost in ((past_post, 0.81848), (slow, 0.7009534)):
        assert plan.solved, plan.message
        # IPOPT lets a post be passed between its points, which is worth 5e-6
        assert plan.cost == pytest.approx(cost, rel=CLOSE)
        assert all(one.slack > 0 for one in plan.constraints)
        assert plan.certificate.limit_slack > -1e-6


@pytest.mark.thorough
def test_costs_of_flexible_links_are_those_of_direct_collocation(
        single_mode_model: ArmModel, paper_task: TaskFactory) -> None:
    moments = (BendingMoment(link=1, limit=0.6, stations=(0.5,)),
               BendingMoment(link=2, limit=0.45, stations=(0.5,)))
    for constraints, cost in (((POST,), 0.82031), (SPEEDS, 0.7022401), (moments, 0.65136)):
        plan = within(single_mode_model, paper_task(single_mode_model.arm), *constraints)
        assert plan.solved, plan.message
        assert plan.cost == pytest.approx(cost, rel=CLOSE)
        assert all(one.slack > 0 for one in plan.constraints)


def test_limits_that_a_motion_keeps_leave_it_as_it_is(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    free = plan_path(task, model=rigid_model, search='fast')
    far = (JointSpeed(joint=1, limit=5.0), KeepOut(region=HalfPlane(point=(-2.0, 0.0),
                                                                    normal=(1.0, 0.0))))
    plan = within(rigid_model, task, *far)
    assert plan.solved and plan.barrier_gap == 0.0
    assert plan.cost == pytest.approx(free.cost, rel=1e-12)
    assert [one.kept for one in plan.constraints] == [True] * 3


def test_obstacle_is_passed_on_the_cheaper_side_and_the_other_is_named(past_post: Plan) -> None:
    best, other = past_post.kinds
    assert best.sentence.startswith('post on its right')
    assert other.sentence.startswith('post on its left')
    # its value is of a coarse mesh
    assert other.value == pytest.approx(1.068, rel=0.01)
    assert 'post on its left' in past_post.message


def test_other_side_can_be_asked_for(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    task = replace(paper_task(rigid_model.arm), path_constraints=(POST,))
    plan = plan_kind(task, 2, model=rigid_model, search='fast')
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(1.068, rel=1e-3)


def test_products_of_multipliers_and_slacks_sum_up_to_the_gap(slow: Plan) -> None:
    problem, solution = slow.problem, solution_of(slow)
    assert isinstance(problem, ConstrainedMotion)
    z = solution.stage_values().reshape(-1, problem.size)
    weights = (solution.steps[:, None] * solution.rule.weights).ravel()
    products = problem.multipliers(z) * problem.slacks(z[:, :problem.size // 2])
    assert weights @ products.sum(axis=1) == pytest.approx(
        problem.slacks.count * problem.mu * slow.task.duration, rel=1e-9)


def test_hamiltonian_is_constant_with_the_barrier_and_not_without(slow: Plan) -> None:
    problem, solution = slow.problem, solution_of(slow)
    assert slow.certificate.hamiltonian_drift < 1e-6
    z = solution(np.linspace(0, 1, 201))
    bare = problem.model.controls(z, problem.p).hamiltonian
    assert np.ptp(bare) > 10 * np.ptp(bare + problem.barrier_rate(z))
    assert hamiltonian_drift(problem, solution) == slow.certificate.hamiltonian_drift


@pytest.mark.parametrize('case', ['speed', 'post'])
def test_value_changes_with_a_bound_by_the_integral_of_its_multiplier(
        case: str, slow: Plan, past_post: Plan) -> None:
    plan = slow if case == 'speed' else past_post
    problem, solution = plan.problem, solution_of(plan)
    assert isinstance(problem, ConstrainedMotion)
    # a large barrier, so that the value is smooth over the steps of the difference
    mu, step, solver = 1e-2, 2e-5, Solver().with_settings(error_tolerance=1e-9)

    def solve(moved: float, near: Any) -> tuple[float, float, Any]:
        """Return the value, barrier included, the integral of the multipliers, the motion."""
        relief = np.full(problem.slacks.count, moved)
        limited = ConstrainedMotion(
            problem, PathSlacks(problem.task.arm, problem.slacks.constraints, relief), mu).floored(
                near, 0.3)
        found = solver.solve(limited, near)
        assert found.converged, found.message
        z = found.solution.stage_values().reshape(-1, problem.size)
        weights = (found.solution.steps[:, None] * found.solution.rule.weights).ravel()
        total = integrate_totals(limited, found.solution).cost + weights @ limited.barrier_rate(z)
        return (float(total), float(weights @ limited.multipliers(z).sum(axis=1)),
                found.solution)

    # from the plan, whose mu is far less, first: the others are next to it
    _, price, middle = solve(0.0, solution)
    slope = (solve(step, middle)[0] - solve(-step, middle)[0]) / (2 * step)
    assert slope == pytest.approx(-price, rel=1e-6)


def test_plan_starts_from_one_that_limits_have_bent(
        rigid_model: ArmModel, past_post: Plan) -> None:
    wider = KeepOut(region=Circle(center=(0.52, 0.25), radius=0.101), name='post')
    task = replace(past_post.task, path_constraints=(wider,))
    monitor = Monitor()
    plan = plan_path(task, model=rigid_model, start_from=past_post, monitor=monitor)
    cold = plan_path(task, model=rigid_model, search='fast')
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(cold.cost, rel=1e-5)
    assert plan.cost > past_post.cost
    assert plan.iterations < cold.iterations / 2


def test_plan_within_limits_is_saved_and_loaded(past_post: Plan, tmp_path: Path) -> None:
    past_post.save(tmp_path / 'plan')
    again = Plan.load(tmp_path / 'plan')
    assert again.constraints == past_post.constraints
    assert again.task.path_constraints == (POST,)
    assert isinstance(again.problem, ConstrainedMotion)
    z = solution_of(again).nodes
    np.testing.assert_array_equal(again.problem.rate(np.zeros(len(z)), z),
                                  past_post.problem.rate(np.zeros(len(z)), z))


def test_start_inside_an_obstacle_is_impossible_and_says_by_how_much(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    x, y = plan_path(task, model=rigid_model, search='fast').sample([0.0]).tip[0]
    around = KeepOut(region=Circle(center=(float(x), float(y)), radius=0.1), name='post')
    plan = within(rigid_model, task, around)
    assert plan.status is PlanStatus.INFEASIBLE
    assert plan.message.startswith('the start breaks a limit that holds on the whole way: tip '
                                   'from post, by 0.09')


def test_too_heavy_a_payload_is_refused_with_limit_excess_and_what_can_be_carried(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    # 5.495 kg is the most at these speeds, as a cold interior point finds, too
    speeds = JointSpeed(joint=1, limit=1.05), JointSpeed(joint=2, limit=1.2)
    plan = within(rigid_model, paper_task(rigid_model.arm, 5.5), *speeds)
    assert plan.status is PlanStatus.LIMIT_VIOLATED
    assert 'which does not show that there is none' in plan.message
    assert 'about 5.495 kg is the most that was found to be carried within them' in plan.message


@pytest.mark.parametrize(('constraints', 'payload'), [((POST,), 5.607), (SPEEDS, 4.536)])
def test_largest_payload_within_limits(rigid_model: ArmModel, paper_task: TaskFactory,
                                       constraints: tuple[PathConstraint, ...],
                                       payload: float) -> None:
    task = replace(paper_task(rigid_model.arm), path_constraints=constraints)
    found = find_max_payload(task, model=rigid_model, search='fast', accuracy=5e-3)
    assert found.solved, found.message
    assert found.payload <= payload + 1e-3 <= found.local_upper + 1e-3 + 1e-3
    assert found.payload == pytest.approx(payload, abs=5e-3)
    assert found.plan is not None
    assert all(one.kept for one in found.plan.constraints)


def test_torques_that_switch_too_often_stay_as_the_barrier_has_them(
        rigid_model: ArmModel, paper_task: TaskFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certify_reached, 'plan_from_barrier', lambda *given: None)
    task = replace(paper_task(rigid_model.arm), path_constraints=SPEEDS)
    found = find_max_payload(task, model=rigid_model, search='fast', accuracy=5e-3)
    assert found.solved, found.message
    assert found.payload == pytest.approx(4.536, abs=5e-3)
    plan = found.plan
    assert plan is not None and isinstance(plan.problem, ConstrainedMotion)
    assert plan.problem.smooth
    # strictly within the motors' limits, which the barrier has besides those on the way
    samples = plan.uniform_samples(2001)
    assert (samples.torques < samples.upper_bounds).all()
    assert (samples.torques > samples.lower_bounds).all()
    assert plan.problem.terms == plan.problem.slacks.count + 4
    assert hamiltonian_drift(plan.problem, solution_of(plan)) < 1e-3


def test_payloads_are_tried_where_the_barrier_leads_to_none(
        rigid_model: ArmModel, paper_task: TaskFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(within_limits, 'reach_largest_payload', lambda *given: None)
    task = replace(paper_task(rigid_model.arm), path_constraints=(POST,))
    found = find_max_payload(task, model=rigid_model, search='fast', accuracy=0.1)
    assert found.status is PlanStatus.NOT_CONVERGED
    assert 'which does not show that there is none' in found.message
    assert 5.4 < found.payload < 5.607 + 1e-3
    assert found.plan is not None
    assert found.plan.solved
    assert all(one.kept for one in found.plan.constraints)


@pytest.mark.parametrize('status', [PlanStatus.TIMEOUT, PlanStatus.CANCELED])
def test_payloads_that_are_tried_one_after_another_are_stopped(
        rigid_model: ArmModel, paper_task: TaskFactory, monkeypatch: pytest.MonkeyPatch,
        status: PlanStatus) -> None:
    monkeypatch.setattr(within_limits, 'reach_largest_payload', lambda *given: None)
    tries, monitor = list[float](), Monitor()

    def plan_three(task: Task, *given: Any) -> Plan | None:
        """Plan with three payloads, then stop."""
        tries.append(task.payload_mass)
        if len(tries) > 3:
            stop(monitor, status)
            monitor.check()
        return plan_near(task, *given)

    plan_near = within_limits._plan_near
    monkeypatch.setattr(within_limits, '_plan_near', plan_three)
    task = replace(paper_task(rigid_model.arm), path_constraints=(POST,))
    found = find_max_payload(task, model=rigid_model, search='fast', monitor=monitor)
    assert (found.status, found.solved, len(tries)) == (status, False, 4)
    if status is PlanStatus.CANCELED:
        assert found.payload == 0
        return
    assert found.payload in tries[:3]  # the last that was certified
    assert found.plan is not None
    assert found.plan.solved
    assert found.plan.task.payload_mass == found.payload


def stop(monitor: Monitor, status: PlanStatus) -> None:
    """Let a monitor stop work."""
    if status is PlanStatus.CANCELED:
        monitor.canceled = lambda: True
    else:
        monitor.time_limit = -1.0


def test_shortest_duration_within_limits_is_not_that_without(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    task = replace(paper_task(rigid_model.arm), path_constraints=SPEEDS)
    found = find_min_duration(task, model=rigid_model, search='fast', accuracy=0.02)
    assert found.solved, found.message
    # the second joint turns by its stroke at 0.9 rad/s at least so long
    stroke = np.abs(task.goal_positions - task.start_positions)
    assert found.duration > max(stroke[0] / 0.8, stroke[1] / 0.9)
    assert found.duration == pytest.approx(0.8165, abs=0.02)
    assert found.plan is not None
    assert all(one.kept for one in found.plan.constraints)


def test_incremental_search_refuses_limits_on_the_way(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    task = replace(paper_task(rigid_model.arm), path_constraints=(POST,))
    with pytest.raises(InvalidTaskError, match='path_constraints are given'):
        find_max_payload(task, model=rigid_model, method=PayloadMethod.INCREMENTAL)


def test_duration_at_a_price_is_that_of_a_motion_within_limits(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm, time_weight=2.0), *SPEEDS)
    assert plan.solved, plan.message
    assert all(one.kept for one in plan.constraints)
    # stationary: H and the barrier are the price
    z = solution_of(plan).nodes
    total = plan.model.controls(z, plan.problem.p).hamiltonian + plan.problem.barrier_rate(z)
    assert total == pytest.approx(-2.0, rel=1e-4)


def test_cancelled_planning_says_so(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    class Cancelled(Monitor):
        def stop_reason(self) -> StopReason | None:
            return StopReason.CANCELED if 'limits' in self.phase else None

        def canceled(self) -> bool:
            return self.stop_reason() is not None

    task = replace(paper_task(rigid_model.arm), path_constraints=(POST,))
    plan = plan_path(task, model=rigid_model, monitor=Cancelled(), search='fast')
    assert plan.status is PlanStatus.CANCELED


def test_slack_at_an_end_may_be_nothing(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    # the second joint starts on a limit that the free motion does not keep
    arm, task = rigid_model.arm, paper_task(rigid_model.arm, 3.0)
    start = float(task.start_positions[1])
    free = solution_of(plan_path(task, model=rigid_model, search='fast')).nodes[:, 1]
    side: dict[str, Any] = ({'lower_limit': start} if free.min() < start - 1e-3
                            else {'upper_limit': start})
    assert not (free.min() >= start or free.max() <= start) or math.isclose(start, free.max())
    joints = arm.joints[0], replace(arm.joints[1], **side)
    plan = plan_path(replace(task, arm=replace(arm, joints=joints)), model=rigid_model,
                     search='fast')
    assert plan.solved, plan.message


@pytest.mark.thorough
def test_cheaper_kind_than_one_that_keeps_its_limits_is_bent_by_them() -> None:
    arm = Arm(
        name='two bars', gravity=[0.0, 0.0],
        links=(Link(length=0.30669, linear_density=4.98583),
               Link(length=0.59819, linear_density=6.85798)),
        joints=(Joint(motor=Motor(stall_torque=18.9344, no_load_speed=7.25857)),
                Joint(motor=Motor(stall_torque=4.95293, no_load_speed=2.57722))))
    limits = (JointRange(joint=1, lower=-5.10666),
              KeepOut(region=Circle(center=(-0.078139, -0.513281), radius=0.102789)))
    task = Task(arm=arm, start_positions=[-1.658005, 0.384908],
                goal_positions=[-4.689699, -0.882374], duration=1.982922,
                effort_weights=1 / np.array([18.9344, 4.95293])**2, path_constraints=limits)
    plan = plan_path(task)
    # another kind of motion keeps both limits, for 0.2056; IPOPT's, on meshes of an own, is 0.1607
    assert plan.solved and plan.certificate.limit_slack > 0
    assert plan.cost == pytest.approx(0.1607, rel=1e-3)
