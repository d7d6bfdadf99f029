"""Payload and duration as what is free at a price: the same questions answered for both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
import math

from factories import PlanFactory, TaskFactory
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import Solver, SolverSettings, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.free_parameters import DURATION, FreeParameter, PAYLOAD
from known_limits import lifted_to
import numpy as np
from plan_checks import problem_of, SAME_COST, solution_of
import pytest

Values = dict[str, float]
both = pytest.mark.parametrize('parameter', [PAYLOAD, DURATION], ids=lambda each: each.name)
FIELD = {PAYLOAD: 'payload_mass', DURATION: 'duration'}
# of the paper's motion, from far from the limit to near it
VALUES = {PAYLOAD: (0.0, 2.5, 5.5), DURATION: (10.0, 1.7, 0.7)}
# towards the limit
SIGN = {PAYLOAD: 1, DURATION: -1}


def extremal_at(parameter: FreeParameter, model: ArmModel, task: Task, factor: float,
                solver: Solver | None = None) -> tuple[float, Extremal | None]:
    """Return a multiple of the price of a task's motion, and the extremal at it."""
    plan = plan_path(task, model=model)
    price = factor * parameter.price(plan.problem, solution_of(plan))
    return price, parameter.solve_at_price(plan.problem, solution_of(plan), price,
                                           solver or Solver())


# Values


@both
def test_value_that_is_set_is_read_again_and_nothing_else_changes(
        rigid_model: ArmModel, paper_task: TaskFactory, parameter: FreeParameter) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, 3.0, 10.0, duration=1.2))
    for value in VALUES[parameter]:
        changed = parameter.with_value(problem, value)
        assert parameter.value(changed) == value
        assert changed.model is rigid_model
        for entry in fields(Task):
            before, after = (getattr(each.task, entry.name) for each in (problem, changed))
            assert entry.name == FIELD[parameter] or np.array_equal(before, after)
    assert parameter.value(problem) == {PAYLOAD: 3.0, DURATION: 1.2}[parameter]


def test_payload_that_is_set_is_that_of_the_equations(rigid_model: ArmModel,
                                                      paper_task: TaskFactory) -> None:
    problem = PAYLOAD.with_value(problem_of(rigid_model, paper_task(rigid_model.arm)), 2.5)
    assert problem.parameters.payload_mass == 2.5
    expected = problem_of(rigid_model, paper_task(rigid_model.arm, 2.5))
    assert problem.p.tolist() == expected.p.tolist()


@both
@pytest.mark.parametrize('value', [-1.0, math.nan, 1e9])
def test_absurd_value_is_refused(rigid_model: ArmModel, paper_task: TaskFactory,
                                 parameter: FreeParameter, value: float) -> None:
    assert not parameter.is_possible(value)
    with pytest.raises(FlexPlannerError):
        parameter.with_value(problem_of(rigid_model, paper_task(rigid_model.arm)), value)


def test_payload_too_heavy_to_hold_is_refused() -> None:
    task = lifted_to(0.0, 2.0)
    problem = problem_of(ArmModel.of(task.arm), task)
    # 0.4617 kg are the most that the motor holds at the goal
    assert PAYLOAD.value(PAYLOAD.with_value(problem, 0.46)) == 0.46
    with pytest.raises(FlexPlannerError, match='to hold the arm'):
        PAYLOAD.with_value(problem, 0.47)


@both
def test_value_nearer_to_the_limit_improves(parameter: FreeParameter) -> None:
    far, middle, near = VALUES[parameter]
    assert parameter.improves(near, middle)
    assert parameter.improves(middle, far)
    assert not parameter.improves(far, near)
    assert not parameter.improves(near, near)


@both
def test_next_value_is_nearer_and_possible(parameter: FreeParameter) -> None:
    for value in VALUES[parameter]:
        following = parameter.next_value(value)
        assert parameter.improves(following, value)
        assert parameter.is_possible(following)


@both
def test_search_may_start_with_the_value_asked_and_never_beyond_the_longest(
        rigid_model: ArmModel, paper_task: TaskFactory, parameter: FreeParameter) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, 2.0, duration=400.0))
    starts = [parameter.value(start) for start in parameter.starts(problem)]
    assert starts[0] == {PAYLOAD: 2.0, DURATION: 400.0}[parameter]
    assert max(starts) == {PAYLOAD: 2.0, DURATION: 1000.0}[parameter]
    easiest = parameter.value(parameter.easiest(problem))
    assert not any(parameter.improves(easiest, start) for start in starts)


# Prices


