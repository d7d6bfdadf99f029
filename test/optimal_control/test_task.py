"""Tasks beyond rest to rest: goals at a price, velocities at both ends, free duration, prices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.errors import InvalidSizeError, InvalidValueError, NotFiniteError
from flex_planner.base.validation import Array
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.ends_at_points import ends_at_points
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
import numpy as np
from plan_checks import costates, end_state, share_of, solution_of
import pytest

PlanFactory = Callable[..., Plan]
TaskFactory = Callable[..., Task]

inf = math.inf
JOINTS_ONLY = [inf, inf, 0, 0, 0, 0]
# price of a second and the best duration [s] of the rigid arm with 1 kg
DURATIONS = [(0.1, 2.098819038), (1.0, 1.180252679), (10.0, 0.715093315), (100.0, 0.645189138)]
GOAL_WEIGHTS = [
    # of positions, of rates: all weighted; one not, one given; joints given; positions given
    ([100, 200, 50, 10, 30, 40], [10, 20, 5, 4, 1, 3]), ([100, inf, 0, 0, 30, 40], [0, 20]),
    (JOINTS_ONLY, JOINTS_ONLY), ([inf] * 6, [0] * 6)]


def state_miss(plan: Plan) -> Array:
    """Return how far a motion ends from the goal, positions and rates."""
    miss: Array = solution_of(plan).nodes[-1, :plan.problem.goal.size] - plan.problem.goal
    return miss


# The goal at a price


@pytest.mark.parametrize(('positions', 'rates'), GOAL_WEIGHTS)
def test_costates_at_the_goal_are_its_price(
        ei5_model: ArmModel, paper_task: TaskFactory, positions: list[float],
        rates: list[float]) -> None:
    plan = plan_path(paper_task(ei5_model.arm, goal_position_weights=positions,
                                goal_velocity_weights=rates), model=ei5_model)
    weights, miss, psi = plan.problem.goal_weights, state_miss(plan), costates(plan, 1.0)
    free = np.isfinite(weights)
    assert plan.solved, plan.message
    # the conditions are linear: rounding
    np.testing.assert_allclose(psi[free], (weights[free] * miss[free]), atol=1e-13)
    np.testing.assert_allclose(miss[~free], 0, atol=1e-14)
    assert np.abs(miss[free]).max() > 1e-5


def test_goal_that_must_be_met_is_the_default(ei5_model: ArmModel,
                                              paper_task: TaskFactory) -> None:
    task = paper_task(ei5_model.arm)
    assert task.ends_at_rest
    assert (task.goal_position_weights == inf).all()
    assert (task.goal_velocity_weights == inf).all()


@pytest.mark.parametrize(('changes', 'rest'), [
    ({'goal_velocities': [0, 0]}, True), ({'goal_velocities': [0, 1e-9]}, False),
    ({'goal_position_weights': [1, inf]}, False), ({'goal_velocity_weights': [inf, 0]}, False),
    ({'goal_velocity_weights': [inf, inf]}, True)], ids=str)
def test_task_ends_at_rest_unless_it_says_otherwise(
        ei5_model: ArmModel, paper_task: TaskFactory, changes: dict[str, Any],
        rest: bool) -> None:
    assert paper_task(ei5_model.arm, **changes).ends_at_rest is rest


@pytest.mark.parametrize('name', ['rigid', 'ei5'])
def test_goal_of_growing_weight_becomes_one_that_must_be_met(
        request: pytest.FixtureRequest, paper_task: TaskFactory, plan_of: PlanFactory,
        name: str) -> None:
    model, hard = request.getfixturevalue(f'{name}_model'), plan_of(name)
    n_t, half = model.arm.n_coordinates, costates(hard, 1.0)
    gains = []
    for weight in (1e8, 1e9):
        weights = np.full(n_t, weight)
        soft = plan_path(paper_task(model.arm, goal_position_weights=weights,
                                    goal_velocity_weights=weights), model=model)
        assert soft.solved, soft.message
        gains.append(weight * (hard.cost - soft.cost))
        # first order in 1 / W: x - goal = psi / W
        np.testing.assert_allclose(weight * state_miss(soft), half, rtol=1e-3,
                                   atol=1e-3 * np.abs(half).max())
    # and J falls short by |psi|^2 / 2 W; the costs have ten digits
    assert gains[0] == pytest.approx(half @ half / 2, rel=1e-2)
    assert 0 < soft.cost < hard.cost


def test_weighted_goal_of_one_link_has_its_closed_form() -> None:
    # reaching x costs 6 R M^2 x^2 / T^3 = k x^2 / 2, missing d costs w (x - d)^2 / 2
    arm = Arm(name='one', links=(Link(length=1.0, linear_density=3.0),), joints=(Joint(),))
    d, T, w, R = 1.5, 2.0, 7.0, 0.25
    plan = plan_path(Task(arm=arm, start_positions=[0], goal_positions=[d], duration=T,
                          effort_weights=[R], goal_position_weights=[w]))
    k = 12 * R / T**3
    assert plan.uniform_samples(2).coordinates[-1, 0] == pytest.approx(w * d / (w + k), rel=1e-13)
    assert plan.cost == pytest.approx(d**2 / 2 * w * k / (w + k), rel=1e-13)


@pytest.mark.parametrize('name', ['ei50', 'ei5'])
def test_free_vibration_at_the_end_costs_less(
        request: pytest.FixtureRequest, paper_task: TaskFactory, plan_of: PlanFactory,
        name: str) -> None:
    model, hard = request.getfixturevalue(f'{name}_model'), plan_of(name)
    bent = plan_path(paper_task(model.arm, goal_position_weights=JOINTS_ONLY), model=model)
    loose = plan_path(paper_task(model.arm, goal_position_weights=JOINTS_ONLY,
                                 goal_velocity_weights=JOINTS_ONLY), model=model)
    assert loose.cost < bent.cost < hard.cost
    np.testing.assert_allclose(costates(loose, 1.0)[np.r_[2:6, 8:12]], 0, atol=1e-13)
    # the certificate measures against where the plan ends, which still swings
    assert loose.certificate.boundary_error < 1e-14
    assert np.abs(state_miss(loose)[2:6]).max() > 1e-5


def test_motion_that_costs_more_than_missing_its_goal_stays_near_the_start(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    plan = plan_path(paper_task(rigid_model.arm, 100.0, goal_position_weights=[1e-3, 1e-3],
                                goal_velocity_weights=[0, 0]), model=rigid_model)
    assert plan.solved
    change = plan.task.goal_positions - plan.task.start_positions
    assert plan.cost == pytest.approx(1e-3 * change @ change / 2, rel=1e-3)


# Velocities at the ends


@pytest.mark.parametrize('name', ['rigid', 'ei50', 'ei5'])
def test_motion_begins_and_ends_at_given_speeds(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str) -> None:
    model, n_t = request.getfixturevalue(f'{name}_model'), 6 - 4 * (name == 'rigid')
    speeds = np.array([[0.3, -0.5], [-0.2, 0.4]])
    plan = plan_path(paper_task(model.arm, start_velocities=speeds[0],
                                goal_velocities=speeds[1]), model=model)
    assert plan.solved, plan.message
    expected = np.hstack([speeds, np.zeros((2, n_t - 2))])
    np.testing.assert_allclose(plan.uniform_samples(2).rates, expected, atol=1e-15)
    # SciPy's tolerance of 1e-9, over some hundred steps
    np.testing.assert_allclose(end_state(plan), plan.problem.goal, atol=1e-8)


def test_links_may_ring_at_both_ends(ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    rates = np.array([[0.3, -0.5, 0.01, 0.02, -0.01, 0.005], [-0.2, 0.4, 0.01, -0.02, 0, 0.01]])
    plan = plan_path(paper_task(ei5_model.arm, start_velocities=rates[0],
                                goal_velocities=rates[1]), model=ei5_model)
    assert plan.solved, plan.message
    np.testing.assert_allclose(plan.uniform_samples(2).rates, rates, atol=1e-15)
    np.testing.assert_allclose(end_state(plan)[6:], rates[1], atol=1e-8)


def test_motion_under_gravity_ends_at_given_speeds(crane_model: ArmModel) -> None:
    task = Task(arm=crane_model.arm, start_positions=[-1.6, 0.2], goal_positions=[-1.2, -0.2],
                duration=0.8, payload_mass=0.2, start_velocities=[0.2, 0.1],
                goal_velocities=[0.5, -0.3])
    plan = plan_path(task, model=crane_model)
    assert plan.solved, plan.message
    np.testing.assert_allclose(end_state(plan), plan.problem.goal, atol=1e-8)


def test_motion_at_constant_speed_costs_nothing() -> None:
    arm = Arm(name='one', links=(Link(length=1.0, linear_density=3.0),), joints=(Joint(),))
    plan = plan_path(Task(arm=arm, start_positions=[0.1], goal_positions=[0.7], duration=2.0,
                          start_velocities=[0.3], goal_velocities=[0.3]))
    assert plan.solved
    assert plan.cost < 1e-28


# Free duration


def one_link(stall_torque: float = inf) -> Arm:
    """Return an arm with M = 1 kg m^2."""
    link = Link(length=1.0, linear_density=3.0)
    return Arm(name='one', links=(link,), joints=(Joint(motor=Motor(stall_torque=stall_torque)),))


@pytest.mark.parametrize('guess', [0.05, 1.0, 40.0])
@pytest.mark.parametrize('rho', [1e-3, 1.0, 1e4])
def test_one_link_takes_the_time_that_balances_time_and_effort(rho: float, guess: float) -> None:
    # J = 6 R M^2 d^2 / T^3 + rho T
    d, R = 1.5, 0.25
    plan = plan_path(Task(arm=one_link(), start_positions=[0], goal_positions=[d], duration=guess,
                          effort_weights=[R], time_weight=rho))
    T = (18 * R * d**2 / rho) ** 0.25
    assert plan.solved, plan.message
    assert plan.task.duration == pytest.approx(T, rel=1e-12)
    assert plan.cost == pytest.approx(4 / 3 * rho * T, rel=1e-12)


def test_bounded_link_tends_to_its_minimum_time() -> None:
    # u_max, then down to -u_max linearly, then -u_max: H = -rho gives the slope, see below
    d, u_max, durations = 1.5, 2.0, []
    for rho in (3.0, 30.0, 300.0, 3e3):
        plan = plan_path(Task(arm=one_link(u_max), start_positions=[0], goal_positions=[d],
                              duration=3.0, time_weight=rho))
        assert plan.solved, plan.message
        # at the start theta' = 0: u_max^2 / 2 - u_max u_free = -rho; u_free falls to 0 at T / 2
        ramp = u_max / (2 * (rho / u_max + u_max / 2))  # share of T until it is below u_max
        flat = 0.5 - ramp
        T = math.sqrt(d / u_max / 2 / (flat**2 / 2 + flat * ramp + ramp**2 / 3))
        assert plan.task.duration == pytest.approx(T, rel=1e-9)
        durations.append(plan.task.duration)
    fastest = 2 * math.sqrt(d / u_max)
    assert durations == sorted(durations, reverse=True)
    assert 0 < durations[-1] - fastest < 1e-6 * fastest


@pytest.mark.parametrize(('rho', 'duration'), DURATIONS)
def test_hamiltonian_at_the_best_duration_is_the_price_of_time(
        rigid_model: ArmModel, paper_task: TaskFactory, rho: float, duration: float) -> None:
    plan = plan_path(paper_task(rigid_model.arm, time_weight=rho), model=rigid_model)
    assert plan.solved, plan.message
    assert plan.task.duration == pytest.approx(duration, rel=2e-9)  # half the last digit
    # at the end as exactly as Newton's method solves, between as the drift of H allows
    hamiltonian = plan.uniform_samples(101).hamiltonian
    assert hamiltonian[-1] == pytest.approx(-rho, rel=1e-12)
    np.testing.assert_allclose(hamiltonian, -rho, rtol=1e-7)


@pytest.mark.parametrize(('name', 'rho'), [
    ('rigid', 0.1), ('rigid', 10.0), ('ei5', 1.0), ('ei50', 10.0), ('ei5', 100.0)])
def test_durations_beside_the_best_cost_more(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str, rho: float) -> None:
    model = request.getfixturevalue(f'{name}_model')
    best = plan_path(paper_task(model.arm, time_weight=rho), model=model)
    T, h = best.task.duration, 1e-4
    assert best.solved, best.message
    assert plan_path(paper_task(model.arm, duration=T), model=model,
                     start_from=best).cost + rho * T == pytest.approx(best.cost, rel=1e-9)
    beside = [plan_path(paper_task(model.arm, duration=T * share), model=model, start_from=best)
              for share in (1 - h, 1 + h)]
    costs = np.array([plan.cost + rho * plan.task.duration for plan in beside])
    assert all(plan.solved for plan in beside)
    assert (costs > best.cost).all()
    # a smooth minimum: the slope is less than the third derivative lets it seem
    assert abs(costs[1] - costs[0]) < 0.2 * (costs.sum() - 2 * best.cost)


def test_best_duration_does_not_depend_on_the_guess(rigid_model: ArmModel,
                                                    paper_task: TaskFactory) -> None:
    plans = [plan_path(paper_task(rigid_model.arm, duration=guess, time_weight=1.0),
                       model=rigid_model) for guess in (0.7, 3.0, 100.0)]
    assert all(plan.solved for plan in plans)
    np.testing.assert_allclose([plan.task.duration for plan in plans], 1.180252679, rtol=1e-9)


@pytest.mark.parametrize(('guess', 'payload_mass'), [(0.3, 1.0), (1.0, 8.0)])
def test_guess_in_which_the_motion_is_impossible_is_only_a_guess(
        rigid_model: ArmModel, paper_task: TaskFactory, guess: float,
        payload_mass: float) -> None:
    plan = plan_path(paper_task(rigid_model.arm, payload_mass, duration=guess, time_weight=1.0),
                     model=rigid_model)
    assert plan.status is PlanStatus.SOLVED, plan.message


@pytest.mark.parametrize(('name', 'rho'), [('ei50', 100.0), ('rigid', 1e4)])
def test_high_price_of_time_leads_to_nearly_the_shortest_time(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str, rho: float) -> None:
    model = request.getfixturevalue(f'{name}_model')
    plan = plan_path(paper_task(model.arm, time_weight=rho), model=model)
    assert plan.solved, plan.message
    # 0.6421 s is the shortest of the rigid arm
    assert 0.642 < plan.task.duration < 0.646


def test_best_duration_beyond_the_longest_is_a_status(rigid_model: ArmModel,
                                                      paper_task: TaskFactory) -> None:
    plan = plan_path(paper_task(rigid_model.arm, time_weight=1e-15), model=rigid_model)
    assert not plan.solved


def test_goal_at_a_price_and_free_duration_go_together(rigid_model: ArmModel,
                                                       paper_task: TaskFactory) -> None:
    plan = plan_path(paper_task(rigid_model.arm, time_weight=1.0, goal_velocities=[0.1, 0.0],
                                goal_position_weights=[50.0, 80.0]), model=rigid_model)
    assert plan.solved, plan.message
    psi, miss = costates(plan, plan.task.duration), state_miss(plan)
    np.testing.assert_allclose(psi[:2], [50 * miss[0], 80 * miss[1]], atol=1e-13)
    assert plan.uniform_samples(2).hamiltonian[-1] == pytest.approx(-1.0, rel=1e-12)


# The price of the payload


@pytest.mark.parametrize(('name', 'price'), [('rigid', 3.234601), ('ei5', None)])
def test_derivative_of_the_cost_by_the_payload_is_the_integral_of_its_share(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str,
        price: float | None) -> None:
    model, h = request.getfixturevalue(f'{name}_model'), 4e-3
    settings = SolverSettings(error_tolerance=1e-8)
    plan = plan_path(paper_task(model.arm, 5.5), model=model, solver=Solver(settings))
    assert plan.saturation.min() > 0.2
    costs = [plan_path(paper_task(model.arm, 5.5 + k * h), model=model, solver=Solver(settings),
                       start_from=plan).cost for k in (-2, -1, 1, 2)]
    # of fourth order; costs have eleven digits
    slope = np.array([1, -8, 8, -1]) @ costs / (12 * h)
    found = share_of(plan.problem, solution_of(plan))
    assert found == pytest.approx(slope, abs=1e-6)
    if price is not None:
        assert found == pytest.approx(price, abs=5e-7)  # half the last digit


# Values out of bounds


@pytest.mark.parametrize(('changes', 'error', 'message'), [
    ({'start_velocities': [0.0]}, InvalidSizeError,
     'start_velocities has 1 number, but must be a list of 0 or 2 or 6 numbers'),
    ({'start_velocities': [0.0, 1001.0]}, InvalidValueError,
     'start_velocities[1] is 1001.0, but must be a number >= -1000 and <= 1000'),
    ({'start_modal_displacements': [0.0] * 3}, InvalidSizeError,
     'start_modal_displacements has 3 numbers, but must be a list of 0 or 4 numbers'),
    ({'start_modal_displacements': [0.0, 0.0, -101.0, 0.0]}, InvalidValueError,
     'start_modal_displacements[2] is -101.0, but must be a number >= -100 and <= 100 m'),
    ({'start_point': [0.5]}, InvalidSizeError,
     'start_point has 1 number, but must be a list of 0 or 2 numbers'),
    ({'goal_point': [0.5, math.nan]}, NotFiniteError,
     'goal_point[1] is nan, but must be a finite number >= -1e+06 and <= 1e+06 m'),
    ({'goal_velocities': [-1001.0, 0.0]}, InvalidValueError,
     'goal_velocities[0] is -1001.0, but must be a number >= -1000 and <= 1000'),
    ({'goal_velocities': [math.nan, 0.0]}, NotFiniteError,
     'goal_velocities[0] is nan, but must be a finite number >= -1000 and <= 1000'),
    ({'goal_velocities': [[0.0, 0.0]]}, InvalidSizeError,
     'goal_velocities has shape (1, 2), but must be a list of 0 or 2 or 6 numbers'),
    ({'goal_position_weights': [1.0, -1e-9]}, InvalidValueError,
     'goal_position_weights[1] is -1e-09, but must be a number >= 0 and <= 1e+18'),
    ({'goal_position_weights': [inf, -1.0]}, InvalidValueError,
     'goal_position_weights[1] is -1.0, but must be a number >= 0 and <= 1e+18'),
    ({'goal_velocity_weights': [math.nan, inf]}, NotFiniteError,
     'goal_velocity_weights[0] is nan, but must be a finite number >= 0 and <= 1e+18'),
    ({'goal_velocity_weights': [1.0, -inf]}, NotFiniteError,
     'goal_velocity_weights[1] is -inf, but must be a finite number >= 0 and <= 1e+18'),
    ({'goal_velocity_weights': [1.0, inf, 2.0]}, InvalidSizeError,
     'goal_velocity_weights has 3 numbers, but must be a list of 0 or 2 or 6 numbers'),
    ({'goal_velocity_weights': [inf] * 7}, InvalidSizeError,
     'goal_velocity_weights has 7 numbers, but must be a list of 0 or 2 or 6 numbers'),
    ({'goal_velocity_weights': 'heavy'}, InvalidValueError,
     "goal_velocity_weights is 'heavy', but must be a list of 0 or 2 or 6 numbers"),
    ({'time_weight': -1e-9}, InvalidValueError,
     'time_weight is -1e-09, but must be a number >= 0 and <= 1e+09 1/s'),
    ({'time_weight': 1.1e9}, InvalidValueError,
     'time_weight is 1100000000.0, but must be a number >= 0 and <= 1e+09 1/s'),
    ({'time_weight': inf}, NotFiniteError,
     'time_weight is inf, but must be a finite number >= 0 and <= 1e+09 1/s'),
    ({'time_weight': None}, InvalidValueError,
     'time_weight is missing, but must be a number >= 0 and <= 1e+09 1/s')], ids=str)
def test_value_out_of_bounds_is_named_with_its_bound(
        ei5_arm: Arm, paper_task: TaskFactory, changes: dict[str, Any],
        error: type[InvalidValueError], message: str) -> None:
    with pytest.raises(error) as caught:
        paper_task(ei5_arm, **changes)
    assert str(caught.value) == message


def test_values_are_padded_and_read_only(ei5_arm: Arm, paper_task: TaskFactory) -> None:
    task = paper_task(ei5_arm, start_velocities=[1, 2], goal_position_weights=[3, inf])
    assert task.start_velocities.tolist() == [1, 2, 0, 0, 0, 0]
    assert task.goal_velocities.tolist() == [0] * 6
    assert task.goal_position_weights.tolist() == [3, inf, inf, inf, inf, inf]
    task = replace(task, start_modal_displacements=[0.1] * 4, goal_point=[0.5, 0.5])
    for name in ('start_velocities', 'goal_velocities', 'goal_position_weights',
                 'goal_velocity_weights', 'start_modal_displacements', 'goal_point'):
        with pytest.raises(ValueError, match='read-only'):
            getattr(task, name)[0] = 0
    assert replace(task, duration=2.0).goal_position_weights.tolist() == [3] + [inf] * 5


def test_points_are_kept_beside_the_postures_they_are_looked_for_from(ei5_arm: Arm) -> None:
    task = Task.between_points(ei5_arm, (0.5, 0.0), (0.5, 0.5), duration=1.0)
    assert (task.start_point.tolist(), task.goal_point.tolist()) == ([0.5, 0.0], [0.5, 0.5])
    start, goal = postures_from_points(ei5_arm, (0.5, 0.0), (0.5, 0.5), elbow=-1)
    assert task.start_positions.tolist() == start.tolist()
    assert task.goal_positions.tolist() == goal.tolist()


def test_goal_at_a_point_is_near_a_start_of_given_angles(rigid_arm: Arm) -> None:
    start = np.array([1.0 + 2 * np.pi, -2.0])
    ends = ends_at_points(rigid_arm, None, (0.5, 0.5), -1, start)
    assert set(ends) == {'goal_point', 'goal_positions'}
    task = Task.to_point(rigid_arm, start, (0.5, 0.5), duration=1.0)
    assert task.start_positions.tolist() == start.tolist()
    assert task.goal_positions.tolist() == ends['goal_positions'].tolist()
    assert np.abs(ends['goal_positions'] - start).max() < np.pi


def test_arm_at_rest_at_a_point_is_bent_by_gravity_alone(crane_arm: Arm) -> None:
    task = Task.between_points(crane_arm, (0.1, -0.8), (0.3, -0.75), duration=1.0)
    with pytest.raises(InvalidValueError, match='^start_modal_displacements is .* left out where'):
        replace(task, start_modal_displacements=[0.0] * 3)


@pytest.mark.parametrize(('changes', 'at_rest'), [
    ({}, True), ({'start_modal_displacements': [0.0] * 4}, False),
    ({'start_velocities': [0.0, 0.1]}, False), ({'start_velocities': [0.0, 0.0]}, True)], ids=str)
def test_task_knows_whether_the_arm_rests_at_the_start(
        ei5_arm: Arm, paper_task: TaskFactory, changes: dict[str, Any], at_rest: bool) -> None:
    assert paper_task(ei5_arm, **changes).starts_at_rest == at_rest
