"""Plans whose torques have no jumps, since their rates have a price or a bound."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base.errors import FlexPlannerError, InvalidTaskError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_conditions import TorqueState
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robust.objective import Robustness
from flex_planner.planning.torque_jumps import find_torque_jumps
import numpy as np
import pytest
from scipy.integrate import quad

# times over which the prices let torques turn [s]
TURN = 0.02


def priced(task: Task, turn: float = TURN, **changes: Any) -> Task:
    return replace(task, torque_rate_weight=task.effort_weights * turn**2, **changes)


@pytest.fixture(scope='module')
def bar() -> Task:
    """Return a turn of a rigid bar of 1 kg m^2 by 1 rad in 2 s, and nothing in its way."""
    arm = Arm(name='bar', links=(Link(length=1.0, linear_density=3.0),), joints=(Joint(),))
    return Task(arm=arm, start_positions=[0.0], goal_positions=[1.0], duration=2.0)


@pytest.fixture(scope='module')
def gentle(ei50_model: ArmModel, paper_task: TaskFactory) -> Plan:
    return plan_path(priced(paper_task(ei50_model.arm)), model=ei50_model, search='fast')


@pytest.fixture(scope='module')
def heavy(rigid_model: ArmModel, paper_task: TaskFactory) -> Plan:
    """Return the plan of a motion that the motors' limits bend."""
    return plan_path(priced(paper_task(rigid_model.arm, 5.5)), model=rigid_model, search='fast')


