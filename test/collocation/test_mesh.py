"""Meshes: defects measured, levelled, refined and coarsened."""

from __future__ import annotations

from bvp_problems import bratu, mc_14, second_order, solved_on, STEEP
from flex_planner.collocation import CollocationSolution, solve, SolverSettings
from flex_planner.collocation.mesh import coarsen, defects, level_mesh
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]
NOWHERE = np.zeros(0)


# Defects


@pytest.mark.parametrize('stages', [2, 3, 4, 5, 6, 7, 8, 11])
def test_defect_is_the_largest_of_an_interval(stages: int) -> None:
    case = bratu(upper=True)
    solution = solved_on(case, 6, stages)
    theta = np.linspace(0, 1, 201)
    times, values = solution.times_at(theta), solution.values_at(theta)
    left = solution.rates_at(theta) - case.problem.rate(
        times.ravel(), values.reshape(-1, 2)).reshape(values.shape)
    size = np.maximum(np.abs(solution.nodes).max(axis=0), 1)
    dense = (np.abs(left).max(axis=1) * solution.steps[:, None] / size).max(axis=1)
    found = defects(case.problem, solution)
    # the ends and three extrema stand for the whole interval
    assert (found <= dense * (1 + 1e-9)).all()
    assert (found >= 0.95 * dense).all()


@pytest.mark.parametrize('stages', [2, 3, 4, 6])
def test_defect_falls_with_the_order_s_plus_1(stages: int) -> None:
    first, second = (defects(STEEP.problem, solved_on(STEEP, count, stages)).max()
                     for count in (16, 32))
    assert np.log2(first / second) == pytest.approx(stages + 1, abs=0.5)


@pytest.mark.parametrize('bad', [np.nan, np.inf])
def test_defect_is_infinite_where_the_right_hand_side_is_undefined(bad: float) -> None:
    problem = second_order(lambda t, y, v: np.where(t > 0, y, bad), 0, 1)
    found = defects(problem, solved_on(STEEP, 4, 3))
    assert np.isinf(found[0])
    assert np.isfinite(found[1:]).all()


# Meshes


def test_levelled_mesh_puts_nodes_where_the_defect_is() -> None:
    case = mc_14(1e-2)
    solution = solved_on(case, 20, 3)
    mesh = level_mesh(solution, defects(case.problem, solution), 10.0, NOWHERE, fewest=25, most=60)
    assert (mesh[0], mesh[-1]) == case.span
    assert 25 <= mesh.size - 1 <= 60
    steps = np.diff(mesh)
    assert (steps > 0).all()
    # the layers are 0.1 wide
    assert max(steps[0], steps[-1]) < 1.01 * steps.min()
    assert steps.max() > 2 * steps.min()
    finer = solve(case.problem, solution.on_mesh(mesh),
                  SolverSettings(stages=3, error_tolerance=1, max_meshes=1)).solution
    spread = defects(case.problem, finer)
    assert spread.max() < 0.1 * defects(case.problem, solution).max()


def test_levelled_mesh_grades_towards_a_steep_interval() -> None:
    solution, defect = solved_on(STEEP, 9, 3), np.full(9, 1e-12)
    defect[4] = 1.0
    mesh = level_mesh(solution, defect, 6.0, NOWHERE, fewest=4, most=100)
    counts, _ = np.histogram(mesh, bins=solution.mesh)
    # six in the steep interval, half as many beside it, and a tenth everywhere else
    assert counts[4] == pytest.approx(6, abs=1)
    assert min(counts[3], counts[5]) >= 3
    assert counts[[0, 1, 7]].max() <= 1


@pytest.mark.parametrize('growth', [0.5, 1.0, 3.0])
def test_even_defect_gives_an_even_mesh(growth: float) -> None:
    solution = solved_on(STEEP, 12, 3)
    mesh = level_mesh(solution, np.full(12, 1e-3), growth, NOWHERE, fewest=4, most=30)
    np.testing.assert_allclose(mesh, np.linspace(0, 1, 1 + min(30, round(12 * growth))),
                               atol=1e-15)


def test_switches_get_nodes_exactly() -> None:
    solution, switches = solved_on(STEEP, 12, 3), np.array([0.1234567, 0.5, 0.51, 0.987654321])
    mesh = level_mesh(solution, defects(STEEP.problem, solution), 1.0, switches, fewest=12,
                      most=12)
    assert np.isin(switches, mesh).all()
    assert (np.diff(mesh) > 0).all()
    assert mesh.size - 1 <= 12 + switches.size


def test_defect_spoilt_by_a_switch_does_not_draw_nodes() -> None:
    solution, defect = solved_on(STEEP, 10, 3), np.full(10, 1e-6)
    defect[4] = 1.0
    mesh = level_mesh(solution, defect, 1.0, np.array([0.45]), fewest=10, most=10)
    assert np.isin(0.45, mesh)
    assert np.diff(mesh).min() > 0.03


def test_overrefined_mesh_is_coarsened_for_the_next_problem() -> None:
    case = mc_14(1e-4)
    solution = solved_on(case, 200, 4)
    coarse = coarsen(case.problem, solution, 1e-2, fewest=10)
    assert 10 <= coarse.intervals <= 40
    # less than the defect that was asked for, but not much less
    outcome = solve(case.problem, coarse,
                    SolverSettings(stages=4, error_tolerance=1, max_meshes=1))
    assert 1e-4 <= outcome.residual <= 3e-2
    assert coarsen(case.problem, solution, 1e-30, fewest=10).intervals == 200


def test_badly_distributed_mesh_is_coarsened_and_levelled() -> None:
    # 400 intervals, 380 of them where nothing happens
    case, settings = mc_14(1e-6), SolverSettings()
    mesh = np.concatenate([np.linspace(-1, -0.5, 11), np.linspace(-0.5, 0.5, 381)[1:-1],
                           np.linspace(0.5, 1, 11)])
    guess = CollocationSolution.from_values(mesh, np.zeros((mesh.size, 2)), settings.rule)
    result = solve(case.problem, guess, settings)
    assert result.converged
    assert result.solution.intervals <= 64  # a mesh shrinks to two fifths at most
    assert case.error(result.solution) <= 1e-6
