"""Conditions inside the span of a problem: against splines, which have closed forms."""

from __future__ import annotations

from bvp_problems import System
from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    CollocationSolution,
    follow_homotopy,
    GaussRule,
    KnownSolution,
    solve,
    Solver,
    SolverSettings,
)
from flex_planner.collocation.core import CORE_VARIABLE
from flex_planner.collocation.junctions import double_nodes, empty_rows, place_junctions
from flex_planner.collocation.mesh import coarsen, defects, level_mesh
from flex_planner.collocation.restart import solve_near
import numpy as np
from numpy.typing import NDArray
import pytest
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]
KNOTS = np.array([0.3, 0.7])


class Spline:
    """
    The least integral of u^2 / 2, x'' = u, through given values at the knots: a cubic spline.

    The unknowns are (x, x', psi_1, psi_2), u is -psi_2, and psi_1 jumps at the knots.

    """

    size, explicit = 4, np.zeros(0, dtype=np.intp)
    matrix = np.array([[0, 1, 0, 0], [0, 0, 0, -1], [0, 0, 0, 0], [0, 0, -1, 0]], dtype=float)

    def __init__(self, values: tuple[float, ...] = (1.0, -0.5), bend: float = 0.0) -> None:
        self.values, self.bend, self.scale = values, bend, np.full(4, 0.1)
        self.junctions = KNOTS

    def rate(self, t: Array, z: Array) -> Array:
        rate: Array = z @ self.matrix.T
        rate[:, 1] += self.bend * np.sin(3 * z[:, 0])
        rate[:, 2] -= 3 * self.bend * z[:, 3] * np.cos(3 * z[:, 0])
        return rate

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        jacobian = np.repeat(self.matrix[None], len(z), axis=0)
        jacobian[:, 1, 0] += 3 * self.bend * np.cos(3 * z[:, 0])
        jacobian[:, 2, 0] += 9 * self.bend * z[:, 3] * np.sin(3 * z[:, 0])
        jacobian[:, 2, 3] -= 3 * self.bend * np.cos(3 * z[:, 0])
        return self.rate(t, z), jacobian

    def switches(self, t: Array, z: Array) -> Array:
        return np.zeros((len(z), 0))

    def left(self, z: Array) -> tuple[Array, Array]:
        return z[:2], np.eye(2, 4)

    def right(self, z: Array) -> tuple[Array, Array]:
        return z[:2] - [1, 0], np.eye(2, 4)

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        gap, rows = after - before, np.hstack([-np.eye(4), np.eye(4)])
        gap[2], rows[2] = before[0] - self.values[junction], 0
        rows[2, 0] = 1
        return gap, rows


def start(intervals: int = 10) -> CollocationSolution:
    return CollocationSolution.from_values(np.linspace(0, 1, intervals + 1),
                                           np.zeros((intervals + 1, 4)), GaussRule.of(4))


@pytest.fixture(params=['numpy', 'compiled'], autouse=True)
def method(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Solve by NumPy, and by compiled code."""
    monkeypatch.setenv(CORE_VARIABLE, str(request.param))


@pytest.mark.parametrize('exact', [False, True])
def test_least_effort_through_points_is_a_cubic_spline(exact: bool) -> None:
    result = solve(Spline(), start(), SolverSettings(stages=4, exact=exact))
    spline = CubicSpline([0, *KNOTS, 1], [0, 1.0, -0.5, 1], bc_type=((1, 0.0), (1, 0.0)))
    times = np.linspace(0, 1, 57)
    assert result.converged
    assert result.solution(times)[:, 0] == pytest.approx(spline(times), abs=1e-12)
    assert result.solution(times)[:, 3] == pytest.approx(-spline(times, 2), abs=1e-10)
    third = spline(KNOTS + 1e-3, 3) - spline(KNOTS - 1e-3, 3)
    jumps = result.solution(KNOTS)[:, 2] - result.solution.before(KNOTS)[:, 2]
    assert jumps == pytest.approx(third, rel=1e-9)  # psi_1 is u'


def test_meshes_are_refined_around_double_nodes() -> None:
    result = solve(Spline(bend=20.0), start(4), SolverSettings(stages=4, error_tolerance=1e-9))
    finer = solve(Spline(bend=20.0), start(100), SolverSettings(stages=8, error_tolerance=1e-11))
    times = np.linspace(0, 1, 57)
    assert result.converged
    assert result.meshes > 1
    assert result.solution.junctions == pytest.approx(KNOTS, abs=0)
    assert result.solution(times) == pytest.approx(finer.solution(times), rel=1e-6, abs=1e-6)


def test_level_meshes_keep_double_nodes_and_nodes_on_switches() -> None:
    solution = solve(Spline(bend=20.0), start(), SolverSettings(stages=4)).solution
    switches = np.array([0.2, KNOTS[0], 0.5])
    mesh = level_mesh(solution, defects(Spline(bend=20.0), solution), 1.0, switches, fewest=12,
                      most=12)
    assert mesh.size == 13
    assert np.isin(switches, mesh).all()
    assert mesh[1:][np.diff(mesh) == 0] == pytest.approx(KNOTS, abs=0)


def test_a_solution_keeps_its_jumps_on_another_mesh() -> None:
    solution = solve(Spline(), start(), SolverSettings(stages=4)).solution
    other = solution.on_mesh(double_nodes(np.linspace(0, 1, 8), KNOTS), GaussRule.of(6))
    times = np.linspace(0, 1, 41)
    assert other(times) == pytest.approx(solution(times), abs=1e-10)
    assert other.before(KNOTS) == pytest.approx(solution.before(KNOTS), abs=1e-10)
    assert coarsen(Spline(), solution, 1e-3, 4).junctions == pytest.approx(KNOTS, abs=0)


def test_a_solution_without_jumps_has_each_node_once_and_the_same_values() -> None:
    solution = solve(Spline(), start(), SolverSettings(stages=4)).solution
    single, times = solution.without_jumps(), np.linspace(0, 1, 41)
    assert (single.steps > 0).all()
    assert single(times) == pytest.approx(solution(times), abs=0)


def test_homotopies_and_restarts_keep_double_nodes() -> None:
    solver = Solver(SolverSettings(stages=4))
    first = solver.solve(Spline(), start())
    result = follow_homotopy(lambda share: Spline(bend=20 * share), first.solution, solver, 0.3)
    assert result.converged
    assert result.solution.junctions == pytest.approx(KNOTS, abs=0)
    known = KnownSolution(solution=result.solution, errors=result.errors,
                          residual=result.residual, switches=result.switches)
    near = solve_near(Spline((1.0, -0.49), bend=20.0), known,
                      SolverSettings(stages=4, error_tolerance=1e-4), Monitor())
    assert near.meshes == 1
    assert near.solution(KNOTS)[:, 0] == pytest.approx([1.0, -0.49], abs=1e-9)


def test_a_guess_gets_the_double_nodes_of_its_problem() -> None:
    placed = place_junctions(Spline(), start())
    assert placed.junctions == pytest.approx(KNOTS, abs=0)
    assert place_junctions(Spline(), placed) is placed
    assert placed.intervals == 12  # both knots were nodes
    plain = System(size=4, rate_of=lambda t, z: [], left_of=lambda z: [], right_of=lambda z: [])
    assert place_junctions(plain, placed).intervals == 10


def test_a_mesh_without_double_nodes_is_refused() -> None:
    with pytest.raises(ValueError, match='0 double nodes, but must have 2'):
        empty_rows(Spline(), start())
