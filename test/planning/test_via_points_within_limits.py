"""Via points and limits on the way at once: both are kept, or it is said which cannot be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from factories import TaskFactory
from flex_planner.base.errors import InvalidValueError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion
from flex_planner.optimal_control.path_constraints import (
    Circle,
    JointRange,
    JointSpeed,
    KeepOut,
    PathConstraint,
)
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest

SPEEDS = JointSpeed(joint=1, limit=1.16), JointSpeed(joint=2, limit=1.66)
FREE = ViaPoint(point=[0.42, 0.2])


def through(model: ArmModel, task: TaskFactory, points: list[ViaPoint],
            *limits: PathConstraint) -> Plan:
    return plan_path(task(model.arm, via_points=points, path_constraints=limits), model=model,
                     search='fast')


@pytest.fixture(scope='module')
def at_best_time(rigid_model: ArmModel, paper_task: TaskFactory) -> Plan:
    return through(rigid_model, paper_task, [FREE], *SPEEDS)


@pytest.mark.parametrize(('points', 'limits'), [
    ([ViaPoint(positions=[1.15, -2.2], time=0.4)],
     (JointSpeed(joint=1, limit=1.3), JointSpeed(joint=2, limit=1.7))),
    ([ViaPoint(point=[0.42, 0.2], time=0.4)],
     (JointSpeed(joint=1, limit=1.71), JointSpeed(joint=2, limit=1.32))),
    ([ViaPoint(positions=[1.15, -2.1], time=0.35), ViaPoint(positions=[1.45, -1.75], time=0.7)],
     (JointSpeed(joint=1, limit=0.925),))])
def test_motion_that_limits_bend_passes_its_via_points(
        rigid_model: ArmModel, paper_task: TaskFactory, points: list[ViaPoint],
        limits: tuple[PathConstraint, ...]) -> None:
    plan = through(rigid_model, paper_task, points, *limits)
    assert plan.solved, plan.message
    assert isinstance(plan.problem, ConstrainedMotion)
    assert plan.via_times.tolist() == [via.time for via in points]
    assert plan.certificate.via_error < 1e-7
    assert all(one.kept for one in plan.constraints)
    free = through(rigid_model, paper_task, points)
    assert plan.cost > free.cost


def test_free_time_within_limits_is_better_than_any_near_it(
        rigid_model: ArmModel, paper_task: TaskFactory, at_best_time: Plan) -> None:
    plan = at_best_time
    assert plan.solved, plan.message
    assert isinstance(plan.problem, ConstrainedMotion)
    assert plan.certificate.via_error < 1e-7 and all(one.kept for one in plan.constraints)
    (time,) = plan.via_times
    # at the best time of the motion without limits it would be dearer, too
    (before,) = through(rigid_model, paper_task, [FREE]).via_times
    for other in (time - 0.01, time + 0.01, before):
        given = through(rigid_model, paper_task, [replace(FREE, time=other)], *SPEEDS)
        assert given.solved and given.cost > plan.cost - 1e-5 * plan.cost
    # H and the barrier go on through the via point
    assert plan.certificate.hamiltonian_drift < 1e-6


def test_plan_within_limits_starts_from_one_with_other_limits(
        rigid_model: ArmModel, at_best_time: Plan) -> None:
    tighter = replace(at_best_time.task, path_constraints=(
        JointSpeed(joint=1, limit=1.12), JointSpeed(joint=2, limit=1.6)))
    plan = plan_path(tighter, model=rigid_model, start_from=at_best_time, search='fast')
    assert plan.solved, plan.message
    assert plan.cost > at_best_time.cost
    assert plan.certificate.via_error < 1e-7 and all(one.kept for one in plan.constraints)


@pytest.mark.parametrize(('via', 'limit', 'words'), [
    (ViaPoint(point=[0.52, 0.25]), KeepOut(region=Circle(center=(0.52, 0.27), radius=0.1),
                                           name='post'), 'tip from post, by 0.0'),
    (ViaPoint(positions=[np.nan, -2.3], time=0.4), JointRange(joint=2, lower=-2.2, upper=0.0),
     'lower limit of joint 2, by 0.1 rad')])
def test_via_point_beyond_a_limit_is_impossible(
        rigid_model: ArmModel, paper_task: TaskFactory, via: ViaPoint, limit: PathConstraint,
        words: str) -> None:
    plan = through(rigid_model, paper_task, [via], limit)
    assert plan.status is PlanStatus.INFEASIBLE
    assert plan.message.startswith('via point 1 breaks a limit that holds on the whole way: '
                                   + words)


@pytest.mark.parametrize(('field', 'one'), [
    ('path_constraints', JointSpeed(joint=1, limit=1.0)), ('path_constraints', None),
    ('via_points', FREE), ('via_points', None)])
def test_one_entry_instead_of_a_list_is_refused(rigid_model: ArmModel, paper_task: TaskFactory,
                                                field: str, one: Any) -> None:
    with pytest.raises(InvalidValueError, match=f'{field} is .*must be a list of'):
        paper_task(rigid_model.arm, **{field: one})


def test_via_point_says_nothing_of_limits_that_it_does_not_decide(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    # joint 2 is free at the via point, and so is all but the tip
    plan = through(rigid_model, paper_task, [ViaPoint(positions=[1.3, np.nan], time=0.5)],
                   JointRange(joint=2, lower=-2.2, upper=0.0))
    assert plan.status is not PlanStatus.INFEASIBLE
