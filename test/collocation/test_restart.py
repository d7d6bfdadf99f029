"""Problems like one that is solved: on its mesh, with errors that are known from it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bvp_problems import Case, CASES, mc_20, second_order, System
from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    CollocationResult,
    KnownSolution,
    restart,
    solve,
    SolverSettings,
    SolverStatus,
)
from flex_planner.collocation.mesh import are_on_nodes
from flex_planner.collocation.restart import solve_near
import numpy as np
import pytest

SETTINGS = SolverSettings(stages=3, intervals=6, error_tolerance=1e-6)
LOOSE = replace(SETTINGS, error_tolerance=1e-4)


def bratu(strength: float) -> System:
    """Return y'' = -strength exp(y), y(0) = y(1) = 0."""
    return second_order(lambda t, y, v: -strength * np.exp(y), 0, 0)


def kink(end: float) -> System:
    """Return y'' = |y|, whose zero moves with the value at the end."""
    return second_order(lambda t, y, v: np.where(np.real(y) < 0, -y, y), -np.sin(1), end,
                        switches_of=lambda t, z: [z[0]])


def known(result: CollocationResult) -> KnownSolution:
    return KnownSolution(result.solution, result.errors, result.residual, result.switches)


def solved(problem: System, case: Case) -> KnownSolution:
    result = solve(problem, case.start(SETTINGS), SETTINGS)
    assert result.converged
    return known(result)


def true_errors(problem: System, result: CollocationResult) -> Any:
    """Return the errors at the nodes against a much more exact solution."""
    exact = solve(problem, result.solution, replace(SETTINGS, stages=8, error_tolerance=1e-11))
    assert exact.converged
    z = exact.solution(result.solution.mesh)
    return (np.abs(result.solution.nodes - z) / np.maximum(np.abs(z).max(axis=0), 1)).max(axis=0)


@pytest.fixture
def no_estimates(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nothing be solved from the beginning."""
    def refuse(*given: Any, **more: Any) -> None:
        raise AssertionError('solved from the beginning')

    monkeypatch.setattr(restart, 'solve', refuse)


@pytest.mark.usefixtures('no_estimates')
@pytest.mark.parametrize('strength', [1.0, 1.01, 0.9])
def test_near_problem_takes_one_system_on_the_same_mesh(strength: float) -> None:
    first = solved(bratu(1.0), CASES['bratu, lower'])
    result = solve_near(bratu(strength), first, LOOSE)
    assert result.status is SolverStatus.CONVERGED
    assert (result.iterations, result.meshes) == (1, 1)
    assert np.array_equal(result.solution.mesh, first.solution.mesh)
    assert result.solution.rule.stages == SETTINGS.stages + 1


@pytest.mark.parametrize('strength', [1.01, 1.3, 0.5])
def test_errors_are_no_larger_than_is_said(strength: float) -> None:
    first = solved(bratu(1.0), CASES['bratu, lower'])
    result = solve_near(bratu(strength), first, LOOSE)
    assert (true_errors(bratu(strength), result) <= result.errors).all()
    assert result.errors.max() <= LOOSE.error_tolerance


@pytest.mark.usefixtures('no_estimates')
@pytest.mark.parametrize('change', [1.0, 1.02, 0.95])
def test_node_moves_along_with_a_switch(change: float) -> None:
    first = solved(kink(np.sinh(1.3)), CASES['kink'])
    problem = kink(change * np.sinh(1.3))
    result = solve_near(problem, first, LOOSE)
    assert result.converged
    assert result.solution.intervals == first.solution.intervals
    # with the slope of 1 at t = 0, y there is what the zero moves by
    assert (result.switches[0] < -1e-3) == (change > 1)
    assert are_on_nodes(result.solution.mesh, result.switches, 1e-6)
    assert (true_errors(problem, result) <= result.errors).all()


@pytest.mark.usefixtures('no_estimates')
def test_switch_that_is_new_gets_a_node() -> None:
    # the solution that begins above zero has none, the other one has one
    def problem(start: float) -> System:
        return second_order(lambda t, y, v: np.where(np.real(y) < 0, -y, y), start, 1.0,
                            switches_of=lambda t, z: [z[0]])

    case = CASES['kink']
    first = solved(problem(0.01), case)
    result = solve_near(problem(-0.01), first, LOOSE)
    assert (first.switches.size, result.switches.size) == (0, 1)
    assert are_on_nodes(result.solution.mesh, result.switches, 1e-6)


def test_problem_that_is_far_is_solved_from_the_beginning() -> None:
    first = solved(mc_20(0.1).problem, mc_20(0.1))
    result = solve_near(mc_20(0.02).problem, first, SETTINGS)
    assert result.converged
    assert result.meshes > 1
    assert mc_20(0.02).error(result.solution) <= SETTINGS.error_tolerance


def test_known_errors_count_twice_and_are_estimated_anew_in_time() -> None:
    at, problem = solved(bratu(1.0), CASES['bratu, lower']), bratu(1.0)
    at = replace(at, errors=np.full(2, 1e-5))
    claimed = []
    for _ in range(5):
        result = solve_near(problem, at, LOOSE)
        at = known(result)
        claimed.append(result.errors.max())
    np.testing.assert_allclose(claimed[:3], [2e-5, 4e-5, 8e-5])
    assert claimed[3] <= SETTINGS.error_tolerance
    np.testing.assert_allclose(claimed[4], 2 * claimed[3])


@pytest.mark.parametrize('changes', [
    {'errors': np.full(2, np.inf)}, {'residual': 1e-12}, {'residual': np.inf}])
def test_what_is_not_known_to_be_exact_is_estimated(monkeypatch: pytest.MonkeyPatch,
                                                    changes: dict[str, Any]) -> None:
    first = replace(solved(bratu(1.0), CASES['bratu, lower']), **changes)
    solves: list[Any] = []

    def count(*given: Any, **more: Any) -> CollocationResult:
        solves.append(solve(*given, **more))
        return solves[-1]

    monkeypatch.setattr(restart, 'solve', count)
    assert solve_near(bratu(1.01), first, LOOSE) is solves[0]
    assert solves[0].converged


def test_solution_by_another_rule_is_solved_from_the_beginning() -> None:
    first = solved(bratu(1.0), CASES['bratu, lower'])
    result = solve_near(bratu(1.01), first, replace(LOOSE, stages=6))
    assert result.converged
    assert result.solution.rule.stages == 7


def test_stretched_solution_is_that_of_a_slower_clock() -> None:
    first = solved(kink(np.sinh(1.3)), CASES['kink'])
    slower = first.stretched(2.0)
    np.testing.assert_allclose(slower.switches, 2 * first.switches)
    np.testing.assert_allclose(slower.solution(2 * first.solution.mesh), first.solution.nodes,
                               atol=1e-12)


def test_monitor_stops_it() -> None:
    first = solved(bratu(1.0), CASES['bratu, lower'])
    result = solve_near(bratu(1.01), first, LOOSE, Monitor(canceled=lambda: True))
    assert result.status is SolverStatus.CANCELED
