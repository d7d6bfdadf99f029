"""The polynomials of a solution, and their order."""

from __future__ import annotations

from bvp_problems import bratu, Case, second_order, solved_on
from flex_planner.collocation import GaussRule
import numpy as np
import pytest


def test_solution_is_continuous_and_its_rate_is_its_derivative() -> None:
    solution, h = solved_on(bratu(upper=True), 8, 3), 1e-6
    inner = solution.mesh[1:-1]
    # from the left the value is the end of the interval, up to Newton's tolerance
    np.testing.assert_allclose(solution(inner - 1e-13), solution.nodes[1:-1], atol=1e-11)
    times = np.linspace(0.01, 0.99, 36)  # none within h of a node
    slope = (solution(times + h) - solution(times - h)) / (2 * h)
    np.testing.assert_allclose(slope, solution.rate(times), rtol=1e-7, atol=1e-7)  # h^2, 1e-16/h
    np.testing.assert_allclose(solution(solution.mesh), solution.nodes, atol=1e-12)


@pytest.mark.parametrize('stages', [3, 4, 12])
def test_polynomial_survives_a_finer_mesh_and_more_stages(stages: int) -> None:
    solution = solved_on(bratu(upper=True), 8, 3)
    finer = solution.on_mesh(np.linspace(0, 1, 33), GaussRule.of(stages))
    times = np.linspace(0, 1, 101)
    # intervals inside intervals hold the same polynomial; rounding
    np.testing.assert_allclose(finer(times), solution(times), atol=1e-13)
    np.testing.assert_allclose(finer.rate(times[1:-1]), solution.rate(times[1:-1]), atol=1e-12)


def growing(growth: float) -> Case:
    """Return y'' = growth^2 y from 0 to 1."""
    return Case(problem=second_order(lambda t, y, v: growth**2 * y, 0, 1),
                exact=lambda t: np.sinh(growth * t) / np.sinh(growth))


# the growths make the next term of the error small, and the error 30 times its rounding or more
@pytest.mark.parametrize(('stages', 'growth'), [(2, 4), (3, 8), (4, 8), (5, 16), (6, 26)])
def test_order_is_2s_at_the_nodes(stages: int, growth: float) -> None:
    case = growing(growth)
    errors = [case.error(solved_on(case, count, stages)) for count in (16, 32)]
    # the next term of the error is two orders smaller
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * stages, abs=0.2)


@pytest.mark.parametrize(('stages', 'growth'), [(2, 4), (3, 8), (4, 8), (5, 16), (6, 20)])
def test_order_is_s_plus_1_between_the_nodes(stages: int, growth: float) -> None:
    case, theta, errors = growing(growth), np.linspace(0.05, 0.95, 10), []
    for count in (16, 32):
        solution = solved_on(case, count, stages)
        errors.append(case.error(solution, solution.times_at(theta).ravel()))
    # the next term of the error is one order smaller
    assert np.log2(errors[0] / errors[1]) == pytest.approx(stages + 1, abs=0.45)


@pytest.mark.parametrize('stages', [2, 3, 4])
def test_order_holds_where_the_jacobian_varies(stages: int) -> None:
    # the mean of dF/dz is in the matrix only, not in the equations
    case = bratu(upper=True)
    errors = [case.error(solved_on(case, count, stages)) for count in (16, 32)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * stages, abs=0.06)
