"""Limits of payload and duration as ways to a plan, and as evidence that there is none."""

from __future__ import annotations

from collections.abc import Callable
import math

from factories import model_of, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base.progress import Monitor, Progress
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.limit_strategies import (
    continue_in_duration,
    continue_in_payload,
)
from flex_planner.planning.strategies.strategy import Attempt
from known_limits import HEAVIEST, pendulum, SHORTEST
import numpy as np
from plan_checks import problem_of, stopped_in
import pytest

EVIDENCE = [
    ('rigid', {'payload_mass': 5.86}, 'continuation in payload',
     'the arm carries at most 5.855 kg from start to goal in 1 s, and 5.86 kg were asked for'),
    ('ei5', {'payload_mass': 20.0}, 'continuation in payload',
     'the arm carries at most 5.742 kg from start to goal in 1 s, and 20 kg were asked for'),
    ('rigid', {'duration': 0.3}, 'continuation in duration',
     'the motion takes at least 0.6421 s with 1 kg, and 0.3 s were asked for'),
    ('ei5', {'duration': 0.3}, 'continuation in duration',
     'the motion takes at least 0.6495 s with 1 kg, and 0.3 s were asked for')]


@pytest.mark.parametrize(('name', 'changes', 'strategy', 'evidence'), EVIDENCE,
                         ids=[f'{name} {changes}' for name, changes, *_ in EVIDENCE])
def test_impossible_motion_is_called_so_with_its_limit(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str,
        changes: dict[str, float], strategy: str, evidence: str) -> None:
    model = model_of(request, name)
    plan = plan_path(paper_task(model.arm, **changes), model=model)
    assert (plan.status, plan.solved) == (PlanStatus.INFEASIBLE, False)
    assert plan.message.startswith(f'{evidence} (the price of more has grown ')
    assert plan.status.value == 'impossible within the limits of the motors'
    assert (plan.solution, plan.cost, plan.mesh_intervals) == (None, math.inf, 0)
    assert plan.strategy == strategy
    with pytest.raises(ValueError, match='the plan has no solution: the '):
        plan.uniform_samples(2)


@pytest.mark.parametrize('share', [0.99, 0.999, 0.9999])
@pytest.mark.parametrize('name', HEAVIEST)
def test_motion_next_to_its_limit_is_solved(request: pytest.FixtureRequest,
                                            paper_task: TaskFactory, name: str,
                                            share: float) -> None:
    model = model_of(request, name)
    for changes in ({'payload_mass': share * HEAVIEST[name]},
                    {'duration': SHORTEST[name] / share}):
        plan = plan_path(paper_task(model.arm, **changes), model=model)
        assert plan.status is PlanStatus.SOLVED, plan.message


@pytest.mark.parametrize('name', HEAVIEST)
@pytest.mark.parametrize('search', [continue_in_payload, continue_in_duration])
def test_feasible_motion_is_never_called_impossible(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str,
        search: Callable[..., Attempt | None]) -> None:
    model = model_of(request, name)
    for share in (0.5, 0.99, 0.999, 0.9999):
        by_mass = search is continue_in_payload
        task = paper_task(model.arm, share * HEAVIEST[name] if by_mass else 1.0,
                          duration=1.0 if by_mass else SHORTEST[name] / share)
        attempt = search(problem_of(model, task), Solver())
        # the rigid arm makes it in time: then there is no search in time
        assert attempt is None or attempt.evidence == ''
        assert attempt is not None or (name, search) == ('ei5', continue_in_duration)
        if attempt is not None:
            assert attempt.result.converged


def test_motion_a_hundred_thousandth_from_its_limit_is_not_called_impossible(
        ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    # the cold start solves 5.7415 kg, and 5.74182 kg are on the way to the limit
    problem = problem_of(ei5_model, paper_task(ei5_model.arm, 5.74177))
    attempt = continue_in_payload(problem, Solver())
    assert attempt is not None
    assert attempt.evidence == ''


def test_swing_that_another_motion_makes_is_not_called_impossible() -> None:
    # a pendulum whose motor is too weak to lift it: it swings back first
    arm = pendulum(3.0)
    plan = None
    for T, mass in ((2.5, 0.5), (2.4, 0.45), (2.4, 0.3)):
        task = Task(arm=arm, start_positions=[-np.pi / 2], goal_positions=[np.pi / 2],
                    duration=T, payload_mass=mass)
        plan = plan_path(task, start_from=plan)
        assert plan.solved, plan.message
    alone = plan_path(task)
    assert alone.status is not PlanStatus.INFEASIBLE, alone.message


def test_limit_of_one_kind_of_swing_is_no_evidence() -> None:
    # 0.3 kg take 1.8691 s by another; the limit that is found in 2 s is 0.2591 kg
    arm = pendulum(3.0)
    plan = plan_path(Task(arm=arm, start_positions=[-np.pi / 2], goal_positions=[np.pi / 2],
                          duration=2.0, payload_mass=0.3), monitor=Monitor(time_limit=10))
    assert plan.status is not PlanStatus.INFEASIBLE, plan.message


def test_duration_tried_on_the_way_may_be_too_long() -> None:
    link = Link(length=0.5, linear_density=6.0)
    arm = Arm(name='hanging', links=(link, link), joints=(Joint(), Joint()), gravity=[0, -9.81])
    plan = plan_path(Task(arm=arm, start_positions=[-1.5, -0.5], goal_positions=[-0.5, 0.5],
                          duration=100.0))
    assert plan.status in PlanStatus


# Stopped


@pytest.mark.parametrize(('changes', 'phase'), [
    ({'payload_mass': 20.0}, 'continuation in payload'),
    ({'duration': 0.3}, 'continuation in duration')])
@pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])
def test_search_for_a_limit_is_stopped(
        rigid_model: ArmModel, paper_task: TaskFactory, changes: dict[str, float], phase: str,
        status: PlanStatus) -> None:
    for patience in (0, 1, 5, 20):
        lines: list[Progress] = []
        monitor = stopped_in(phase, status, patience)
        monitor.report = lines.append
        plan = plan_path(paper_task(rigid_model.arm, **changes), model=rigid_model,
                         monitor=monitor)
        assert (plan.status, plan.strategy) == (status, phase)
        assert plan.solution is None
        assert plan.iterations == len(lines)
        assert sum(line.phase == phase for line in lines) <= patience + 1
