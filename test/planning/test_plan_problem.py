"""Strategies in turn: which is reported, how planning is stopped, and how it meets its limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
import time
from typing import Any

from flex_planner.base.progress import LimitedMonitor, Monitor, Progress
from flex_planner.collocation import CollocationResult, Solver, SolverSettings, SolverStatus
from flex_planner.optimal_control import task as task_module
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.catalogue import CATALOGUE
from flex_planner.planning.strategies.initial_guesses import cold_start
from flex_planner.planning.strategies.strategy import Attempt, Strategy
from plan_checks import problem_of, SAME_COST, says_nothing
import pytest

PlanFactory = Callable[..., Plan]
TaskFactory = Callable[..., Task]
Attempting = Callable[[MotionProblem, Solver], Attempt | None]


def failed(result: CollocationResult, message: str, **others: bool) -> Attempting:
    """Return a strategy that fails."""
    attempt = Attempt(result=replace(result, status=SolverStatus.NEWTON_FAILED, message=message),
                      **others)
    return lambda problem, solver: attempt


@pytest.fixture
def result(rigid_model: ArmModel, paper_task: TaskFactory) -> CollocationResult:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm))
    return cold_start(problem, Solver()).result


def planned(model: ArmModel, task: Task, *named: tuple[str, Attempting], **others: Any) -> Plan:
    """Plan with strategies of given names alone."""
    return plan_path(task, model=model, strategies=[Strategy(*each) for each in named], **others)


def why(plan: Plan) -> str:
    """Return why a plan was not found, without what may help."""
    help_, _, reason = plan.message.partition('; ')
    assert help_.startswith('what may help: ')
    count, _, failures = reason.partition(' strategies found no motion; ')
    assert not failures or int(count) == len(plan.strategy.split(', '))
    return failures or reason


def unsolved(plan: Plan) -> bool:
    """Return whether a plan says nothing that could pass for a solution."""
    return (not plan.solved and plan.solution is None and plan.mesh_intervals == 0
            and says_nothing(plan))


def test_strategies_are_tried_until_one_solves_to_the_first_that_solves(
        rigid_model: ArmModel, paper_task: TaskFactory,
        result: CollocationResult) -> None:
    plan = planned(rigid_model, paper_task(rigid_model.arm),
                   ('first', failed(result, 'lost')), ('nothing', lambda *rest: None),
                   ('second', cold_start), ('third', failed(result, 'not tried')))
    assert (plan.solved, plan.strategy) == (True, 'second')


def test_all_failures_are_told_with_their_names(
        rigid_model: ArmModel, paper_task: TaskFactory,
        result: CollocationResult) -> None:
    plan = planned(rigid_model, paper_task(rigid_model.arm),
                   ('first', failed(result, 'lost')), ('nothing', lambda *rest: None),
                   ('second', failed(result, 'lost too')))
    assert (plan.status, plan.strategy) == (PlanStatus.NOT_CONVERGED, 'first, second')
    assert why(plan) == 'first: lost; second: lost too'
    assert 'does not show that the motion is impossible' in plan.status.value
    assert unsolved(plan)
    with pytest.raises(ValueError, match='the plan has no solution: what may help: '):
        plan.uniform_samples(2)


def test_what_speaks_against_a_task_ends_the_trials(
        rigid_model: ArmModel, paper_task: TaskFactory,
        result: CollocationResult) -> None:
    task = paper_task(rigid_model.arm)
    hopeless = failed(result, 'too much', not_found=True, hopeless=True)
    plan = planned(rigid_model, task, ('first', hopeless), ('second', cold_start))
    assert (plan.status, plan.strategy) == (PlanStatus.NOT_FOUND, 'first')
    assert plan.message == 'too much'
    assert unsolved(plan)
    # where it is only not found, the others are tried
    lost = failed(result, 'none', not_found=True)
    assert planned(rigid_model, task, ('first', lost), ('second', cold_start)).solved


def test_motion_that_many_starts_did_not_find_is_told_after_all_others(
        rigid_model: ArmModel, paper_task: TaskFactory,
        result: CollocationResult) -> None:
    plan = planned(rigid_model, paper_task(rigid_model.arm),
                   ('first', failed(result, 'none', not_found=True)),
                   ('second', failed(result, 'lost')))
    assert (plan.status, plan.strategy) == (PlanStatus.NOT_FOUND, 'first, second')
    assert plan.message == 'first: none; second: lost'
    assert unsolved(plan)


def test_monitor_hears_the_name_of_each_strategy(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    lines: list[Progress] = []

    def hasty(problem: MotionProblem, solver: Solver) -> Attempt:
        return cold_start(problem, solver.with_settings(max_iterations=1))

    plan = planned(rigid_model, paper_task(rigid_model.arm, 5.8), ('first', hasty),
                   ('second', hasty), ('third', cold_start), monitor=Monitor(report=lines.append),
                   search='fast')
    assert list(dict.fromkeys(line.phase for line in lines)) == ['first', 'second', 'third']
    assert len(lines) == lines[-1].iteration == plan.iterations


def test_no_strategies_are_refused(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    monitor = Monitor()
    for no_strategies in ([], ()):
        with pytest.raises(ValueError, match='must name at least one way to a solution'):
            plan_path(paper_task(rigid_model.arm), model=rigid_model, strategies=no_strategies,
                      monitor=monitor)
    assert (monitor.iteration, monitor.phase) == (0, '')


@pytest.mark.parametrize('time_weight', [0.0, 1.0])
def test_strategies_that_do_not_apply_leave_the_motion_unsolved(
        rigid_model: ArmModel, paper_task: TaskFactory, time_weight: float) -> None:
    plan = planned(rigid_model, paper_task(rigid_model.arm, time_weight=time_weight),
                   ('first', lambda *rest: None), ('second', lambda *rest: None))
    assert (plan.status, plan.strategy) == (PlanStatus.NOT_CONVERGED, '')
    assert why(plan) == 'no strategy applies to this motion'
    assert plan.iterations == 0
    assert unsolved(plan)


# A free duration


@pytest.mark.parametrize('quick', [False, True])
def test_free_duration_is_planned_by_slow_strategies_where_there_are_no_others(
        rigid_model: ArmModel, paper_task: TaskFactory, quick: bool) -> None:
    task = paper_task(rigid_model.arm, time_weight=10.0)
    plan = plan_path(task, model=rigid_model, strategies=[
        Strategy('alone', cold_start, quick=quick)])
    assert (plan.solved, plan.strategy) == (True, 'alone'), plan.message
    expected = plan_path(task, model=rigid_model)
    assert plan.task.duration == pytest.approx(expected.task.duration, rel=1e-6)
    assert plan.cost == pytest.approx(expected.cost, rel=SAME_COST)


def watched(strategy: Strategy, guesses: list[tuple[str, float]]) -> Strategy:
    """Return a strategy that notes the durations at which it is asked."""
    def attempt(problem: MotionProblem, solver: Solver) -> Attempt | None:
        guesses.append((strategy.name, problem.task.duration))
        return strategy.attempt(problem, solver)

    return replace(strategy, attempt=attempt)


def test_free_duration_comes_to_slow_strategies_after_longer_guesses_by_the_quick(
        rigid_model: ArmModel, paper_task: TaskFactory, result: CollocationResult) -> None:
    guesses: list[tuple[str, float]] = []
    slow, quick = Strategy('slow', cold_start), Strategy('quick', failed(result, 'lost'), True)
    plan = plan_path(paper_task(rigid_model.arm, time_weight=10.0), model=rigid_model,
                     strategies=[watched(each, guesses) for each in (slow, quick)])
    assert (plan.solved, plan.strategy) == (True, 'slow'), plan.message
    assert guesses == [('quick', factor) for factor in (1.0, 2.0, 4.0, 8.0)] + [('slow', 1.0)]


@pytest.mark.parametrize('quick', [False, True])
def test_free_duration_is_guessed_longer_where_the_first_guess_fails(
        rigid_model: ArmModel, paper_task: TaskFactory, result: CollocationResult,
        quick: bool) -> None:
    guesses: list[tuple[str, float]] = []

    def patient(problem: MotionProblem, solver: Solver) -> Attempt | None:
        enough = problem.task.duration > 1.5
        return (cold_start if enough else failed(result, 'too short'))(problem, solver)

    plan = plan_path(paper_task(rigid_model.arm, time_weight=10.0), model=rigid_model,
                     strategies=[watched(Strategy('alone', patient, quick), guesses)])
    assert (plan.solved, plan.strategy) == (True, 'alone'), plan.message
    assert guesses == [('alone', 1.0), ('alone', 2.0)]


@pytest.mark.parametrize('quick', [False, True])
def test_free_duration_is_never_refused_for_its_guess(
        rigid_model: ArmModel, paper_task: TaskFactory, result: CollocationResult,
        quick: bool) -> None:
    # what the guess forbids is no limit of the task
    limit = Strategy('limit', failed(result, 'too short', not_found=True, hopeless=True), quick)
    task = paper_task(rigid_model.arm, time_weight=10.0)
    plan = plan_path(task, model=rigid_model, strategies=[limit, Strategy('slow', cold_start)])
    assert (plan.solved, plan.strategy) == (True, 'slow'), plan.message
    alone = plan_path(task, model=rigid_model, strategies=[limit])
    assert (alone.status, why(alone)) == (PlanStatus.NOT_CONVERGED, 'limit: too short')


# Stopped, and out of limits

BY_IPOPT = ('direct collocation', 'kinds of motion')
# without Coulomb friction there is nothing to stop; see test_friction_homotopy
STOPPABLE = [each for each in CATALOGUE if each.name != 'homotopy in Coulomb friction']


@pytest.mark.parametrize('strategy', STOPPABLE, ids=[each.name for each in STOPPABLE])
def test_every_strategy_is_canceled_between_its_iterations(
        ei5_model: ArmModel, paper_task: TaskFactory,
        strategy: Strategy) -> None:
    task = paper_task(ei5_model.arm, w_2=10.0)
    if 'via' in strategy.name:
        task = replace(task, via_points=[ViaPoint(point=[0.55, 0.2], time=0.5)])
    for last in (0, 1, 3):
        monitor = Monitor()
        monitor.canceled = lambda count=last, watch=monitor: watch.iteration >= count
        plan = planned(ei5_model, task,
                       (strategy.name, strategy.attempt), monitor=monitor)
        assert (plan.status, plan.message) == (PlanStatus.CANCELED, 'canceled')
        # IPOPT asks after an iteration
        assert plan.iterations in (last, last + (strategy.name in BY_IPOPT))
        assert unsolved(plan)


@pytest.mark.parametrize('name', ['rigid', 'ei5'])
def test_cancel_is_obeyed_at_every_iteration_and_in_the_certificate(
        request: pytest.FixtureRequest, paper_task: TaskFactory, plan_of: PlanFactory,
        name: str) -> None:
    model = request.getfixturevalue(f'{name}_model')
    for last in range(plan_of(name).iterations + 1):
        monitor = Monitor()
        monitor.canceled = lambda count=last, watch=monitor: watch.iteration >= count
        plan = plan_path(paper_task(model.arm), model=model, monitor=monitor)
        assert (plan.status, plan.message) == (PlanStatus.CANCELED, 'canceled')
        assert plan.iterations == last
        assert unsolved(plan)


@pytest.fixture
def any_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Allow tolerances that no motion meets, which tasks refuse."""
    monkeypatch.setattr(task_module, 'MIN_TOLERANCE', 1e-100)


