"""Estimated errors, and the solutions that they improve."""

from __future__ import annotations

from bvp_problems import bratu, Case, CASES, mc_03, mc_20, outcome_on, STEEP
from flex_planner.collocation import solve, SolverSettings
from flex_planner.collocation.estimate import Estimate, estimate_error
import numpy as np
import pytest


def estimate_of(case: Case, intervals: int, stages: int) -> tuple[Estimate, float]:
    """Return the estimate on a uniform mesh, and the error that it estimates."""
    outcome = outcome_on(case, intervals, stages)
    assert outcome.system is not None
    estimate = estimate_error(case.problem, outcome.solution, outcome.system)
    return estimate, case.error(outcome.solution)


@pytest.mark.parametrize(('case', 'stages'), [
    (STEEP, 2), (STEEP, 3), (STEEP, 4),
    *((case, stages) for stages in (2, 3, 4) for case in (bratu(upper=True), mc_20(0.1))),
    (mc_03(0.1), 3)])
def test_estimate_is_the_error_and_its_result_is_better(case: Case, stages: int) -> None:
    estimate, error = estimate_of(case, 20, stages)
    assert estimate.errors[0] == pytest.approx(error, rel=0.05)
    assert estimate.improved.rule.stages == stages + 1
    assert case.error(estimate.improved) <= error / 20


@pytest.mark.parametrize(('case', 'stages'), [
    (case, stages) for stages in (2, 3, 4)
    for case in (bratu(upper=True), mc_20(0.1), mc_03(0.1), STEEP)])
def test_estimate_has_the_size_of_the_error(case: Case, stages: int) -> None:
    estimate, error = estimate_of(case, 16, stages)
    assert 0.2 * error <= estimate.errors[0] <= 1.6 * error
    assert case.error(estimate.improved) <= 1.5 * error


@pytest.mark.parametrize('name', ['long interval', 'MC 14, thin layers', 'MC 6, shock'])
def test_solution_is_continuous_after_its_improvement(name: str) -> None:
    for tolerance in (1e-4, 1e-6, 1e-8):
        settings = SolverSettings(error_tolerance=tolerance)
        solution = solve(CASES[name].problem, CASES[name].start(settings), settings).solution
        ends = solution.values_at(np.ones(1))[:, 0]
        np.testing.assert_allclose(ends, solution.nodes[1:], rtol=0,
                                   atol=1e-12 * np.abs(solution.nodes).max())
