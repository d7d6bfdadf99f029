"""Strategies in turn: which is reported, how planning is stopped, and how it meets its limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
import math
import time
from typing import Any

from flex_planner.base.progress import Monitor, Progress
from flex_planner.collocation import CollocationResult, SolverSettings, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Certificate, Plan, PlanStatus
from flex_planner.planning.plan_path import LADDER, plan_path
from flex_planner.planning.strategies.initial_guesses import Attempt, cold_start, Strategy
from plan_checks import problem_of, SAME_COST
import pytest

PlanFactory = Callable[..., Plan]
TaskFactory = Callable[..., Task]


def failed(result: CollocationResult, message: str, evidence: str = '') -> Strategy:
    """Return a strategy that fails."""
    attempt = Attempt(result=replace(result, status=SolverStatus.NEWTON_FAILED, message=message),
                      evidence=evidence)
    return lambda problem, settings, monitor: attempt


@pytest.fixture
def result(rigid_model: ArmModel, paper_task: TaskFactory) -> CollocationResult:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm))
    return cold_start(problem, SolverSettings(), Monitor()).result


def planned(monkeypatch: pytest.MonkeyPatch, model: ArmModel, task: Task,
            *rungs: tuple[str, Strategy], **others: Any) -> Plan:
    monkeypatch.setattr('flex_planner.planning.plan_path.LADDER', rungs)
    return plan_path(task, model=model, **others)


def unsolved(plan: Plan) -> bool:
    """Return whether a plan says nothing that could pass for a solution."""
    numbers = [plan.cost, plan.effort, plan.energy,
               *(getattr(plan.certificate, entry.name) for entry in fields(Certificate))]
    return (not plan.solved and plan.solution is None and plan.mesh_intervals == 0
            and all(number == math.inf for number in numbers))


def test_ladder_goes_on_to_the_first_that_solves(
        monkeypatch: pytest.MonkeyPatch, rigid_model: ArmModel, paper_task: TaskFactory,
        result: CollocationResult) -> None:
    plan = planned(monkeypatch, rigid_model, paper_task(rigid_model.arm),
                   ('first', failed(result, 'lost')), ('nothing', lambda *rest: None),
                   ('second', cold_start), ('third', failed(result, 'not tried')))
    assert (plan.solved, plan.strategy) == (True, 'second')


def test_all_failures_are_told_with_their_names(
        monkeypatch: pytest.MonkeyPatch, rigid_model: ArmModel, paper_task: TaskFactory,
        result: CollocationResult) -> None:
    plan = planned(monkeypatch, rigid_model, paper_task(rigid_model.arm),
                   ('first', failed(result, 'lost')), ('nothing', lambda *rest: None),
                   ('second', failed(result, 'lost too')))
    assert (plan.status, plan.strategy) == (PlanStatus.NOT_CONVERGED, 'first, second')
    assert plan.message == 'first: lost; second: lost too'
    assert 'does not show that the motion is impossible' in plan.status.value
    assert unsolved(plan)
    with pytest.raises(ValueError, match='the plan has no solution: first: lost'):
        plan.uniform_samples(2)


def test_evidence_ends_the_ladder(
        monkeypatch: pytest.MonkeyPatch, rigid_model: ArmModel, paper_task: TaskFactory,
        result: CollocationResult) -> None:
    plan = planned(monkeypatch, rigid_model, paper_task(rigid_model.arm),
                   ('first', failed(result, 'lost', 'too much')), ('second', cold_start))
    assert (plan.status, plan.strategy) == (PlanStatus.INFEASIBLE, 'first')
    assert plan.message == 'too much'
    assert unsolved(plan)


def test_monitor_hears_the_name_of_each_strategy(
        monkeypatch: pytest.MonkeyPatch, rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    lines: list[Progress] = []

    def hasty(problem: MotionProblem, settings: SolverSettings, monitor: Monitor) -> Attempt:
        return cold_start(problem, replace(settings, max_iterations=1), monitor)

    plan = planned(monkeypatch, rigid_model, paper_task(rigid_model.arm, 5.8), ('first', hasty),
                   ('second', hasty), ('third', cold_start), monitor=Monitor(report=lines.append))
    assert list(dict.fromkeys(line.phase for line in lines)) == ['first', 'second', 'third']
    assert len(lines) == lines[-1].iteration == plan.iterations


# Stopped, and out of limits


@pytest.mark.parametrize(('label', 'strategy'), LADDER, ids=[label for label, _ in LADDER])
def test_every_strategy_is_canceled_between_its_iterations(
        monkeypatch: pytest.MonkeyPatch, ei5_model: ArmModel, paper_task: TaskFactory,
        label: str, strategy: Strategy) -> None:
    for last in (0, 1, 3):
        monitor = Monitor()
        monitor.canceled = lambda count=last, watch=monitor: watch.iteration >= count
        plan = planned(monkeypatch, ei5_model, paper_task(ei5_model.arm, w_2=10.0),
                       (label, strategy), monitor=monitor)
        assert (plan.status, plan.message) == (PlanStatus.CANCELED, 'canceled')
        # IPOPT asks after an iteration
        assert plan.iterations in (last, last + (label == 'direct collocation'))
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


def test_mesh_limit_is_told(monkeypatch: pytest.MonkeyPatch, ei50_model: ArmModel,
                            paper_task: TaskFactory) -> None:
    # 114 intervals are needed
    plan = planned(monkeypatch, ei50_model, paper_task(ei50_model.arm),
                   ('cold start', cold_start), settings=SolverSettings(max_intervals=60))
    assert plan.status is PlanStatus.NOT_CONVERGED
    assert unsolved(plan)
    assert plan.message.startswith('cold start: an error of ')
    assert plan.message.endswith('is left on 60 intervals, 1.0e-06 was asked for')


def test_solution_within_its_tolerance_needs_no_more_intervals(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, 5.5))
    result = cold_start(problem, SolverSettings(max_intervals=20, error_tolerance=0.05),
                        Monitor()).result
    assert result.errors.max() < 0.05
    assert result.converged, result.message


def test_no_mesh_is_larger_than_its_limit(ei50_model: ArmModel, paper_task: TaskFactory) -> None:
    lines: list[Progress] = []
    plan_path(paper_task(ei50_model.arm), model=ei50_model,
              settings=SolverSettings(intervals=20, max_intervals=20),
              monitor=Monitor(report=lines.append))
    assert max(line.intervals for line in lines) <= 20


def test_tolerance_that_no_motion_meets_fails_the_certificate(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    lines: list[Progress] = []
    plan = plan_path(paper_task(rigid_model.arm, tolerance=1e-40), model=rigid_model,
                     monitor=Monitor(report=lines.append))
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
    plan = plan_path(paper_task(rigid_model.arm), model=rigid_model, settings=settings)
    assert plan.solved, plan.message
    assert 4 <= plan.mesh_intervals < 60