@pytest.mark.usefixtures('any_tolerance')
def test_cancel_is_obeyed_while_meshes_are_refined(rigid_model: ArmModel,
                                                   paper_task: TaskFactory) -> None:
    monitor = Monitor()
    monitor.canceled = lambda: monitor.phase == 'mesh refinement'
    plan = plan_path(paper_task(rigid_model.arm, tolerance=1e-40), model=rigid_model,
                     monitor=monitor)
    assert (plan.status, plan.message, plan.solved) == (PlanStatus.CANCELED, 'canceled', False)


def test_time_limit_is_obeyed(ei50_model: ArmModel, paper_task: TaskFactory) -> None:
    monitor = Monitor(time_limit=0.02)
    time.sleep(0.021)
    plan = plan_path(paper_task(ei50_model.arm), model=ei50_model, monitor=monitor)
    assert (plan.status, plan.message) == (PlanStatus.TIMEOUT, 'time limit reached')
    assert (plan.iterations, plan.planning_time > 0.02) == (0, True)
    assert unsolved(plan)


def test_mesh_limit_is_told(ei50_model: ArmModel, paper_task: TaskFactory) -> None:
    # 114 intervals are needed
    plan = planned(ei50_model, paper_task(ei50_model.arm),
                   ('cold start', cold_start), solver=Solver(SolverSettings(max_intervals=60)))
    assert plan.status is PlanStatus.NOT_CONVERGED
    assert unsolved(plan)
    assert why(plan).startswith('cold start: an error of ')
    assert why(plan).endswith('is left on 60 intervals, 1.0e-06 was asked for')


