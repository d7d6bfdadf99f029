"""The linear algebra of a Newton step."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bvp_problems import bratu, CASES
from flex_planner.collocation import GaussRule, solve, SolverSettings, SolverStatus
from flex_planner.collocation.linear import NewtonSystem, Residual, SingularSystemError
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
NONE: Indices = np.zeros(0, int)


# Linear algebra


@dataclass(frozen=True, eq=False)
class Step:
    """A random linear problem of 5 unknowns whose Jacobian is constant in every interval."""

    rule: GaussRule
    steps: Array
    jacobians: Array
    left: Array
    right: Array
    scale: Array
    explicit: Indices

    @classmethod
    def random(cls, stages: int, explicit: Indices, intervals: int = 4) -> Step:
        rng = np.random.default_rng(stages)
        jacobians = 2 * rng.standard_normal((intervals, 3, 5, 5))
        # rates of the first of E depend on the last only, in a way of its own at every time
        for i, j in np.ndindex(explicit.size, explicit.size):
            if not i < (explicit.size + 1) // 2 <= j:
                jacobians[..., explicit[i], explicit[j]] = 0
        return cls(GaussRule.of(stages), rng.uniform(0.1, 0.6, intervals),
                   jacobians.mean(axis=1), rng.standard_normal((2, 5)),
                   rng.standard_normal((3, 5)), 10.0 ** rng.integers(-3, 4, 5), explicit)

    def system(self) -> NewtonSystem:
        return NewtonSystem(self.rule, self.steps, self.jacobians, self.left, self.right,
                            self.scale, self.explicit)

    def residual(self) -> Residual:
        rng, (count, size) = np.random.default_rng(1), self.jacobians.shape[:2]
        shapes = ((count, self.rule.stages, size), (count, size), (self.left.shape[0],),
                  (self.right.shape[0],))
        return Residual(*(rng.standard_normal(shape) for shape in shapes))

    def dense(self) -> Array:
        """Return the whole Newton matrix of the unknowns z_0, k_1, ..., k_s, z_1, ..."""
        (count, size), s = self.jacobians.shape[:2], self.rule.stages
        rows, block = [], (s + 1) * size
        width = count * block + size
        rows.append(np.pad(self.left, ((0, 0), (0, width - size))))
        for n, (h, J) in enumerate(zip(self.steps, self.jacobians, strict=True)):
            row = np.zeros((block, width))
            here = row[:, n * block:]
            here[:-size, :size] = -np.tile(J, (s, 1))
            here[:-size, size:block] = np.eye(s * size) - h * np.kron(self.rule.matrix, J)
            here[-size:, :size] = -np.eye(size)
            here[-size:, size:block] = -h * np.kron(self.rule.weights, np.eye(size))
            here[-size:, block:block + size] = np.eye(size)
            rows.append(row)
        rows.append(np.pad(self.right, ((0, 0), (width - size, 0))))
        return np.vstack(rows)

    def dense_correction(self) -> tuple[Array, Array]:
        """Return the correction of nodes and stages by one dense solve."""
        (count, size), s, residual = self.jacobians.shape[:2], self.rule.stages, self.residual()
        inner = np.concatenate([residual.stages, residual.steps[:, None]], axis=1)
        found = np.linalg.solve(self.dense(), -np.concatenate(
            [residual.left, inner.ravel(), residual.right]))
        rest = found[size:].reshape(count, s + 1, size)
        return np.vstack([found[:size], rest[:, -1]]), rest[:, :-1]


@pytest.mark.parametrize('explicit', [[], [2], [0, 3], [3, 0, 4], [1, 4, 2, 0], [0, 1, 2, 3, 4]])
@pytest.mark.parametrize('stages', [2, 3, 4, 5, 8])
def test_correction_solves_the_full_newton_system(stages: int, explicit: list[int]) -> None:
    step = Step.random(stages, np.array(explicit, dtype=np.intp))
    among = step.jacobians[:, step.explicit[:, None], step.explicit]
    assert not (among[:, None] @ among).any()  # at any two points
    nodes, stage_rates = step.system().correction(step.residual())
    expected_nodes, expected_rates = step.dense_correction()
    # rounding of a dense LU of condition 1e4
    size = np.abs(expected_nodes).max()
    np.testing.assert_allclose(nodes, expected_nodes, rtol=0, atol=1e-11 * size)
    np.testing.assert_allclose(stage_rates, expected_rates, rtol=0,
                               atol=1e-11 * np.abs(expected_rates).max())


def test_scale_changes_pivots_but_not_the_correction() -> None:
    step = Step.random(4, NONE)
    one = step.system().correction(step.residual())[0]
    other = replace(step, scale=np.ones(5)).system().correction(step.residual())[0]
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_factors_serve_many_residuals() -> None:
    step = Step.random(5, NONE)
    system, residual = step.system(), step.residual()
    first = system.correction(residual)
    double = Residual(*(2 * part for part in (residual.stages, residual.steps, residual.left,
                                              residual.right)))
    np.testing.assert_allclose(system.correction(double)[1], 2 * first[1], rtol=1e-12)


@pytest.mark.parametrize('stages', [2, 8])
def test_growth_and_decay_by_e_300_stay_accurate(stages: int) -> None:
    # z' = J z with J of eigenvalues +-300 on [0, 1]: products of transition matrices overflow
    rng, count = np.random.default_rng(0), 60
    vectors = rng.standard_normal((2, 2))
    J = vectors @ np.diag([300.0, -300.0]) @ np.linalg.inv(vectors)
    step = Step(GaussRule.of(stages), np.full(count, 1 / count), np.tile(J, (count, 1, 1)),
                np.array([[1.0, 0]]), np.array([[0, 1.0]]), np.ones(2), NONE)
    nodes, rates = step.system().correction(step.residual())
    expected_nodes, expected_rates = step.dense_correction()
    np.testing.assert_allclose(nodes, expected_nodes, atol=1e-12 * np.abs(nodes).max())
    np.testing.assert_allclose(rates, expected_rates, atol=1e-12 * np.abs(rates).max())


def system_of(J: Array, left: Array, right: Array, count: int = 3,
              stages: int = 3) -> NewtonSystem:
    """Return the system of a constant Jacobian on steps of 1."""
    return NewtonSystem(GaussRule.of(stages), np.ones(count), np.tile(J, (count, 1, 1)), left,
                        right, np.ones(J.shape[0]), NONE)


def test_boundary_value_problem_without_unique_solution_is_refused() -> None:
    slopes = np.array([[0, 1.0]])  # y'' = 0 with the slope given at both ends
    with pytest.raises(SingularSystemError, match='boundary-value problem is singular'):
        system_of(np.array([[0, 1.0], [0, 0]]), slopes, slopes)


@pytest.mark.parametrize('bad', [0.0, np.nan, np.inf])
def test_boundary_row_of_zeros_or_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(SingularSystemError, match='a boundary row is zero or not finite'):
        system_of(np.zeros((2, 2)), np.array([[1.0, 0]]), np.array([[bad, bad]]))


def test_stage_equations_without_solution_are_refused() -> None:
    # 1 - h lambda J = 0 for the real eigenvalue of an odd rule
    real = GaussRule.of(3).spectrum.eigenvalues
    growth = 1 / real[real.imag == 0].real
    with pytest.raises(SingularSystemError, match='stage equations of an interval'):
        system_of(growth[None], np.ones((1, 1)), np.ones((0, 1)))


@pytest.mark.parametrize('unit', [1.0, 1e9])
def test_stage_equations_are_singular_or_not_in_any_units(unit: float) -> None:
    units, bounds = np.diag([1.0, unit]), (np.eye(2)[:1], np.eye(2)[1:])
    turned = np.array([[3.0, 1.0], [1.0, 3.0]]) / 2  # of eigenvalues 1 and 2
    real = GaussRule.of(3).spectrum.eigenvalues
    growth = 1 / real[real.imag == 0].real
    system_of(units @ (0.9 * growth * turned) @ np.linalg.inv(units), *bounds)
    with pytest.raises(SingularSystemError, match='stage equations of an interval'):
        system_of(units @ (growth * turned) @ np.linalg.inv(units), *bounds)


# Unknowns that need no factorisation


def test_positions_may_be_declared_explicit() -> None:
    case, settings = bratu(upper=True), SolverSettings(intervals=10)
    plain = solve(case.problem, case.start(settings), settings)
    explicit = replace(case.problem, explicit=np.array([0]))
    result = solve(explicit, case.start(settings), settings)
    assert (result.iterations, result.meshes) == (plain.iterations, plain.meshes)
    np.testing.assert_allclose(result.solution.nodes, plain.solution.nodes, atol=1e-12)


@pytest.mark.parametrize('explicit', [[1], [0, 1]])
@pytest.mark.parametrize('name', ['linear', 'bratu, lower', 'bratu, upper'])
def test_wrong_claim_of_explicit_unknowns_is_survived(name: str, explicit: list[int]) -> None:
    # the rate of v depends on y and that of y on v: J_EE^2 is not zero
    case, settings = CASES[name], SolverSettings(intervals=10, stages=3, error_tolerance=1e-7)
    claimed = replace(case.problem, explicit=np.array(explicit))
    result = solve(claimed, case.start(settings), settings)
    assert result.status is SolverStatus.CONVERGED, result.message
    assert case.error(result.solution) <= 1e-7


@pytest.mark.parametrize('name', ['MC 2, layer', 'MC 3, nonautonomous', 'MC 6, shock',
                                  'MC 20, corner', 'kink', 'third order', 'Sturm-Liouville'])
def test_wrong_claim_of_explicit_unknowns_falsifies_nothing(name: str) -> None:
    case, settings = CASES[name], SolverSettings(intervals=40, stages=3)
    problem = replace(case.problem, explicit=np.arange(case.problem.size))
    result = solve(problem, case.start(settings), settings)
    assert not result.converged or case.error(result.solution) <= 1e-6