@both
@pytest.mark.parametrize('name', ['rigid', 'ei5'])
@pytest.mark.parametrize('value', [1, 2])
def test_price_is_what_a_little_nearer_to_the_limit_costs(
        request: pytest.FixtureRequest, paper_task: TaskFactory, parameter: FreeParameter,
        name: str, value: int) -> None:
    model, at = request.getfixturevalue(f'{name}_model'), VALUES[parameter][value]

    def planned(change: float) -> tuple[float, float]:
        task = paper_task(model.arm, **{FIELD[parameter]: at + SIGN[parameter] * change})
        plan = plan_path(task, model=model, solver=Solver(SolverSettings(error_tolerance=1e-8)))
        return plan.cost, parameter.price(plan.problem, solution_of(plan))

    h = 1e-3 * at
    difference = (planned(h)[0] - planned(-h)[0]) / (2 * h)
    # truncation: (h / at)^2 times what J's third derivative is more than J, some hundreds
    assert planned(0.0)[1] == pytest.approx(difference, rel=2e-4)


def test_price_of_a_motion_that_costs_nothing_is_still_positive(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    still = problem_of(rigid_model, paper_task(rigid_model.arm,
                                               goal_positions=task.start_positions))
    solution = still.straight_line(4, SolverSettings().rule)
    assert PAYLOAD.price(still, solution) > 0
    assert DURATION.price(still, solution) > 0


# Extremals


@both
@pytest.mark.parametrize('name', ['rigid', 'ei5'])
def test_extremal_at_a_price_solves_the_problem_of_its_value(
        request: pytest.FixtureRequest, paper_task: TaskFactory, parameter: FreeParameter,
        name: str) -> None:
    model = request.getfixturevalue(f'{name}_model')
    price, found = extremal_at(parameter, model, paper_task(model.arm), 4.0)
    assert found is not None
    assert (found.price, found.interrupted, found.result.converged) == (price, False, True)
    assert parameter.value(found.problem) == found.value
    assert parameter.improves(found.value, 1.0)
    assert found.result.solution.mesh[-1] == pytest.approx(found.problem.task.duration, rel=1e-15)
    # worth the price: the errors asked for are 1e-6, of a value that is far from flat
    assert parameter.price(found.problem, found.result.solution) == pytest.approx(price, rel=1e-5)


@both
def test_extremal_is_the_motion_that_is_planned_for_its_value(
        rigid_model: ArmModel, paper_task: TaskFactory, parameter: FreeParameter) -> None:
    _, found = extremal_at(parameter, rigid_model, paper_task(rigid_model.arm), 4.0)
    assert found is not None
    task = paper_task(rigid_model.arm, **{FIELD[parameter]: found.value})
    ours = plan_path(task, model=rigid_model, start_from=found.result.solution)
    cold = plan_path(task, model=rigid_model)
    assert (ours.solved, ours.strategy) == (True, 'warm start')
    assert ours.cost == pytest.approx(cold.cost, rel=SAME_COST)
    assert ours.iterations <= 2  # it was a solution


@both
def test_extremal_that_is_not_found_is_none(rigid_model: ArmModel, paper_task: TaskFactory,
                                            parameter: FreeParameter) -> None:
    hasty = Solver().patient(1)
    assert extremal_at(parameter, rigid_model, paper_task(rigid_model.arm), 4.0, hasty)[1] is None


def test_payload_below_none_is_no_extremal(rigid_model: ArmModel,
                                           paper_task: TaskFactory) -> None:
    # the price grows with the payload, so a tenth less than that of none is worth less than none
    task = paper_task(rigid_model.arm, payload_mass=0.0)
    assert extremal_at(PAYLOAD, rigid_model, task, 1.1)[1] is not None
    assert extremal_at(PAYLOAD, rigid_model, task, 0.9)[1] is None


@both
@pytest.mark.parametrize(('monitor', 'status'), [
    (lambda: Monitor(canceled=lambda: True), SolverStatus.CANCELED),
    (lambda: Monitor(time_limit=-1.0), SolverStatus.TIMEOUT)])
def test_extremal_that_was_interrupted_says_so(
        rigid_model: ArmModel, paper_task: TaskFactory, parameter: FreeParameter,
        monitor: Callable[[], Monitor], status: SolverStatus) -> None:
    _, found = extremal_at(parameter, rigid_model, paper_task(rigid_model.arm), 4.0,
                           Solver(monitor=monitor()))
    assert found is not None
    assert (found.interrupted, found.result.status) == (True, status)


@both
def test_gap_of_an_unknown_price_is_infinite(plan_of: PlanFactory,
                                             parameter: FreeParameter) -> None:
    plan = plan_of('rigid', 5.5)
    _, found = extremal_at(parameter, plan.model, plan.task, 1.5)
    assert found is not None
    known, unknown = found, Extremal(value=found.value, price=0.0, result=found.result,
                                     problem=found.problem)
    assert 0 < known.gap < math.inf
    assert unknown.gap == math.inf


def test_search_starts_with_no_duration_twice(rigid_model: ArmModel,
                                              paper_task: TaskFactory) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, duration=400.0))
    starts = [DURATION.value(start) for start in DURATION.starts(problem)]
    assert starts == [400.0, 1000.0]
