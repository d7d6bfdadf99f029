"""Objectives met by weights: condition (II) of the paper's fig. 1."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from factories import PlanFactory, TaskFactory
from flex_planner.base.progress import Monitor, Progress
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.objectives import Objective, Objectives
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
import numpy as np
from objective_checks import modal_peaks, RINGING, search_of, SEEN, seen, within
from plan_checks import stopped_in
import pytest

inf = math.inf
# section 5.2: largest speed of the rigid arm with 1 kg, by w_2
SPEEDS = {0.0: 1.203, 1.0: 0.896, 10.0: 0.745, 1400.0: 0.617}
# section 5.2's bound, and the smallest w_2 that keeps it, enclosed within 1e-4 of itself
BOUND, SMALLEST = 0.8, 4.2745
both_stops = pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])


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
        rigid_model: ArmModel, paper_task: TaskFactory,
        limits: dict[str, Any]) -> None:
    plan = within(rigid_model, paper_task(rigid_model.arm), **limits)
    search = search_of(plan)
    bare = plan_path(paper_task(rigid_model.arm), model=rigid_model, search='fast')
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
    assert modal_peaks(plan)[0] <= limit * (1 + RINGING)
    assert plan.task.velocity_weights.tolist() == [0, 0, margin.weight, 0, 0, 0]


def test_modal_rates_are_met_by_the_weights_of_all_modes(ei5_model: ArmModel,
                                                         paper_task: TaskFactory,
                                                         plan_of: PlanFactory) -> None:
    limits = 0.7 * modal_peaks(plan_of('ei5'))
    plan = within(ei5_model, paper_task(ei5_model.arm), max_modal_rates=limits)
    (margin,), weights = search_of(plan).margins, plan.task.velocity_weights
    assert plan.solved, plan.message
    assert (modal_peaks(plan) <= limits * (1 + RINGING)).all()
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


@pytest.fixture(scope='module')
def calm(ei5_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> Plan:
    """Return a motion with joint speeds of at most 1 rad/s and nine tenths of its vibration."""
    limit = 0.9 * modal_peaks(plan_of('ei5'))[0]
    return within(ei5_model, paper_task(ei5_model.arm), max_joint_speeds=[1.0, 1.0],
                  max_modal_rates=[limit, inf, inf, inf])


def test_speeds_and_vibration_are_met_together(calm: Plan, plan_of: PlanFactory) -> None:
    assert calm.solved, calm.message
    assert seen(calm).speeds.max() <= 1.0
    assert modal_peaks(calm)[0] <= 0.9 * modal_peaks(plan_of('ei5'))[0] * (1 + RINGING)
    speed, rate = search_of(calm).margins
    assert calm.task.velocity_weights.tolist() == [speed.weight, speed.weight, rate.weight,
                                                   0, 0, 0]


@pytest.mark.parametrize(('which', 'first'), [(0, slice(2)), (1, slice(2, 3))])
def test_each_of_two_weights_is_needed_with_the_other_as_it_is(
        calm: Plan, plan_of: PlanFactory, which: int, first: slice) -> None:
    # condition (II)
    margin, relaxed = search_of(calm).margins[which], calm.task.velocity_weights.copy()
    relaxed[first] = margin.relaxed_weight
    again = plan_path(replace(calm.task, velocity_weights=relaxed), model=calm.model,
                      start_from=calm)
    limit = 0.9 * modal_peaks(plan_of('ei5'))[0]
    reached = modal_peaks(again)[0] / limit if which else seen(again).speeds.max()
    assert reached == pytest.approx(margin.relaxed_share, rel=RINGING)
    assert reached > 1


# Progress, and stopped


def test_search_reports_its_phases(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    reports: list[Progress] = []
    plan = within(rigid_model, paper_task(rigid_model.arm), Monitor(report=reports.append),
                  max_joint_speeds=[BOUND, BOUND])
    phases = list(dict.fromkeys(each.phase for each in reports))
    # the phase of a plan is the name of its strategy
    assert phases == ['cold start', 'weight of joint speeds', 'weights adapted']
    assert len(reports) == plan.iterations
    assert {each.payload for each in reports} == {0.0}


def test_cheaper_kinds_are_looked_for_before_weights_are(rigid_model: ArmModel,
                                                         paper_task: TaskFactory) -> None:
    reports: list[Progress] = []
    plan = plan_path(paper_task(rigid_model.arm), model=rigid_model,
                     monitor=Monitor(report=reports.append),
                     objectives=Objectives(max_joint_speeds=[BOUND, BOUND]))
    phases = list(dict.fromkeys(each.phase for each in reports))
    kinds = [phase for phase in phases if phase.startswith('kinds of motion, start ')]
    assert kinds
    assert phases == ['cold start', *kinds, 'weight of joint speeds', 'weights adapted']
    assert search_of(plan).met


@both_stops
@pytest.mark.parametrize(('phase', 'iterations'), [
    ('cold start', 2), ('cold start', 4), ('weight of joint speeds', 0),
    ('weight of joint speeds', 9), ('weights adapted', 0), ('weights adapted', 1)])
def test_search_is_stopped_wherever_it_is(rigid_model: ArmModel, paper_task: TaskFactory,
                                          phase: str, iterations: int, status: PlanStatus) -> None:
    # after 4 and 1 iterations, in the re-simulation
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
