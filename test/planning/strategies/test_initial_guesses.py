"""Ways to a first solution, each of them alone, and walks from one problem to another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

from bvp_problems import second_order, System
from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    follow_homotopy,
    solve,
    Solver,
    SolverSettings,
    SolverStatus,
)
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.catalogue import CATALOGUE
from flex_planner.planning.strategies.homotopies import raise_weights
from flex_planner.planning.strategies.initial_guesses import lift_rigid_motion, warm_start
from flex_planner.planning.strategies.strategy import Strategy
import numpy as np
from plan_checks import problem_of, SAME_COST, solution_of
import pytest

PlanFactory = Callable[..., Plan]
TaskFactory = Callable[..., Task]

# what adds nothing to a task: the rigid arm does not bend, and makes the motion in time
NOTHING_TO_ADD = {
    'rigid': {'rigid motion first', 'homotopy in vibration weights', 'homotopy in stiffness'},
    'ei5': set[str]()}
BY_NAME = {strategy.name: strategy for strategy in CATALOGUE}
each_strategy = pytest.mark.parametrize('strategy', CATALOGUE, ids=list(BY_NAME))


# One by one


@pytest.mark.parametrize('name', ['rigid', 'ei5'])
@each_strategy
def test_every_strategy_solves_the_task_of_the_paper_alone(
        request: pytest.FixtureRequest, plan_of: PlanFactory, paper_task: TaskFactory,
        strategy: Strategy, name: str) -> None:
    model = request.getfixturevalue(f'{name}_model')
    problem, monitor = problem_of(model, paper_task(model.arm, w_2=10.0)), Monitor()
    attempt = strategy.attempt(problem, Solver(monitor=monitor))
    if strategy.name in NOTHING_TO_ADD[name]:
        assert attempt is None
        return
    assert attempt is not None
    assert (attempt.result.status, attempt.evidence) == (SolverStatus.CONVERGED, '')
    cost = integrate_totals(problem, attempt.result.solution).cost
    assert cost == pytest.approx(plan_of(name, 1.0, 10.0).cost, rel=SAME_COST)
    assert monitor.iteration <= 140  # 132 for the walk in payload of EI = 5


@pytest.mark.parametrize('label', ['homotopy in the weights', 'continuation in payload'])
def test_walk_in_what_a_task_has_not_adds_nothing(
        rigid_model: ArmModel, paper_task: TaskFactory, label: str) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, payload_mass=0.0))
    assert BY_NAME[label].attempt(problem, Solver()) is None


def test_lifted_guess_is_the_rigid_motion_with_straight_links(
        ei5_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    guesses: list[CollocationSolution] = []

    def watched(problem: MotionProblem, guess: CollocationSolution,
                *rest: Any, **options: Any) -> CollocationResult:
        guesses.append(guess)
        return solve(problem, guess, *rest, **options)

    problem = problem_of(ei5_model, paper_task(ei5_model.arm, w_2=10.0))
    lift_rigid_motion(problem, Solver(backend=watched))
    rigid = solution_of(plan_of('rigid', 1.0, 10.0))
    joints = np.array([0, 1, 6, 7, 12, 13, 18, 19])
    times, lifted = np.linspace(0, 1, 7), guesses[-1]
    # the last of nine Gauss points of the solution is dropped, relative to costates up to 10
    np.testing.assert_allclose(lifted(times)[:, joints], rigid(times), atol=1e-9)
    assert not np.delete(lifted.nodes, joints, axis=1).any()


def test_rigid_motion_takes_the_weights_and_velocities_of_the_joints(
        ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    tasks: list[Task] = []

    def watched(problem: MotionProblem, *rest: Any, **options: Any) -> CollocationResult:
        tasks.append(problem.task)
        return solve(problem, *rest, **options)

    numbers = {'position_weights': [1, 2, 3, 4, 5, 6], 'velocity_weights': [6, 5, 4, 3, 2, 1],
               'start_velocities': [0.1, 0.2, 0.01, 0, 0, 0], 'goal_velocities': [0.3, 0.4],
               'goal_position_weights': [math.inf, 7, 8, 9, 10, 11],
               'goal_velocity_weights': [12, 13]}
    task = paper_task(ei5_model.arm, **numbers)
    lift_rigid_motion(problem_of(ei5_model, task), Solver(backend=watched))
    for name, values in numbers.items():
        assert getattr(tasks[0], name).tolist() == values[:2]
    assert tasks[0].arm.n_modes == 0


def test_large_weights_are_walked_up_from_none(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    weights: list[float] = []

    def watched(problem: MotionProblem, *rest: Any, **options: Any) -> CollocationResult:
        weights.append(float(problem.parameters.velocity_weights.max()))
        return solve(problem, *rest, **options)

    problem = problem_of(rigid_model, paper_task(rigid_model.arm, w_2=1400.0))
    attempt = raise_weights(problem, Solver(backend=watched))
    assert attempt is not None
    assert attempt.result.converged
    assert (weights[0], weights[-1]) == (0.0, 1400.0)
    assert 1 <= weights[1] <= 10
    assert weights == sorted(weights)  # no step failed
    assert integrate_totals(problem, attempt.result.solution).cost == pytest.approx(
        plan_of('rigid', 1.0, 1400.0).cost, rel=SAME_COST)


# Warm starts


@pytest.mark.parametrize('changes', [
    {}, {'duration': 1.3}, {'payload_mass': 5.0}, {'w_2': 10.0}, {'goal_velocities': [0.2, 0.1]}],
    ids=str)
def test_plan_of_a_similar_task_is_a_start(ei5_model: ArmModel, paper_task: TaskFactory,
                                           plan_of: PlanFactory, changes: dict[str, Any]) -> None:
    task = paper_task(ei5_model.arm, **changes)
    warm = plan_path(task, model=ei5_model, start_from=plan_of('ei5'))
    cold = plan_path(task, model=ei5_model)
    assert (warm.solved, warm.strategy) == (True, 'warm start'), warm.message
    assert warm.cost == pytest.approx(cold.cost, rel=SAME_COST)


def test_solution_solves_its_own_task_at_once(ei5_model: ArmModel, paper_task: TaskFactory,
                                              plan_of: PlanFactory) -> None:
    again = plan_path(paper_task(ei5_model.arm), model=ei5_model, start_from=plan_of('ei5'))
    assert again.iterations <= 2  # its stages are one fewer, so that it is not exact
    assert again.mesh_intervals == plan_of('ei5').mesh_intervals


def test_plan_may_start_one_of_another_rule_or_stiffness(
        ei50_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    plan = plan_path(paper_task(ei50_model.arm), model=ei50_model, start_from=plan_of('ei5'),
                     solver=Solver(SolverSettings(stages=5)))
    assert (plan.solved, plan.strategy) == (True, 'warm start')
    assert plan.cost == pytest.approx(plan_of('ei50').cost, rel=SAME_COST)


def test_plan_of_an_arm_with_other_coordinates_is_no_start(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    task = paper_task(rigid_model.arm)
    strategy = warm_start(solution_of(plan_of('ei5')))
    assert strategy.attempt(problem_of(rigid_model, task), Solver()) is None
    plan = plan_path(task, model=rigid_model, start_from=plan_of('ei5'))
    assert (plan.solved, plan.strategy) == (True, 'cold start')


def test_plan_without_solution_is_no_start(rigid_model: ArmModel,
                                           paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    canceled = plan_path(task, model=rigid_model, monitor=Monitor(canceled=lambda: True))
    plan = plan_path(task, model=rigid_model, start_from=canceled)
    assert (plan.solved, plan.strategy) == (True, 'cold start')


# Walks


def heavier(model: ArmModel, task: Task, last: float,
            ways: list[float]) -> Callable[[float], MotionProblem]:
    """Return the family of motions with payloads up to the last, which notes what is asked."""
    def at(way: float) -> MotionProblem:
        ways.append(way)
        mass = task.payload_mass + way * (last - task.payload_mass)
        return problem_of(model, replace(task, payload_mass=mass))

    return at


def test_walk_reaches_the_end_exactly_in_growing_steps(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    ways: list[float] = []
    family = heavier(rigid_model, paper_task(rigid_model.arm), 5.5, ways)
    result = follow_homotopy(family, solution_of(plan_of('rigid')), Solver(),
                             0.1)
    assert result.converged
    assert ways == pytest.approx([0.1, 0.3, 0.7, 1.0])
    cost = integrate_totals(family(1.0), result.solution).cost
    assert cost == pytest.approx(plan_of('rigid', 5.5).cost, rel=SAME_COST)


def test_walk_to_where_nothing_is_says_how_far_it_came() -> None:
    # Bratu's y'' = -lambda exp(y) has solutions up to lambda = 3.5138307
    settings, ways = SolverSettings(), []

    def at(way: float) -> System:
        ways.append(way)
        return second_order(lambda t, y, v: -5 * way * np.exp(np.minimum(y, 300)), 0, 0)

    nothing = CollocationSolution.from_values(np.linspace(0, 1, 21), np.zeros((21, 2)),
                                              settings.rule)
    result = follow_homotopy(at, nothing, Solver(settings), first_step=1.0)
    assert result.status is not SolverStatus.CONVERGED
    assert ways[:2] == [1.0, 0.5]  # halved where it failed
    percent = float(result.message.rpartition(' at ')[2].removesuffix('% of the homotopy'))
    # where the last step, twice the smallest of 1/256 or less, failed; rounded to 0.1 %
    assert 3.5138307 / 5 - 5e-4 < percent / 100 < 3.5138307 / 5 + 2 / 256 + 5e-4


@pytest.mark.parametrize('last', [0, 3, 6])
def test_walk_is_stopped(rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory,
                         last: int) -> None:
    monitor = Monitor()
    monitor.canceled = lambda: monitor.iteration >= last
    family = heavier(rigid_model, paper_task(rigid_model.arm), 9.0, [])
    result = follow_homotopy(family, solution_of(plan_of('rigid')), Solver(monitor=monitor), 0.2)
    assert (result.status, monitor.iteration) == (SolverStatus.CANCELED, last)
