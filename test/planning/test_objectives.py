"""Objectives met by weights, condition (II) of the paper's fig. 1, and named kinds of cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidSizeError, InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor, Progress
from flex_planner.base.validation import Array
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.objectives import (
    minimum_effort,
    minimum_effort_speed,
    minimum_time,
    minimum_vibration,
    Objective,
    Objectives,
    ObjectiveSearch,
)
from flex_planner.planning.plan import Peaks, peaks, Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
import numpy as np
from plan_checks import solution_of, stopped_in
import pytest
from scipy.integrate import simpson

PlanFactory = Callable[..., Plan]
TaskFactory = Callable[..., Task]

inf, nan = math.inf, math.nan
# section 5.2: largest speed of the rigid arm with 1 kg, by w_2
SPEEDS = {0.0: 1.203, 1.0: 0.896, 10.0: 0.745, 1400.0: 0.617}
# section 5.2's bound, and the smallest w_2 that keeps it, enclosed within 1e-4 of itself
BOUND, SMALLEST = 0.8, 4.2745
# of a peak, by the points between which it is: 1.2e-6 and 2.4e-4 where links ring
SEEN, RUNG = 5e-6, 5e-4
both_stops = pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])


def within(model: ArmModel, task: Task, monitor: Monitor | None = None, **limits: Any) -> Plan:
    return plan_path(task, model=model, objectives=Objectives(**limits), monitor=monitor)


def search_of(plan: Plan) -> ObjectiveSearch:
    assert plan.objectives is not None, plan.message
    return plan.objectives


def seen(plan: Plan) -> Peaks:
    return peaks(plan, plan.uniform_samples(4001))


def modal_peaks(plan: Plan) -> Array:
    rates: Array = np.abs(plan.uniform_samples(4001).rates[:, plan.arm.n_joints:]).max(axis=0)
    return rates


@pytest.fixture(scope='module')
def bounded(rigid_model: ArmModel, paper_task: TaskFactory) -> Plan:
    """Return the motion of section 5.2, with speeds of at most 0.8 rad/s."""
    return within(rigid_model, paper_task(rigid_model.arm), max_joint_speeds=[BOUND, BOUND])


# Section 5.2


@pytest.mark.parametrize(('w_2', 'speed'), SPEEDS.items())
def test_largest_speeds_of_section_5_2(plan_of: PlanFactory, w_2: float, speed: float) -> None:
    assert seen(plan_of('rigid', 1.0, w_2)).speeds.max() == pytest.approx(speed, abs=1e-3)


def test_smallest_weight_that_keeps_the_speeds_is_found(bounded: Plan) -> None:
    search, (margin,) = search_of(bounded), search_of(bounded).margins
    assert bounded.solved, bounded.message
    assert search.met
    assert margin.objective is Objective.JOINT_SPEEDS
    assert margin.relaxed_weight < SMALLEST < margin.weight
    assert margin.weight <= 1.01 * margin.relaxed_weight
    assert margin.share <= 1 < margin.relaxed_share
    assert bounded.task.velocity_weights.tolist() == [margin.weight, margin.weight]
    assert seen(bounded).speeds.max() <= BOUND
    # the paper takes the first of table II that does, w_2 = 10: more than twice as much
    assert margin.weight < 4.32


def test_weights_tried_are_recorded(bounded: Plan) -> None:
    trials, (margin,) = search_of(bounded).trials, search_of(bounded).margins
    assert all(trial.met == (trial.share <= 1) for trial in trials)
    assert {(margin.weight, True), (margin.relaxed_weight, False)} <= {
        (trial.weight, trial.met) for trial in trials}
    # more weight, less speed
    by_weight = sorted(trials, key=lambda trial: trial.weight)
    assert all(np.diff([trial.share for trial in by_weight]) < 0)
    # raised fourfold, then enclosed
    assert len(trials) <= 10
    assert bounded.iterations < 40


def test_relaxed_weight_violates_and_the_weight_keeps_the_speeds(
        rigid_model: ArmModel, paper_task: TaskFactory, bounded: Plan) -> None:
    (margin,) = search_of(bounded).margins
    for weight, share in ((margin.weight, margin.share),
                          (margin.relaxed_weight, margin.relaxed_share)):
        again = plan_path(paper_task(rigid_model.arm, w_2=weight), model=rigid_model)
        assert again.solved
        assert seen(again).speeds.max() / BOUND == pytest.approx(share, rel=SEEN)


def test_plan_with_the_weight_is_that_of_its_task(rigid_model: ArmModel, bounded: Plan) -> None:
    again = plan_path(bounded.task, model=rigid_model)
    assert again.objectives is None
    assert again.cost == pytest.approx(bounded.cost, rel=1e-8)
    assert bounded.certificate.boundary_error < 1e-9
    assert bounded.strategy == 'weights adapted'


@pytest.mark.parametrize('tolerance', [1e-4, 0.1, 1.0])
def test_weight_is_as_near_to_the_smallest_as_asked(
        rigid_model: ArmModel, paper_task: TaskFactory, tolerance: float) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), weight_tolerance=tolerance,
                  max_joint_speeds=[BOUND, BOUND])
    (margin,) = search_of(plan).margins
    assert margin.relaxed_weight < SMALLEST * (1 + 1e-4)
    assert SMALLEST / (1 + 1e-4) < margin.weight <= (1 + tolerance) * margin.relaxed_weight
    assert margin.share <= 1 < margin.relaxed_share


def test_weight_is_added_to_those_of_the_task(rigid_model: ArmModel,
                                              paper_task: TaskFactory) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm, w_2=1.0),
                  max_joint_speeds=[BOUND, BOUND])
    (margin,) = search_of(plan).margins
    assert plan.solved, plan.message
    assert plan.task.velocity_weights.tolist() == [1 + margin.weight] * 2
    assert 1 + margin.relaxed_weight < SMALLEST < 1 + margin.weight


# Met, or without limits


@pytest.mark.parametrize('limits', [
    {'max_joint_speeds': [1.3, 1.3]}, {'max_joint_speeds': [1.1, inf]},
    {'max_torque_shares': [0.8, 0.8]}, {'max_joint_speeds': [2.0, 2.0],
                                        'max_torque_shares': [1.0, 0.6]}], ids=str)
def test_motion_that_keeps_its_limits_stays_as_it_is(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory,
        limits: dict[str, Any]) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), **limits)
    search, bare = search_of(plan), plan_of('rigid')
    assert plan.solved, plan.message
    assert (search.met, search.trials, search.margins) == (True, (), ())
    assert (plan.cost, plan.iterations) == (bare.cost, bare.iterations)
    assert plan.task.velocity_weights.tolist() == [0.0, 0.0]


@pytest.mark.parametrize('limits', [
    {}, {'max_joint_speeds': [inf, inf]}, {'max_torque_shares': [inf, inf]}], ids=str)
def test_objectives_without_limits_are_met(rigid_model: ArmModel, paper_task: TaskFactory,
                                           limits: dict[str, Any]) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), **limits)
    assert plan.solved, plan.message
    assert (search_of(plan).met, search_of(plan).trials) == (True, ())


def test_motion_that_is_not_found_has_no_objectives(rigid_model: ArmModel,
                                                    paper_task: TaskFactory) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), Monitor(time_limit=0.0),
                  max_joint_speeds=[BOUND, BOUND])
    assert (plan.status, plan.objectives) == (PlanStatus.TIMEOUT, None)


# Impossible


def test_speed_that_no_weight_reaches_is_not_met_by_the_closest_motion(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), max_joint_speeds=[0.5, 0.5])
    search, speeds = search_of(plan), seen(plan).speeds
    assert (plan.status, plan.solved) == (PlanStatus.OBJECTIVE_NOT_MET, False)
    assert (search.met, search.margins) == (False, ())
    assert not any(trial.met for trial in search.trials)
    # section 5.2: 0.617 rad/s at 1400, and a little less beyond
    assert speeds.max() == pytest.approx(0.615, abs=1.5e-3)
    assert speeds.max() / 0.5 == pytest.approx(min(trial.share for trial in search.trials),
                                               rel=SEEN)
    assert plan.message == (
        'an objective cannot be met, this is the closest motion; joint speeds: joint 1 reaches '
        f'{speeds[0]:.4g}, but must be <= 0.5')
    assert len(search.trials) < 12


def test_speed_that_is_hardly_reached_is_met(rigid_model: ArmModel,
                                             paper_task: TaskFactory) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), max_joint_speeds=[0.617, 0.617])
    (margin,) = search_of(plan).margins
    assert plan.solved, plan.message
    assert 1000 < margin.weight < 1800
    assert seen(plan).speeds.max() <= 0.617


@pytest.mark.parametrize('limits', [
    {'max_joint_speeds': [0.7, 0.7], 'max_torque_shares': [0.3, 0.3]},
    {'max_joint_speeds': [0.8, 0.8], 'max_torque_shares': [0.4, inf]}], ids=str)
def test_objectives_that_exclude_each_other_end(rigid_model: ArmModel, paper_task: TaskFactory,
                                                limits: dict[str, Any]) -> None:
    # slower joints need more torque
    plan = within(rigid_model, paper_task(rigid_model.arm), **limits)
    assert plan.status is PlanStatus.OBJECTIVE_NOT_MET
    assert 'torque shares: joint 1 reaches ' in plan.message
    assert f'but must be <= {limits["max_torque_shares"][0]}' in plan.message
    # its motion is a motion: the torques lead to the goal
    assert plan.certificate.boundary_error < 1e-9
    assert len(search_of(plan).trials) < 100


# Joint by joint


@pytest.mark.parametrize('joint', [0, 1])
def test_limit_of_one_joint_is_met_by_its_own_weight(rigid_model: ArmModel,
                                                     paper_task: TaskFactory, joint: int) -> None:
    limits = [inf, inf]
    limits[joint] = BOUND
    plan = within(rigid_model, paper_task(rigid_model.arm), max_joint_speeds=limits)
    (margin,), speeds = search_of(plan).margins, seen(plan).speeds
    assert plan.solved, plan.message
    assert plan.task.velocity_weights[joint] == margin.weight > 0
    assert plan.task.velocity_weights[1 - joint] == 0
    assert speeds[joint] <= BOUND < speeds[1 - joint]
    assert speeds[joint] == pytest.approx(BOUND, rel=5e-3)  # a hundredth in the weight


def test_weights_of_unlike_limits_go_with_their_inverse_squares(rigid_model: ArmModel,
                                                                paper_task: TaskFactory) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), max_joint_speeds=[0.9, 0.7])
    (margin,), weights = search_of(plan).margins, plan.task.velocity_weights
    assert plan.solved, plan.message
    assert (seen(plan).speeds <= [0.9, 0.7]).all()
    assert weights[1] == margin.weight
    assert weights[0] == pytest.approx(weights[1] * (0.7 / 0.9)**2, rel=1e-12)


# Torques


@pytest.mark.parametrize(('limits', 'joint'), [([0.65, inf], 0), ([inf, 0.4], 1)])
def test_share_of_the_torque_is_met_by_its_weight(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory,
        limits: list[float], joint: int) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), max_torque_shares=limits)
    (margin,), shares = search_of(plan).margins, seen(plan).torque_shares
    assert plan.solved, plan.message
    assert margin.objective is Objective.TORQUE_SHARES
    assert shares[joint] <= limits[joint] < seen(plan_of('rigid')).torque_shares[joint]
    assert shares[joint] == pytest.approx(limits[joint], rel=5e-3)
    # R grows by the share that was tried, that of the other joint does not
    assert plan.task.effort_weights[joint] == pytest.approx((1 + margin.weight) / 8, rel=1e-12)
    assert plan.task.effort_weights[1 - joint] == 1 / 8
    assert not plan.task.velocity_weights.any()


def test_equal_limits_of_the_torques_are_met_where_one_of_them_is(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    # with 0.65 for the first joint alone, the second stays below it
    plan = within(rigid_model, paper_task(rigid_model.arm), max_torque_shares=[0.65, 0.65])
    assert plan.solved, plan.message
    assert (seen(plan).torque_shares <= 0.65).all()


# Vibration


def test_modal_rate_is_met_by_the_weight_of_its_mode(ei5_model: ArmModel, paper_task: TaskFactory,
                                                     plan_of: PlanFactory) -> None:
    before = modal_peaks(plan_of('ei5'))
    limit = 0.8 * before[0]
    plan = within(ei5_model, paper_task(ei5_model.arm), max_modal_rates=[limit, inf, inf, inf])
    (margin,) = search_of(plan).margins
    assert plan.solved, plan.message
    assert margin.objective is Objective.MODAL_RATES
    assert modal_peaks(plan)[0] <= limit * (1 + RUNG)
    assert plan.task.velocity_weights.tolist() == [0, 0, margin.weight, 0, 0, 0]


def test_modal_rates_are_met_by_the_weights_of_all_modes(ei5_model: ArmModel,
                                                         paper_task: TaskFactory,
                                                         plan_of: PlanFactory) -> None:
    limits = 0.7 * modal_peaks(plan_of('ei5'))
    plan = within(ei5_model, paper_task(ei5_model.arm), max_modal_rates=limits)
    (margin,), weights = search_of(plan).margins, plan.task.velocity_weights
    assert plan.solved, plan.message
    assert (modal_peaks(plan) <= limits * (1 + RUNG)).all()
    assert not weights[:2].any()
    np.testing.assert_allclose(weights[2:], margin.weight * (limits.min() / limits)**2)


def test_modal_rate_that_no_weight_reaches_names_its_mode(single_mode_model: ArmModel,
                                                          paper_task: TaskFactory) -> None:
    plan = within(single_mode_model, paper_task(single_mode_model.arm),
                  max_modal_rates=[inf, 1e-6])
    assert plan.status is PlanStatus.OBJECTIVE_NOT_MET
    assert '; modal rates: mode 2 reaches ' in plan.message
    assert plan.message.endswith(', but must be <= 1e-06')


# Two at once


def test_speeds_and_vibration_are_met_together(ei5_model: ArmModel, paper_task: TaskFactory,
                                               plan_of: PlanFactory) -> None:
    task, limit = paper_task(ei5_model.arm), 0.9 * modal_peaks(plan_of('ei5'))[0]
    limits = {'max_joint_speeds': [1.0, 1.0], 'max_modal_rates': [limit, inf, inf, inf]}
    plan = within(ei5_model, task, **limits)
    assert plan.solved, plan.message
    assert seen(plan).speeds.max() <= 1.0
    assert modal_peaks(plan)[0] <= limit * (1 + RUNG)
    speed, rate = search_of(plan).margins
    weights = plan.task.velocity_weights
    assert weights.tolist() == [speed.weight, speed.weight, rate.weight, 0, 0, 0]
    # condition (II) for each, with the other's weight as it is
    for margin, first, of in ((speed, 0, slice(2)), (rate, 2, slice(2, 3))):
        relaxed = weights.copy()
        relaxed[of] = margin.relaxed_weight
        again = plan_path(replace(task, velocity_weights=relaxed), model=ei5_model,
                          start_from=plan)
        reached = modal_peaks(again)[0] / limit if first else seen(again).speeds.max()
        assert reached == pytest.approx(margin.relaxed_share, rel=RUNG)
        assert reached > 1


# Limits as data


def test_shares_are_peaks_by_their_limits(plan_of: PlanFactory) -> None:
    plan = plan_of('ei5')
    objectives = Objectives(max_joint_speeds=[0.5, 2.0], max_torque_shares=[0.5, inf],
                            max_modal_rates=[0.1, inf, 0.2, 0.3])
    data, found = (plan.problem, solution_of(plan)), seen(plan)
    for objective, expected in (
            (Objective.JOINT_SPEEDS, found.speeds / [0.5, 2.0]),
            (Objective.TORQUE_SHARES, found.torque_shares / [0.5, inf]),
            (Objective.MODAL_RATES, modal_peaks(plan) / [0.1, inf, 0.2, 0.3])):
        np.testing.assert_allclose(objectives.shares(objective, *data), expected, rtol=RUNG)
    assert objectives.limited(plan.arm) == tuple(Objective)
    assert Objectives(max_torque_shares=[inf, 0.5]).limited(plan.arm) == (
        Objective.TORQUE_SHARES,)


def test_limits_are_copied_and_read_only() -> None:
    given = np.array([1.0, 2.0])
    objectives = Objectives(max_joint_speeds=given)
    given[0] = 7.0
    assert objectives.max_joint_speeds.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match='read-only'):
        objectives.max_joint_speeds[0] = 3.0


REASON = 'but must be > 0, or inf for no limit'


@pytest.mark.parametrize(('changes', 'message'), [
    ({'max_joint_speeds': [0.8, 0.0]}, f'max_joint_speeds[1] is 0.0, {REASON}'),
    ({'max_joint_speeds': [-0.8, 0.8]}, f'max_joint_speeds[0] is -0.8, {REASON}'),
    ({'max_torque_shares': [nan, 0.8]}, f'max_torque_shares[0] is nan, {REASON}'),
    ({'max_modal_rates': [0.1, -inf]}, f'max_modal_rates[1] is -inf, {REASON}'),
    ({'max_modal_rates': 'slow'}, "max_modal_rates is 'slow', but must be a list of numbers"),
    ({'max_joint_speeds': 0.8}, 'max_joint_speeds is 0.8, but must be a list of numbers'),
    ({'max_joint_speeds': [[0.8, 0.8]]},
     'max_joint_speeds is [[0.8, 0.8]], but must be a list of numbers'),
    ({'weight_tolerance': 0.0},
     'weight_tolerance is 0.0, but must be a number >= 0.0001 and <= 1'),
    ({'weight_tolerance': 1.1},
     'weight_tolerance is 1.1, but must be a number >= 0.0001 and <= 1'),
    ({'weight_tolerance': nan},
     'weight_tolerance is nan, but must be a finite number >= 0.0001 and <= 1')], ids=str)
def test_bad_limit_is_named_with_its_bound(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        Objectives(**changes)
    assert str(caught.value) == message


@pytest.mark.parametrize(('name', 'limits', 'message'), [
    ('rigid', {'max_joint_speeds': [0.8]},
     'max_joint_speeds has 1 entries, but must be a list of 2 numbers'),
    ('ei5', {'max_torque_shares': [0.8] * 6},
     'max_torque_shares has 6 entries, but must be a list of 2 numbers'),
    ('ei5', {'max_modal_rates': [0.1, 0.1]},
     'max_modal_rates has 2 entries, but must be a list of 4 numbers'),
    ('rigid', {'max_modal_rates': [0.1]},
     'max_modal_rates has 1 entries, but must be empty: the links are rigid')], ids=str)
def test_wrong_number_of_limits_is_refused_before_planning(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str,
        limits: dict[str, Any], message: str) -> None:
    model, monitor = request.getfixturevalue(f'{name}_model'), Monitor()
    with pytest.raises(InvalidSizeError) as caught:
        within(model, paper_task(model.arm), monitor, **limits)
    assert str(caught.value) == message
    assert monitor.iteration == 0


def test_free_duration_is_refused(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    with pytest.raises(InvalidTaskError, match='time_weight is 1, but must be 0 where objectives '
                       'are given'):
        within(rigid_model, paper_task(rigid_model.arm, time_weight=1.0),
               max_joint_speeds=[BOUND, BOUND])


# Progress and stops


def test_search_reports_its_phases(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    reports: list[Progress] = []
    plan = within(rigid_model, paper_task(rigid_model.arm), Monitor(report=reports.append),
                  max_joint_speeds=[BOUND, BOUND])
    phases = list(dict.fromkeys(each.phase for each in reports))
    # the phase of a plan is the name of its strategy
    assert phases == ['cold start', 'weight of joint speeds', 'weights adapted']
    assert len(reports) == plan.iterations
    assert {each.payload for each in reports} == {0.0}


@both_stops
@pytest.mark.parametrize(('phase', 'iterations'), [
    ('cold start', 2), ('cold start', 4), ('weight of joint speeds', 0),
    ('weight of joint speeds', 9), ('weights adapted', 0), ('weights adapted', 2)])
def test_search_is_stopped_wherever_it_is(rigid_model: ArmModel, paper_task: TaskFactory,
                                          phase: str, iterations: int, status: PlanStatus) -> None:
    # after 4 and 2 iterations, in the re-simulation
    monitor = stopped_in(phase, status, iterations)
    plan = within(rigid_model, paper_task(rigid_model.arm), monitor,
                  max_joint_speeds=[BOUND, BOUND])
    assert (plan.status, plan.message) == (status, status.value)
    assert (plan.solved, plan.solution, monitor.phase) == (False, None, phase)
    # nothing is left that could be taken for a result
    assert (plan.cost, plan.certificate.boundary_error) == (inf, inf)
    assert plan.iterations == monitor.iteration


@both_stops
def test_search_for_what_cannot_be_met_is_stopped(rigid_model: ArmModel, paper_task: TaskFactory,
                                                  status: PlanStatus) -> None:
    for iterations in (12, 25, 40):
        monitor = stopped_in('weight of joint speeds', status, iterations)
        plan = within(rigid_model, paper_task(rigid_model.arm), monitor,
                      max_joint_speeds=[0.5, 0.5])
        assert (plan.status, plan.solution) == (status, None)


# Named kinds of cost


def test_minimum_effort_has_nothing_else_in_its_cost(rigid_arm: Arm,
                                                     paper_task: TaskFactory) -> None:
    task = paper_task(rigid_arm, 2.0, 10.0, position_weights=[1.0, 2.0], time_weight=3.0)
    bare = minimum_effort(task)
    assert not bare.position_weights.any()
    assert not bare.velocity_weights.any()
    assert bare.time_weight == 0
    assert bare.effort_weights.tolist() == task.effort_weights.tolist()
    assert (bare.payload_mass, bare.duration) == (2.0, 1.0)
    # the task stays as it is
    assert task.velocity_weights.tolist() == [10.0, 10.0]


def test_minimum_effort_speed_is_that_of_section_5_2(rigid_model: ArmModel,
                                                     paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm, position_weights=[1.0, 2.0], time_weight=3.0)
    plan = plan_path(minimum_effort_speed(task, 10.0), model=rigid_model)
    assert plan.cost == pytest.approx(3.919485376, rel=2e-8)
    least = plan_path(minimum_effort(task), model=rigid_model)
    assert least.cost == pytest.approx(0.6468129775, rel=2e-8)
    assert least.effort < plan.effort


def test_minimum_vibration_vibrates_less_for_more_effort(ei5_model: ArmModel,
                                                         paper_task: TaskFactory) -> None:
    task = paper_task(ei5_model.arm, w_2=10.0)
    calm_task = minimum_vibration(task, 2e3)
    assert calm_task.velocity_weights.tolist() == [0, 0, 2e3, 2e3, 2e3, 2e3]
    plans = [plan_path(each, model=ei5_model) for each in (minimum_effort(task), calm_task)]
    assert all(plan.solved for plan in plans)
    samples = [plan.uniform_samples(2001) for plan in plans]
    rung = [simpson((each.rates[:, 2:]**2).sum(axis=1), x=each.times) for each in samples]
    assert rung[1] < rung[0] / 2
    assert plans[1].effort > plans[0].effort


def test_minimum_time_tends_to_the_shortest_duration(rigid_model: ArmModel,
                                                     paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm, w_2=10.0)
    shortest = find_min_duration(task, model=rigid_model, accuracy=1e-6)
    plans = [plan_path(minimum_time(task, price), model=rigid_model)
             for price in (1.0, 10.0, 100.0, 1e3, 1e4)]
    assert all(plan.solved for plan in plans)
    excess = np.array([plan.task.duration for plan in plans]) - shortest.duration
    assert (np.diff(excess) < 0).all()
    # near the end it goes with the inverse square of the price: motors leave their limits
    # at switches only, for so long
    assert 0 < excess[-1] < excess[-2] / 30 < 1e-5
    assert not plans[0].task.velocity_weights.any()


@pytest.mark.parametrize(('kind', 'value', 'message'), [
    (minimum_effort_speed, 0.0, 'weight is 0.0, but must be a number > 0 and <= 1e+12'),
    (minimum_effort_speed, nan, 'weight is nan, but must be a finite number > 0 and <= 1e+12'),
    (minimum_vibration, -1.0, 'weight is -1.0, but must be a number > 0 and <= 1e+12'),
    (minimum_vibration, inf, 'weight is inf, but must be a finite number > 0 and <= 1e+12'),
    (minimum_time, 0.0, 'price is 0.0, but must be a number > 0 and <= 1e+09 1/s'),
    (minimum_time, 2e9, 'price is 2000000000.0, but must be a number > 0 and <= 1e+09 1/s')])
def test_weight_that_is_none_is_refused(ei5_arm: Arm, paper_task: TaskFactory,
                                        kind: Callable[[Task, float], Task], value: float,
                                        message: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        kind(paper_task(ei5_arm), value)
    assert str(caught.value) == message


def test_rigid_links_have_no_vibration(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    with pytest.raises(InvalidTaskError, match='the links of the arm are rigid'):
        minimum_vibration(paper_task(rigid_arm), 1.0)