def test_solution_within_its_tolerance_needs_no_more_intervals(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, 5.5))
    result = cold_start(problem, Solver(SolverSettings(
        max_intervals=20, error_tolerance=0.05))).result
    assert result.errors.max() < 0.05
    assert result.converged, result.message


def test_no_mesh_is_larger_than_its_limit(ei50_model: ArmModel, paper_task: TaskFactory) -> None:
    lines: list[Progress] = []
    plan_path(paper_task(ei50_model.arm), model=ei50_model,
              solver=Solver(SolverSettings(intervals=20, max_intervals=20)),
              monitor=Monitor(report=lines.append))
    assert max(line.intervals for line in lines) <= 20


@pytest.mark.usefixtures('any_tolerance')
def test_tolerance_that_no_motion_meets_fails_the_certificate(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    lines: list[Progress] = []
    plan = plan_path(paper_task(rigid_model.arm, tolerance=1e-40), model=rigid_model,
                     monitor=Monitor(report=lines.append), search='fast')
    assert (plan.status, plan.solved) == (PlanStatus.CERTIFICATE_FAILED, False)
    assert plan.message.startswith('boundary error is ')
    assert plan.message.endswith(', but must be <= 1e-40')
    # the motion is kept for inspection, after two refinements
    assert plan.cost == pytest.approx(plan_of('rigid').cost, rel=SAME_COST)
    assert lines[-1].phase == 'mesh refinement'


@pytest.mark.parametrize('tolerance', [1e-3, 1.0])
def test_mesh_too_coarse_for_the_certificate_is_refined(
        rigid_model: ArmModel, paper_task: TaskFactory, tolerance: float) -> None:
    settings = SolverSettings(stages=2, intervals=4, error_tolerance=tolerance)
    plan = plan_path(paper_task(rigid_model.arm), model=rigid_model, solver=Solver(settings))
    assert plan.solved, plan.message
    assert 4 <= plan.mesh_intervals < 60


def test_all_failures_of_a_free_duration_are_told(
        rigid_model: ArmModel, paper_task: TaskFactory, result: CollocationResult) -> None:
    strategies = [Strategy('fast', failed(result, 'fast lost'), quick=True),
                  Strategy('slow', failed(result, 'slow lost'))]
    plan = plan_path(paper_task(rigid_model.arm, time_weight=1.0), model=rigid_model,
                     strategies=strategies)
    assert why(plan) == 'fast: fast lost; slow: slow lost'
    assert plan.strategy == 'fast, slow'


def using(share: float, asked: list[tuple[str, float]], name: str,
          last: CollocationResult | None = None) -> Attempting:
    """Return a strategy that takes so much work, and notes what it is given."""
    def attempt(problem: MotionProblem, solver: Solver) -> Attempt:
        monitor = solver.monitor
        asked.append((name, monitor.share if isinstance(monitor, LimitedMonitor) else math.inf))
        line = problem.straight_line(4, solver.settings.rule)
        taken = 0.0
        while taken < share and not monitor.exhausted:
            monitor.step(1.0, 100)
            taken += 100
        if taken >= share and last is not None:
            return Attempt(result=last)
        return Attempt(result=CollocationResult.failed(line, 'tired'),
                       not_found=monitor.exhausted)

    return attempt


def test_what_takes_long_is_put_off_and_tried_again_with_more(
        rigid_model: ArmModel, paper_task: TaskFactory, result: CollocationResult) -> None:
    asked: list[tuple[str, float]] = []
    plan = planned(rigid_model, paper_task(rigid_model.arm),
                   ('long', using(5e4, asked, 'long', result)),
                   ('fails', using(1e3, asked, 'fails')),
                   ('longer', using(1e9, asked, 'longer')))
    assert plan.solved
    assert plan.strategy == 'long'
    assert [name for name, _ in asked] == [
        'long', 'fails', 'longer', 'long', 'longer', 'long']  # what failed is not tried again
    shares = [share for name, share in asked if name == 'long']
    assert shares == sorted(shares)
    assert shares[0] < 5e4 <= shares[-1]


def test_strategy_that_was_cut_off_has_found_nothing_out(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    asked: list[tuple[str, float]] = []
    plan = planned(rigid_model, paper_task(rigid_model.arm), ('cut', using(5e4, asked, 'cut')))
    assert plan.status is PlanStatus.NOT_CONVERGED
    assert len(asked) > 1
    assert plan.message.count('cut: tired') == 1


def test_newtons_method_gives_up_when_its_share_is_used_up(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, 5.5))
    part = LimitedMonitor.of(Monitor(), 30.0)
    found = cold_start(problem, Solver(monitor=part)).result
    assert found.status is SolverStatus.NEWTON_FAILED
    assert 'after 2 iterations' in found.message
    assert part.iteration == 2  # on 20 intervals
    again = cold_start(problem, Solver(monitor=part)).result
    assert 'share of the work' in again.message
    assert part.iteration == 2