def rates(plan: Plan, count: int = 401) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the rates of the torques at evenly spaced times."""
    assert plan.solution is not None and isinstance(plan.problem.conditions, TorqueState)
    return plan.problem.conditions.torque_rates(
        plan.solution(np.linspace(0, plan.task.duration, count)))


@pytest.mark.parametrize('turn', [0.003, 0.1, 1.0])
def test_bar_turns_by_a_line_and_a_hyperbolic_sine(bar: Task, turn: float) -> None:
    # R tau - S tau'' is linear in time, tau is odd about the middle and 0 at both ends
    plan = plan_path(priced(bar, turn), search='fast')
    assert plan.solved, plan.message
    half = bar.duration / 2

    def shape(x: float) -> float:
        return -x + half * np.sinh(x / turn) / np.sinh(half / turn)

    moved = quad(lambda x: -x * shape(x), -half, half, points=[-half + turn, half - turn])[0]
    x = np.linspace(-half, half, 41)
    expected = np.array([shape(each) for each in x]) / moved
    np.testing.assert_allclose(plan.sample(x + half).torques[:, 0], expected, atol=1e-5)


def test_rates_without_a_price_are_those_of_a_ramp_a_line_and_a_ramp(bar: Task) -> None:
    bound = 12.0
    plan = plan_path(replace(bar, max_torque_rate=bound), search='fast')
    assert plan.solved, plan.message
    half = bar.duration / 2

    def cost(ramp: float) -> tuple[float, float]:
        """Return how far the bar turns, and its effort, with ramps of that duration."""
        inner = half - ramp
        slope = bound * ramp / inner
        way = slope * inner**3 / 3 + bound * (half * (half**2 - inner**2) / 2
                                              - (half**3 - inner**3) / 3)
        return 2 * way, slope**2 * inner**3 / 3 + bound**2 * ramp**3 / 3

    found = np.linspace(0.01, 0.9, 100001)
    ramp = found[np.abs(np.array([cost(each)[0] for each in found]) - 1.0).argmin()]
    # the small price on rates changes this by little
    assert plan.effort / 2 == pytest.approx(cost(ramp)[1], rel=1e-3)
    assert np.abs(rates(plan)).max() <= bound * (1 + 1e-9)
    assert np.abs(rates(plan)[5]) == pytest.approx(bound)


def test_torques_start_and_end_at_what_holds_the_arm(bar: Task, gentle: Plan) -> None:
    hanging = replace(bar, arm=replace(bar.arm, gravity=[0.0, -9.81]), goal_positions=[0.5])
    plan = plan_path(priced(hanging), search='fast')
    assert plan.solved and gentle.solved, (plan.message, gentle.message)
    # 3 kg at half a metre
    held = 3 * 9.81 * 0.5 * np.cos([0.0, 0.5])
    np.testing.assert_allclose(plan.sample([0.0, 2.0]).torques[:, 0], held, rtol=1e-9)
    samples = gentle.uniform_samples(101)
    jumps = find_torque_jumps(gentle.problem, samples.times, samples.torques)
    assert [jump.share for jump in jumps if jump.place != 'on the way'] == pytest.approx([0, 0])


def test_a_price_on_rates_costs_effort(gentle: Plan, plan_of: PlanFactory) -> None:
    free = plan_of('ei50')
    assert gentle.solved and free.effort < gentle.effort < 1.1 * free.effort
    assert gentle.certificate.hamiltonian_drift < 1e-6
    # J is effort and the price of rates, by the trapezoidal rule
    times, found = np.linspace(0, 1, 4001), rates(gentle, 4001)
    price = np.trapezoid((found**2).sum(axis=1), times) * TURN**2 / 16
    assert gentle.cost == pytest.approx(gentle.effort / 16 + price, rel=1e-4)


def test_no_nearby_motion_costs_less(gentle: Plan, ei50_model: ArmModel) -> None:
    # J is stationary: a part of another motion's torque costs what its square does
    stiffer = plan_path(replace(gentle.task, payload_mass=1.01), model=ei50_model,
                        start_from=gentle)
    assert stiffer.solved and stiffer.strategy == 'warm start'
    by_payload = (stiffer.cost - gentle.cost) / 0.01
    assert gentle.solution is not None
    z = gentle.solution.stage_values().reshape(-1, gentle.problem.size)
    weights = (gentle.solution.steps[:, None] * gentle.solution.rule.weights).ravel()
    shares = gentle.problem.controls(np.zeros(len(z)), z).payload_share
    assert by_payload == pytest.approx(weights @ shares, rel=0.01)


def test_motors_limits_are_kept_and_their_price_is_that_of_more_torque(
        heavy: Plan, rigid_model: ArmModel) -> None:
    assert heavy.solved and 'interior point' in heavy.strategy, heavy.message
    samples = heavy.uniform_samples(2001)
    assert (samples.torques <= samples.upper_bounds).all()
    assert (samples.torques >= samples.lower_bounds).all()
    assert heavy.certificate.limit_slack > 0
    arm, more = heavy.arm, 0.02
    motor = arm.joints[0].motor
    stall = motor.stall_torque + more
    first = replace(arm.joints[0], motor=replace(
        motor, stall_torque=stall, no_load_speed=stall / motor.torque_slope))
    stronger = plan_path(replace(heavy.task, arm=replace(arm, joints=(first, arm.joints[1]))),
                         model=rigid_model, start_from=heavy)
    assert stronger.solved, stronger.message
    price = sum(one.price for one in heavy.constraints if one.name.endswith('joint 1'))
    assert heavy.cost - stronger.cost == pytest.approx(price * more, rel=0.05)


def test_rates_and_torques_are_bounded_at_once(heavy: Plan, rigid_model: ArmModel) -> None:
    task = replace(heavy.task, max_torque_rate=900.0)
    plan = plan_path(task, model=rigid_model, search='fast')
    assert plan.solved and heavy.cost < plan.cost < 1.1 * heavy.cost, plan.message
    assert (plan.torque_rates < 900).all() and (heavy.torque_rates > 900).all()
    assert plan.certificate.limit_slack > 0 and plan.certificate.hamiltonian_drift < 1e-5


def test_plan_comes_back_from_a_file(heavy: Plan, tmp_path: Path) -> None:
    heavy.save(tmp_path / 'heavy.plan')
    again, times = Plan.load(tmp_path / 'heavy.plan'), np.linspace(0, 1, 11)
    np.testing.assert_array_equal(again.sample(times).torques, heavy.sample(times).torques)
    assert again.problem.right(heavy.solution.nodes[-1])[0].size == 6  # type: ignore[union-attr]


def test_via_points_are_passed_at_their_times(rigid_model: ArmModel,
                                              paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm, via_points=[ViaPoint(positions=[1.2, -2.1], time=0.5)])
    plan = plan_path(priced(task), model=rigid_model, search='fast')
    assert plan.solved, plan.message
    np.testing.assert_allclose(plan.sample([0.5]).coordinates[0], [1.2, -2.1], atol=1e-8)
    before, after = plan.sample([0.5 - 1e-9, 0.5 + 1e-9]).torques
    np.testing.assert_allclose(before, after, atol=1e-5)


def test_rates_that_are_too_slow_are_said_to_be(bar: Task) -> None:
    plan = plan_path(replace(bar, max_torque_rate=0.5), search='fast')
    assert not plan.solved and 'a larger max_torque_rate' in plan.message


@pytest.mark.parametrize(('changes', 'message'), [
    ({'torque_rate_weight': 0.0}, 'torque_rate_weight.* > 0'),
    ({'torque_rate_weight': [1.0, 1.0, 1.0]}, 'torque_rate_weight'),
    ({'torque_rate_weight': 'much'}, "torque_rate_weight is 'much'"),
    ({'torque_rate_weight': 1e19}, 'torque_rate_weight.* <= 1e'),
    ({'torque_rate_weight': np.inf}, 'torque_rate_weight'),
    ({'max_torque_rate': -1.0}, 'max_torque_rate.* > 0'),
    ({'max_torque_rate': np.nan}, 'max_torque_rate'),
    ({'max_torque_rate': 1.0, 'time_weight': 1.0}, 'time_weight is 1.0, but must be 0 where '
                                                   'max_torque_rate is given without'),
])
def test_tasks_are_checked(bar: Task, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(FlexPlannerError, match=message):
        replace(bar, **changes)


def test_free_duration_is_the_best(gentle: Plan, ei50_model: ArmModel) -> None:
    plan = plan_path(replace(gentle.task, time_weight=4.0), model=ei50_model, search='fast')
    assert plan.solved and plan.task.torque_rate_weight.any(), plan.message
    assert abs(plan.task.duration - 1.0) > 0.05
    for factor in (0.99, 1.01):  # J with the price of time, of durations that are given
        other = plan_path(replace(gentle.task, duration=factor * plan.task.duration),
                          model=ei50_model, start_from=plan, search='fast')
        assert other.solved, other.message
        assert other.cost + 4.0 * other.task.duration > plan.cost


def test_free_times_of_via_points_are_the_best(rigid_model: ArmModel,
                                               paper_task: TaskFactory) -> None:
    via = ViaPoint(positions=[1.2, -2.1])
    task = priced(paper_task(rigid_model.arm, via_points=[via]))
    plan = plan_path(task, model=rigid_model, search='fast')
    assert plan.solved, plan.message
    best = float(plan.via_times[0])
    np.testing.assert_allclose(plan.sample([best]).coordinates[0], [1.2, -2.1], atol=1e-8)
    for time in (0.98 * best, 1.02 * best):
        given = replace(task, via_points=[replace(via, time=time)])
        other = plan_path(given, model=rigid_model, search='fast')
        assert other.solved and other.cost > plan.cost, other.message


def test_one_number_stands_for_all_joints(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    task = paper_task(rigid_arm, torque_rate_weight=1e-4, max_torque_rate=[np.inf, 50.0])
    np.testing.assert_array_equal(task.torque_rate_weight, [1e-4, 1e-4])
    np.testing.assert_array_equal(task.torque_rate_bounds, [np.inf, 50.0])
    bound = replace(task, torque_rate_weight=[])
    np.testing.assert_allclose(bound.torque_rate_prices, 1 / 8 * (1 / 200)**2)


def test_objectives_are_met_by_torques_without_jumps(rigid_model: ArmModel,
                                                     paper_task: TaskFactory) -> None:
    task = priced(paper_task(rigid_model.arm), max_torque_rate=[150.0, 100.0])
    plan = plan_path(task, model=rigid_model, search='fast',
                     objectives=Objectives(max_joint_speeds=[0.95, 1.1]))
    assert plan.solved and plan.objectives is not None and plan.objectives.met
    speeds = np.abs(plan.uniform_samples(2001).rates).max(axis=0)
    # without the objective 1.07 and 1.26 rad/s; the smallest weight leaves one of them tight
    assert (speeds <= [0.95, 1.1]).all() and (speeds / [0.95, 1.1]).max() > 0.99
    assert (plan.torque_rates <= np.array([150.0, 100.0]) * (1 + 1e-9)).all()
    np.testing.assert_allclose(plan.sample([0.0, 1.0]).torques, 0, atol=1e-9)


def test_forgiving_plans_refuse_a_price_on_rates(ei50_model: ArmModel,
                                                 paper_task: TaskFactory) -> None:
    with pytest.raises(InvalidTaskError, match='torque_rate_weight .* forgive .*max_residual'):
        plan_path(priced(paper_task(ei50_model.arm)), model=ei50_model,
                  objectives=Objectives(robustness=Robustness(max_residual=1e-3)))
