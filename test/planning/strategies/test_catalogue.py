"""The strategies of the catalogue, each of them alone."""

from __future__ import annotations

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.progress import Monitor
from flex_planner.collocation import Solver, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.catalogue import CATALOGUE, order_strategies
from flex_planner.planning.strategies.strategy import Strategy
import numpy as np
from plan_checks import problem_of, SAME_COST
import pytest

# what adds nothing to a task: there are neither via points nor Coulomb friction, and the rigid arm
# does not bend
NEITHER = {'homotopy in via points', 'homotopy in Coulomb friction'}
NOTHING_TO_ADD = {
    'rigid': {'rigid motion first', 'interior point from the rigid motion',
              'homotopy in a price on bending', 'homotopy in vibration weights',
              'homotopy in stiffness', *NEITHER},
    'ei5': NEITHER}
BY_NAME = {strategy.name: strategy for strategy in CATALOGUE}
each_strategy = pytest.mark.parametrize('strategy', CATALOGUE, ids=list(BY_NAME))


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
    assert attempt.result.status is SolverStatus.CONVERGED
    assert not (attempt.not_found or attempt.hopeless)
    cost = integrate_totals(problem, attempt.result.solution).cost
    assert cost == pytest.approx(plan_of(name, 1.0, 10.0).cost, rel=SAME_COST)
    assert monitor.iteration <= 140  # 132 for the continuation in payload of EI = 5


@pytest.mark.parametrize('label', ['homotopy in the weights', 'continuation in payload'])
def test_continuation_in_what_a_task_has_not_adds_nothing(
        rigid_model: ArmModel, paper_task: TaskFactory, label: str) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, payload_mass=0.0))
    assert BY_NAME[label].attempt(problem, Solver()) is None


@pytest.mark.parametrize(('intervals', 'weight', 'first'), [
    (101, 3.0, ['rigid motion first', 'cold start']), (100, 3.0, ['cold start']),
    (101, 0.0, ['cold start'])])
def test_what_rings_many_times_under_gravity_starts_from_the_rigid_motion(
        ei5_model: ArmModel, paper_task: TaskFactory,
        monkeypatch: pytest.MonkeyPatch, intervals: int, weight: float, first: list[str]) -> None:
    problem = problem_of(ei5_model, paper_task(ei5_model.arm))
    monkeypatch.setattr(MotionProblem, 'fewest_intervals', lambda *given: intervals)
    problem.holding_torque = np.array([weight, 0.0])
    ordered = order_strategies(problem, Solver(), CATALOGUE)
    assert [each.name for each in ordered[:len(first)]] == first
    assert set(ordered) == set(CATALOGUE)
    assert ordered[2:] == list(CATALOGUE[2:])
    alone = order_strategies(problem, Solver(), CATALOGUE[:1])
    assert alone == [BY_NAME['cold start']]


def test_links_on_joints_without_inertia_seldom_start_from_a_straight_line() -> None:
    links = (Link(length=0.5, linear_density=6.0, flexural_rigidity=50.0, modes=1,
                  mode_family='clamped_free'),) * 2
    arm = Arm(name='light joints', links=links,
              joints=(Joint(motor=Motor(stall_torque=1e3)), Joint()))
    task = Task(arm=arm, start_positions=[0, 0], goal_positions=[1, 1], duration=2.0)
    problem = problem_of(ArmModel(arm), task)
    ordered = [each.name for each in order_strategies(problem, Solver(), CATALOGUE)]
    at = ordered.index('interior point')
    assert ordered[at - 2:at] == ['interior point from the rigid motion',
                                  'homotopy in a price on bending']
    other = CATALOGUE[::-1]
    assert order_strategies(problem, Solver(), other) == list(other)


def test_rigid_chains_go_to_direct_collocation_before_kinds_of_motion() -> None:
    # from a straight line Newton's method fails, and six of sixteen starts lead to a motion
    joints = (Joint(motor=Motor(stall_torque=1e3)), Joint(), Joint(), Joint())
    arm = Arm(name='chain', links=(Link(length=0.5, linear_density=6.0),) * 4, joints=joints)
    start = np.resize([0.5, -0.8], 4)
    task = Task(arm=arm, start_positions=start, goal_positions=start + 0.6, duration=2.0,
                payload_mass=1.0)
    ordered = order_strategies(problem_of(ArmModel(arm), task), Solver(), CATALOGUE)
    names = [each.name for each in ordered]
    assert names.index('direct collocation') == names.index('kinds of motion') - 1
    assert set(ordered) == set(CATALOGUE)
    # who wants another order has it
    other = CATALOGUE[::-1]
    assert order_strategies(problem_of(ArmModel(arm), task), Solver(), other) == list(other)
    plan = plan_path(task, search='fast')
    assert (plan.solved, plan.strategy) == (True, 'direct collocation'), plan.message
