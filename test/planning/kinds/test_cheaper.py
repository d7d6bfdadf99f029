"""Cheaper kinds of motion than that of a plan: found, never dearer, and within a budget."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from counter_examples import CHEAPEST, level_task, lifting_task, STRAIGHT
from factories import PlanFactory, TaskFactory
from flex_planner.base.progress import Monitor, Progress
from flex_planner.collocation import CollocationResult, Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning import plan_problem as planning
from flex_planner.planning.kinds import cheaper as module
from flex_planner.planning.kinds import newton_explorer
from flex_planner.planning.kinds.cheaper import CheapestMotion, find_cheaper
from flex_planner.planning.kinds.newton_explorer import as_kind, newton_budget
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.initial_guesses import cold_start, warm_start
from plan_checks import problem_of, stopped_in
import pytest

# of S12 with payloads [kg] at which a straight start leads to a dearer kind: its J and the other
DEARER = {0.5: (0.4746, 0.4690), 1.12: (0.9792, 0.7784)}
SWING = 'joint 2 swings back '


def s12(payload_mass: float, **changes: Any) -> MotionProblem:
    task = level_task('S12', payload_mass, **changes)
    return problem_of(ArmModel.of(task.arm), task)


def solved(problem: MotionProblem, solver: Solver | None = None) -> CollocationResult:
    result = cold_start(problem, solver or Solver()).result
    assert result.converged, result.message
    return result


def cost_of(problem: MotionProblem, result: CollocationResult) -> float:
    return integrate_totals(problem, result.solution).cost


@pytest.mark.parametrize('payload', DEARER)
def test_cheaper_kind_is_found(payload: float) -> None:
    problem, (dear, cheap) = s12(payload), DEARER[payload]
    first = solved(problem)
    found = find_cheaper(problem, first, Solver())
    assert cost_of(problem, first) == pytest.approx(dear, rel=1e-3)
    assert cost_of(problem, found.result) == pytest.approx(cheap, rel=1e-3)
    # its own kind is told first, then the one that was given
    own, *others = found.kinds
    assert own.sentence.startswith(SWING)
    assert own.value == cost_of(problem, found.result)
    assert cost_of(problem, first) in [other.value for other in others]
    assert 8 <= found.starts <= 20


def test_thorough_search_takes_all_starts_and_is_no_worse() -> None:
    # with 1 kg the dearer kind comes twice first
    normal, thorough = (plan_path(level_task('S12', 1.0), search=search)
                        for search in ('normal', 'thorough'))
    assert thorough.solved, thorough.message
    assert normal.starts <= 20 < 48 <= thorough.starts
    assert thorough.cost == pytest.approx(0.7138, rel=1e-3)
    assert thorough.cost <= normal.cost * (1 + 1e-6)
    assert thorough.kinds[0].sentence.startswith(SWING)


def test_cheapest_kind_is_kept(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    first = solved(plan.problem)
    found = find_cheaper(plan.problem, first, Solver())
    assert found.result is first
    (own,) = found.kinds
    assert own.sentence == 'every joint goes straight to its goal'
    assert own.met > 1


@pytest.mark.parametrize('payload', DEARER)
def test_plan_tells_the_kinds_among_which_it_is_the_cheapest(payload: float) -> None:
    plan, (dear, cheap) = plan_path(level_task('S12', payload)), DEARER[payload]
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(cheap, rel=1e-3)
    others = ', '.join(f'{kind.value:.4g}' for kind in plan.kinds[1:])
    assert plan.message == (
        f'solved and certified; the cheapest of {len(plan.kinds)} kinds of motion found from '
        f'{plan.starts} starts (J = {plan.cost:.4g}; of the others {others})')
    assert f'{dear:.3g}' in [f'{kind.value:.3g}' for kind in plan.kinds[1:]]
    fast = plan_path(plan.task, search='fast')
    assert (fast.cost, fast.kinds, fast.starts) == (pytest.approx(dear, rel=1e-3), (), 1)


def test_kind_that_was_met_is_a_start() -> None:
    plan = plan_path(level_task('S12', 1.12))
    again = plan_path(plan.task, start_from=plan.kinds[1])
    assert (again.solved, again.strategy) == (True, 'warm start'), again.message
    assert again.cost == pytest.approx(plan.kinds[1].value, rel=1e-6)
    # a given motion is not left for another kind
    assert again.starts == 1


def test_counter_example_with_a_link_that_bends_swings_back_first() -> None:
    plan, fast = (plan_path(lifting_task(), search=search) for search in ('normal', 'fast'))
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(CHEAPEST, abs=5e-4)
    assert plan.kinds[0].sentence == 'joint 2 swings back 118 deg first'
    assert fast.solved, fast.message
    assert fast.cost == pytest.approx(STRAIGHT, abs=5e-4)
    # values of the others are those of the arm made rigid
    assert plan.kinds[1].value == pytest.approx(fast.cost, rel=2e-3)


def test_free_duration_is_that_of_the_cheaper_kind() -> None:
    task = level_task('S12', 1.12, time_weight=0.05)
    plan, fast = (plan_path(task, search=search) for search in ('normal', 'fast'))
    assert plan.solved, plan.message
    assert fast.solved, fast.message
    assert plan.cost < 0.99 * fast.cost
    # no other duration is cheaper: dJ/dt = -H
    samples = plan.uniform_samples(11)
    assert samples.hamiltonian == pytest.approx([-0.05] * 11, rel=1e-4)


def test_what_was_explored_for_the_plan_is_not_explored_again() -> None:
    lines = list[Progress]()
    plan = plan_path(level_task('S12', 1.2), monitor=Monitor(report=lines.append))
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(0.8235, rel=1e-3)
    assert (plan.strategy, plan.starts) == ('kinds of motion', 16)
    exploring = {line.phase for line in lines if line.phase.startswith('kinds of motion, start')}
    assert all(phase.endswith(' of 16') for phase in exploring)


def test_ipopt_goes_on_where_newtons_method_seldom_converges() -> None:
    plan, thorough = (plan_path(level_task('S1', 20.0), search=search)
                      for search in ('normal', 'thorough'))
    assert plan.solved, plan.message
    assert plan.starts == 8 + 4
    assert plan.cost == pytest.approx(thorough.cost, rel=1e-4)


# Never dearer


def pretend(monkeypatch: pytest.MonkeyPatch, problem: MotionProblem,
            result: CollocationResult, **changes: Any) -> None:
    """Let the exploration find a motion at half of what everything else costs."""
    kind = as_kind(problem, result.solution)
    motion = replace(kind.motion, value=0.5 * DEARER[1.12][1], **changes)
    monkeypatch.setattr(module, 'explore_from_plan', lambda *rest, **options: ([motion], 2))


def test_motion_that_is_dearer_than_it_seemed_is_not_taken(
        monkeypatch: pytest.MonkeyPatch) -> None:
    problem = s12(1.12)
    dear = solved(problem)
    cheap = find_cheaper(problem, dear, Solver()).result
    pretend(monkeypatch, problem, dear)
    assert find_cheaper(problem, cheap, Solver()).result is cheap
    pretend(monkeypatch, problem, cheap)
    assert find_cheaper(problem, dear, Solver()).result is not dear


def test_motion_that_newtons_method_does_not_reach_is_not_taken(
        monkeypatch: pytest.MonkeyPatch) -> None:
    problem = s12(1.12)
    dear = solved(problem)
    cheap = find_cheaper(problem, dear, Solver()).result
    solver = Solver().patient(1)
    pretend(monkeypatch, problem, cheap)
    assert find_cheaper(problem, dear, solver).result is not dear
    far = problem.straight_line(20, solver.settings.rule)
    pretend(monkeypatch, problem, cheap, solution=far)
    assert find_cheaper(problem, dear, solver).result is dear


def test_plan_is_the_first_one_if_the_cheaper_is_not_certified(
        monkeypatch: pytest.MonkeyPatch) -> None:
    certify, calls = planning.certify, []

    def certified(*data: Any, **options: Any) -> Any:
        calls.append(data)
        certificate = certify(*data, **options)
        return certificate if len(calls) == 1 else replace(certificate, boundary_error=1.0)

    monkeypatch.setattr(planning, 'certify', certified)
    plan = plan_path(level_task('S12', 1.12))
    assert len(calls) > 1
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(DEARER[1.12][0], rel=1e-3)


def test_plan_is_the_first_one_if_the_other_is_dearer(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = s12(1.12)
    dear = solved(problem)
    cheap = find_cheaper(problem, dear, Solver())
    wrong = replace(cheap, result=dear)
    monkeypatch.setattr(planning, 'find_cheaper', lambda *rest: wrong)
    plan = plan_path(problem.task, strategies=[
        warm_start(cheap.result.solution, 'the cheap one')])
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(DEARER[1.12][1], rel=1e-3)


def test_cheaper_motion_is_the_plan_if_the_first_one_is_not_certified(
        monkeypatch: pytest.MonkeyPatch) -> None:
    certify = planning.certify

    def certified(problem: MotionProblem, result: CollocationResult, *others: Any,
                  **options: Any) -> Any:
        certificate = certify(problem, result, *others, **options)
        dear = cost_of(problem, result) > 0.9
        return replace(certificate, boundary_error=1.0) if dear else certificate

    monkeypatch.setattr(planning, 'certify', certified)
    assert plan_path(level_task('S12', 1.12), search='fast').status is (
        PlanStatus.CERTIFICATE_FAILED)
    plan = plan_path(level_task('S12', 1.12))
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(DEARER[1.12][1], rel=1e-3)


# Where it does not apply, and its budget


def test_goal_at_a_price_is_of_one_kind(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    price = [1e4, 1e4]
    problem = problem_of(rigid_model, paper_task(rigid_model.arm, goal_position_weights=price))
    first, monitor = solved(problem), Monitor()
    found = find_cheaper(problem, first, Solver(monitor=monitor))
    assert (found.result, len(found.kinds), found.starts) == (first, 1, 1)
    assert monitor.iteration == 0


@pytest.mark.parametrize('budget', [0, 1, 60])
def test_budget_of_a_rigid_arm_is_kept(monkeypatch: pytest.MonkeyPatch, budget: int) -> None:
    monkeypatch.setattr(newton_explorer, '_BUDGET', budget)
    problem = s12(1.12)
    first, lines = solved(problem), list[Progress]()
    found = find_cheaper(problem, first, Solver(monitor=Monitor(report=lines.append)))
    exploring = [line.phase for line in lines if line.phase.startswith('kinds of motion')]
    # no start begins beyond the budget
    last = exploring.count(exploring[-1]) if exploring else 0
    assert len(exploring) - last < max(budget, 1)
    assert found.starts == len(set(exploring)) + 1
    assert found.starts < 12


def test_budget_of_an_arm_that_bends_goes_with_what_its_plan_took(
        ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    problem, monitor = problem_of(ei5_model, paper_task(ei5_model.arm)), Monitor()
    first = solved(problem)
    found = find_cheaper(problem, first, Solver(monitor=monitor))
    budget = newton_budget(problem, first)
    assert found.result is first
    # no start begins beyond the budget, and one takes 30 iterations on each of 3 meshes at most
    assert 0 < monitor.iteration < budget + 90
    assert found.starts > 1
    assert newton_budget(problem, replace(first, iterations=0)) < budget


# Stopped


def explored(monitor: Monitor) -> CheapestMotion:
    problem = s12(1.12)
    return find_cheaper(problem, solved(problem), Solver(monitor=monitor))


@pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])
def test_search_that_is_stopped_returns_the_best_so_far(status: PlanStatus) -> None:
    whole = explored(Monitor())
    monitor = stopped_in('kinds of motion, start 3', status)
    found = explored(monitor)
    assert found.starts == 3 < whole.starts
    assert monitor.phase == 'kinds of motion, start 3'
    assert found.result.converged


def test_time_that_is_up_while_others_are_looked_for_leaves_the_plan() -> None:
    monitor = stopped_in('kinds of motion, start 3', PlanStatus.TIMEOUT)
    plan = plan_path(level_task('S12', 1.12), monitor=monitor)
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(DEARER[1.12][0], rel=1e-3)
    assert plan.starts == 3


def test_time_that_is_up_while_ipopt_looks_for_others_leaves_the_plan() -> None:
    monitor = stopped_in('kinds of motion, start 18', PlanStatus.TIMEOUT)
    plan = plan_path(level_task('S12', 1.12), monitor=monitor)
    assert plan.solved, plan.message
    assert plan.starts == 18


def test_cancellation_while_others_are_looked_for_is_obeyed() -> None:
    monitor = Monitor()
    monitor.canceled = lambda: monitor.phase.startswith('kinds of motion, start 3')
    plan: Plan = plan_path(level_task('S12', 1.12), monitor=monitor)
    assert (plan.status, plan.solution) == (PlanStatus.CANCELED, None)
