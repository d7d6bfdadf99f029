"""Collocation on textbook problems: error, estimated error, defect and work."""

from __future__ import annotations

from typing import Any, NamedTuple

from bvp_problems import Case, CASES, emden, mc_03, mc_06, mc_07, mc_09, mc_14, OPEN, TABULATED
from flex_planner.collocation import CollocationResult, solve, SolverSettings, SolverStatus
import numpy as np
from numpy.typing import NDArray
import pytest
from scipy.integrate import solve_bvp

Array = NDArray[np.float64]
# relative, and a hundred times what Newton's method and the error estimate can see
ROUNDING = 1e-13


class Work(NamedTuple):
    """What a problem may take at most, as measured on meshes that start with 20 intervals."""

    error: float
    iterations: int
    meshes: int
    intervals: int


WORK = {
    'linear': Work(2e-16, 2, 1, 20),
    'bratu, lower': Work(1e-14, 2, 1, 20),
    'bratu, upper': Work(2e-13, 3, 1, 20),
    'MC 1, layer': Work(4e-11, 2, 1, 20),
    'MC 2, layer': Work(4e-11, 2, 1, 20),
    'MC 3, nonautonomous': Work(1e-15, 3, 1, 20),
    'MC 4, layer': Work(5e-12, 4, 2, 8),
    'MC 6, shock': Work(3e-7, 10, 2, 20),
    'MC 7, corner': Work(2e-9, 5, 1, 20),
    'MC 8, layer': Work(2e-11, 2, 1, 20),
    'MC 9, spike': Work(6e-11, 2, 1, 20),
    'MC 14, two layers': Work(7e-10, 4, 2, 8),
    # 10 intervals; Gauss collocation of order 6 took 563, SciPy's solve_bvp takes 1226
    'MC 14, thin layers': Work(3e-8, 11, 8, 11),
    'MC 18, layer': Work(1e-9, 7, 4, 4),
    'MC 20, corner': Work(2e-9, 18, 1, 20),
    'kink': Work(1e-10, 4, 2, 26),
    'long interval': Work(7e-9, 8, 5, 5),
    'third order': Work(1e-15, 2, 1, 20),
    'initial values': Work(5e-16, 5, 1, 20),
    'Sturm-Liouville': Work(1e-13, 4, 1, 20),
}
cases = pytest.mark.parametrize('name', CASES)


def solved(case: Case, **settings: Any) -> CollocationResult:
    chosen = SolverSettings(**settings)
    result = solve(case.problem, case.start(chosen), chosen)
    assert result.status is SolverStatus.CONVERGED, result.message
    assert result.message == 'converged'
    assert result.errors.max() <= chosen.error_tolerance
    assert result.solution.rule.stages == chosen.stages + 1
    return result


@cases
def test_textbook_problem_is_solved_within_its_error_and_work(name: str) -> None:
    case, result, most = CASES[name], solved(CASES[name]), WORK[name]
    work = Work(case.error(result.solution), result.iterations, result.meshes,
                result.solution.intervals)
    assert all(value <= limit for value, limit in zip(work, most, strict=True)), work
    # between the nodes the order is s + 1 only, and the defect bounds the error
    between = case.error(result.solution, np.linspace(*case.span, 2001))
    assert between <= result.residual + ROUNDING


@pytest.mark.parametrize('name', [
    name for name in CASES if name != 'kink'])
def test_estimated_error_bounds_the_error(name: str) -> None:
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10):
        result = solved(CASES[name], error_tolerance=tolerance)
        error, estimate = CASES[name].error(result.solution), result.errors[0]
        assert error <= estimate + ROUNDING
        # what was estimated is the error before the correction, some orders of the step larger
        assert estimate <= 1e3 * error + 1e-8


@cases
@pytest.mark.parametrize('stages', [2, 11])
def test_every_number_of_stages_solves_textbook_problems(name: str, stages: int) -> None:
    result = solved(CASES[name], stages=stages, intervals=40, error_tolerance=1e-5)
    assert CASES[name].error(result.solution) <= 1e-5


@pytest.mark.parametrize('name', OPEN)
def test_problem_without_closed_form_agrees_with_scipy(name: str) -> None:
    problem, result = OPEN[name].problem, solved(OPEN[name], error_tolerance=1e-10)
    assert (result.meshes, result.solution.intervals) == (1, 20)
    times = np.linspace(*OPEN[name].span, 41)
    other = solve_bvp(
        lambda t, z: problem.rate(t, z.T).T,
        lambda a, b: np.concatenate([problem.left(a)[0], problem.right(b)[0]]),
        times, OPEN[name].start(SolverSettings(intervals=40)).nodes.T, tol=1e-6, max_nodes=20000,
        fun_jac=lambda t, z: np.moveaxis(problem.rate_jacobian(t, z.T)[1], 0, -1))
    assert other.success
    size = np.abs(other.y).max(axis=1)
    # its tolerance of the residual, which exceeds its error
    np.testing.assert_allclose(result.solution(times) / size, other.sol(times).T / size,
                               atol=1e-6)


@pytest.mark.parametrize('name', [
    'Blasius', 'Troesch', 'von Karman'])
def test_tabulated_slopes_are_met(name: str) -> None:
    case, values = TABULATED[name]
    result = solved(case, error_tolerance=1e-10)
    for unknown, value in values.items():
        # the tables have twelve digits
        assert result.solution.nodes[0, unknown] == pytest.approx(value, rel=2e-12)


def test_singular_coefficient_at_an_end_is_met_by_no_stage() -> None:
    result = solved(emden())
    assert emden().error(result.solution) <= 2e-7
    # the defect is asked for at the end too, where F is undefined
    assert result.residual == np.inf


# Meshes that are too coarse or too fine to begin with


@pytest.mark.parametrize('case', [mc_03(1e-4), mc_06(1e-3), mc_06(1e-4), mc_07(1e-4), mc_09(1e-2),
                                  mc_09(1e-3)])
def test_linear_problem_is_solved_from_a_coarse_mesh(case: Case) -> None:
    # the mean Jacobian is no help on 10 intervals, and a linear problem cannot fail otherwise
    result = solved(case, intervals=10, error_tolerance=1e-6)
    assert case.error(result.solution) <= 1e-6


@pytest.mark.parametrize(('eps', 'intervals'), [(1e-2, 20), (1e-4, 8), (1e-6, 10), (1e-8, 11)])
def test_thin_layers_take_no_more_intervals(eps: float, intervals: int) -> None:
    result = solved(mc_14(eps))
    assert result.solution.intervals <= intervals
    assert mc_14(eps).error(result.solution) <= 1e-7
    assert result.iterations <= 12


def test_mesh_that_is_much_too_fine_is_kept_if_it_serves() -> None:
    # good enough as it is: another solve would cost more than it saves
    result = solved(mc_14(1e-4), intervals=400)
    assert (result.meshes, result.iterations, result.solution.intervals) == (1, 2, 400)
