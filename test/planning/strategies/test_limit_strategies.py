"""Limits of payload and duration as ways to a plan, and what is said where they end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math

from factories import model_of, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base.progress import Progress
from flex_planner.collocation import Solver, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.limit_strategies import (
    continue_in_duration,
    continue_in_payload,
)
from flex_planner.planning.strategies.strategy import Attempt, Strategy
from kinds_support import assert_says
from known_limits import HEAVIEST, pendulum, SHORTEST
import numpy as np
from plan_checks import problem_of, stopped_in
import pytest

TOO_HEAVY, TOO_SHORT = {'payload_mass': 20.0}, {'duration': 0.3}
# the arm made rigid is explored, at a price at which it carries a thousandth less than its most
NOT_FOUND = [
    ('rigid', TOO_HEAVY, 'no motion with 20 kg in 1 s was found from 16 starts; the heaviest '
     'payload found in 1 s is 5.849 kg, the shortest duration found with 20 kg is 1.648 s'),
    ('ei5', TOO_HEAVY, 'no motion with 20 kg in 1 s was found from 16 starts; the heaviest '
     'payload found in 1 s is 5.849 kg, the shortest duration found with 20 kg is 1.648 s (of the '
     'arm made rigid)'),
    # 0.3 s are proved impossible for the rigid arm
    ('rigid', {'duration': 0.5}, 'no motion with 1 kg in 0.5 s was found from 16 starts; the '
     'shortest duration found with 1 kg is 0.6434 s'),
    ('ei5', TOO_SHORT, 'no motion with 1 kg in 0.3 s was found from 16 starts; the shortest '
     'duration found with 1 kg is 0.6434 s (of the arm made rigid)')]


@pytest.mark.parametrize(('name', 'changes', 'found'), NOT_FOUND,
                         ids=[f'{name} {changes}' for name, changes, _ in NOT_FOUND])
def test_motion_that_is_not_found_is_called_so_with_what_was_found(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str,
        changes: dict[str, float], found: str) -> None:
    model = model_of(request, name)
    plan = plan_path(paper_task(model.arm, **changes), model=model)
    assert (plan.status, plan.solved) == (PlanStatus.NOT_FOUND, False)
    assert_says(plan.message, f'{found}. This does not show that there is none')
    assert (plan.solution, plan.cost, plan.mesh_intervals) == (None, math.inf, 0)
    assert plan.strategy == 'kinds of motion'
    with pytest.raises(ValueError, match='the plan has no solution: no motion with '):
        plan.uniform_samples(2)


@pytest.mark.parametrize('name', HEAVIEST)
def test_motion_just_beyond_its_limit_is_not_found_by_any_strategy(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str) -> None:
    # so near that others are tried after the exploration
    model = model_of(request, name)
    plan = plan_path(paper_task(model.arm, 5.86), model=model)
    assert plan.status is PlanStatus.NOT_FOUND
    told = dict(each.split(': ', 1) for each in plan.message.split('; ') if ': ' in each)
    assert told.keys() == set(plan.strategy.split(', '))
    assert told['kinds of motion'] == 'no motion with 5.86 kg in 1 s was found from 16 starts'
    assert 'This does not show that there is none' in plan.message
    assert told['continuation in payload'] == (
        f'motions of the kind that was followed carry at most {HEAVIEST[name]:.4g} kg in 1 s, '
        'and 5.86 kg were asked for')


ENDED = [
    ('rigid', continue_in_payload, {'payload_mass': 5.86},
     'carry at most 5.855 kg in 1 s, and 5.86 kg were asked for'),
    ('ei5', continue_in_payload, TOO_HEAVY,
     'carry at most 5.742 kg in 1 s, and 20 kg were asked for'),
    ('rigid', continue_in_duration, TOO_SHORT,
     'take at least 0.6421 s with 1 kg, and 0.3 s were asked for'),
    ('ei5', continue_in_duration, TOO_SHORT,
     'take at least 0.6495 s with 1 kg, and 0.3 s were asked for')]


@pytest.mark.parametrize(('name', 'search', 'changes', 'end'), ENDED,
                         ids=[f'{name} {changes}' for name, _, changes, _ in ENDED])
def test_continuation_that_ends_before_the_task_tells_where_and_decides_nothing(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str,
        search: Callable[..., Attempt | None], changes: dict[str, float], end: str) -> None:
    model = model_of(request, name)
    attempt = search(problem_of(model, paper_task(model.arm, **changes)), Solver())
    assert attempt is not None
    assert attempt.result.message == f'motions of the kind that was followed {end}'
    assert attempt.result.status is SolverStatus.NEWTON_FAILED
    assert not (attempt.decides or attempt.not_found)


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
def test_feasible_motion_is_reached_on_the_way_to_its_limit(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str,
        search: Callable[..., Attempt | None]) -> None:
    model = model_of(request, name)
    for share in (0.5, 0.99, 0.999, 0.9999):
        by_mass = search is continue_in_payload
        task = paper_task(model.arm, share * HEAVIEST[name] if by_mass else 1.0,
                          duration=1.0 if by_mass else SHORTEST[name] / share)
        attempt = search(problem_of(model, task), Solver())
        assert attempt is not None
        assert attempt.result.converged, attempt.result.message


def test_motion_a_hundred_thousandth_from_its_limit_is_not_said_to_be_beyond_it(
        ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    # the cold start solves 5.7415 kg, and 5.74182 kg are on the way to the limit
    problem = problem_of(ei5_model, paper_task(ei5_model.arm, 5.74177))
    attempt = continue_in_payload(problem, Solver())
    assert attempt is not None
    assert 'carry at most' not in attempt.result.message


def test_swing_of_a_motor_that_is_too_weak_to_lift_is_found() -> None:
    # a pendulum whose motor is too weak to lift it: it swings back first
    arm = pendulum(3.0)
    plan = None
    for T, mass in ((2.5, 0.5), (2.4, 0.45), (2.4, 0.3)):
        task = Task(arm=arm, start_positions=[-np.pi / 2], goal_positions=[np.pi / 2],
                    duration=T, payload_mass=mass)
        plan = plan_path(task, start_from=plan)
        assert plan.solved, plan.message
    alone = plan_path(task)
    assert alone.solved, alone.message
    assert alone.cost < 1.001 * plan.cost


def test_swing_beyond_the_limit_of_the_kind_that_is_followed_is_found() -> None:
    # a continuation in payload ends at 0.2591 kg in 2 s; 0.3 kg take 1.8691 s by another kind
    arm = pendulum(3.0)
    task = Task(arm=arm, start_positions=[-np.pi / 2], goal_positions=[np.pi / 2],
                duration=2.0, payload_mass=0.3)
    attempt = continue_in_payload(problem_of(ArmModel.of(arm), task), Solver())
    assert attempt is not None
    assert 'carry at most 0.2591 kg in 2 s' in attempt.result.message
    plan = plan_path(task)
    assert plan.solved, plan.message


def test_duration_tried_on_the_way_may_be_too_long() -> None:
    link = Link(length=0.5, linear_density=6.0)
    arm = Arm(name='hanging', links=(link, link), joints=(Joint(), Joint()), gravity=[0, -9.81])
    task = Task(arm=arm, start_positions=[-1.5, -0.5], goal_positions=[-0.5, 0.5], duration=100.0)
    # 300 s are tried, and no more: 1000 s are the longest
    tried = continue_in_duration(problem_of(ArmModel.of(arm), task), Solver())
    assert tried is not None
    assert not tried.decides
    longer = replace(task, duration=400.0)
    assert continue_in_duration(problem_of(ArmModel.of(arm), longer), Solver()) is None


# Stopped


@pytest.mark.parametrize(('changes', 'search', 'phase'), [
    (TOO_HEAVY, continue_in_payload, 'continuation in payload'),
    ({'duration': 0.6}, continue_in_duration, 'continuation in duration')])
@pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])
def test_search_for_a_limit_is_stopped(
        rigid_model: ArmModel, paper_task: TaskFactory, changes: dict[str, float],
        search: Callable[..., Attempt | None], phase: str, status: PlanStatus) -> None:
    for patience in (0, 1, 5, 20):
        lines: list[Progress] = []
        monitor = stopped_in(phase, status, patience)
        monitor.report = lines.append
        plan = plan_path(paper_task(rigid_model.arm, **changes), model=rigid_model,
                         monitor=monitor, strategies=[Strategy(phase, search)])
        assert (plan.status, plan.strategy) == (status, phase)
        assert plan.solution is None
        assert plan.iterations == len(lines)
        assert sum(line.phase == phase for line in lines) <= patience + 1
