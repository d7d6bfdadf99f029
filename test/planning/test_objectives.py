"""Limits of a motion as data, and named kinds of cost."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidSizeError, InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor
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
)
from flex_planner.planning.plan_path import plan_path
import numpy as np
from objective_checks import modal_peaks, RINGING, seen, within
from plan_checks import solution_of
import pytest
from scipy.integrate import simpson

inf, nan = math.inf, math.nan
REASON = 'but must be > 0, or inf for no limit'


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
        np.testing.assert_allclose(objectives.shares(objective, *data), expected, rtol=RINGING)
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
               max_joint_speeds=[0.8, 0.8])


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
    ringing = [simpson((each.rates[:, 2:]**2).sum(axis=1), x=each.times) for each in samples]
    assert ringing[1] < ringing[0] / 2
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
