"""The linear algebra of a Newton step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from bvp_problems import bratu, CASES
from flex_planner.collocation import GaussRule, solve, SolverSettings, SolverStatus
from flex_planner.collocation.compiled_system import CompiledSystem
from flex_planner.collocation.core import CORE_VARIABLE, CoreSizes, load_core
from flex_planner.collocation.linear import LinearSystem, NewtonSystem, Residual
from flex_planner.collocation.problem import SingularSystemError
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
NONE: Indices = np.zeros(0, int)
_COUNT = 8


def factorise_by(method: str, rule: GaussRule, *parts: Any) -> LinearSystem:
    """Return a linear system by NumPy or by compiled code."""
    _, jacobians, left, _, scale, explicit = parts
    if method == 'numpy':
        return NewtonSystem(rule, *parts)
    core = load_core(CoreSizes(scale.size, len(left), explicit.size, rule.stages,
                               int(jacobians.ndim == 4)))
    assert core is not None, 'there is no C compiler'
    return CompiledSystem.factorise(core, rule, parts)


@pytest.fixture(params=['numpy', 'compiled'])
def method(request: pytest.FixtureRequest) -> str:
    """Return by what a system is factorised."""
    return str(request.param)


# Linear algebra


@dataclass(frozen=True, eq=False)
class Step:
    """
    A random linear problem of 5 unknowns.

    Its Jacobian is constant in every interval, or known at every stage.

    """

    rule: GaussRule
    steps: Array
    jacobians: Array
    left: Array
    right: Array
    scale: Array
    explicit: Indices
    method: str = 'numpy'

    @classmethod
    def random(cls, stages: int, explicit: Indices, method: str = 'numpy', *,
               exact: bool = False) -> Step:
        rng = np.random.default_rng(stages)
        jacobians = 2 * rng.standard_normal((4, stages if exact else 3, 5, 5))
        # rates of the first of E depend on the last only, in a way of its own at every time
        for i, j in np.ndindex(explicit.size, explicit.size):
            if not i < (explicit.size + 1) // 2 <= j:
                jacobians[..., explicit[i], explicit[j]] = 0
        return cls(GaussRule.of(stages), rng.uniform(0.1, 0.6, 4),
                   jacobians if exact else jacobians.mean(axis=1), rng.standard_normal((2, 5)),
                   rng.standard_normal((3, 5)), 10.0 ** rng.integers(-3, 4, 5), explicit, method)

    def system(self) -> LinearSystem:
        return factorise_by(self.method, self.rule, self.steps, self.jacobians, self.left,
                            self.right, self.scale, self.explicit)

    def residual(self) -> Residual:
        rng, count, size = np.random.default_rng(1), self.steps.size, self.scale.size
        shapes = ((count, self.rule.stages, size), (count, size), (self.left.shape[0],),
                  (self.right.shape[0],))
        return Residual(*(rng.standard_normal(shape) for shape in shapes))

    def dense(self) -> Array:
        """Return the whole Newton matrix of the unknowns z_0, k_1, ..., k_s, z_1, ..."""
        count, size, s = self.steps.size, self.scale.size, self.rule.stages
        rows, block = [], (s + 1) * size
        width = count * block + size
        rows.append(np.pad(self.left, ((0, 0), (0, width - size))))
        for n, h in enumerate(self.steps):
            # J at every stage, one below the other
            J = np.broadcast_to(self.jacobians[n], (s, size, size)).reshape(s * size, size)
            row = np.zeros((block, width))
            here = row[:, n * block:]
            here[:-size, :size] = -J
            coupled = np.kron(self.rule.matrix, np.ones((size, size))) * np.tile(J, (1, s))
            here[:-size, size:block] = np.eye(s * size) - h * coupled
            here[-size:, :size] = -np.eye(size)
            here[-size:, size:block] = -h * np.kron(self.rule.weights, np.eye(size))
            here[-size:, block:block + size] = np.eye(size)
            rows.append(row)
        rows.append(np.pad(self.right, ((0, 0), (width - size, 0))))
        return np.vstack(rows)

    def dense_correction(self) -> tuple[Array, Array]:
        """Return the correction of nodes and stages by one dense solve."""
        count, size, s = self.steps.size, self.scale.size, self.rule.stages
        residual = self.residual()
        inner = np.concatenate([residual.stages, residual.steps[:, None]], axis=1)
        found = np.linalg.solve(self.dense(), -np.concatenate(
            [residual.left, inner.ravel(), residual.right]))
        rest = found[size:].reshape(count, s + 1, size)
        return np.vstack([found[:size], rest[:, -1]]), rest[:, :-1]


@pytest.mark.parametrize('explicit', [[], [2], [0, 3], [3, 0, 4], [1, 4, 2, 0], [0, 1, 2, 3, 4]])
@pytest.mark.parametrize('stages', [2, 3, 4, 5, 8, 9])
@pytest.mark.parametrize('exact', [False, True])
def test_correction_solves_the_full_newton_system(stages: int, explicit: list[int], exact: bool,
                                                  method: str) -> None:
    step = Step.random(stages, np.array(explicit, dtype=np.intp), method, exact=exact)
    among = step.jacobians.reshape(-1, 5, 5)[:, step.explicit[:, None], step.explicit]
    assert not (among[:, None] @ among).any()  # at any two points
    nodes, stage_rates = step.system().correction(step.residual())
    expected_nodes, expected_rates = step.dense_correction()
    # rounding of a dense LU of condition 1e4
    size = np.abs(expected_nodes).max()
    np.testing.assert_allclose(nodes, expected_nodes, rtol=0, atol=1e-11 * size)
    np.testing.assert_allclose(stage_rates, expected_rates, rtol=0,
                               atol=1e-11 * np.abs(expected_rates).max())


def test_scale_changes_pivots_but_not_the_correction(method: str) -> None:
    step = Step.random(4, NONE, method)
    one = step.system().correction(step.residual())[0]
    other = replace(step, scale=np.ones(5)).system().correction(step.residual())[0]
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_factors_serve_many_residuals(method: str) -> None:
    step = Step.random(5, NONE, method)
    system, residual = step.system(), step.residual()
    first = system.correction(residual)
    double = Residual(*(2 * part for part in (residual.stages, residual.steps, residual.left,
                                              residual.right)))
    np.testing.assert_allclose(system.correction(double)[1], 2 * first[1], rtol=1e-12)


@pytest.mark.parametrize('stages', [2, 8])
def test_growth_and_decay_by_e_300_stay_accurate(stages: int, method: str) -> None:
    # z' = J z with J of eigenvalues +-300 on [0, 1]: products of transition matrices overflow
    rng, count = np.random.default_rng(0), 60
    vectors = rng.standard_normal((2, 2))
    J = vectors @ np.diag([300.0, -300.0]) @ np.linalg.inv(vectors)
    step = Step(GaussRule.of(stages), np.full(count, 1 / count), np.tile(J, (count, 1, 1)),
                np.array([[1.0, 0]]), np.array([[0, 1.0]]), np.ones(2), NONE, method)
    nodes, rates = step.system().correction(step.residual())
    expected_nodes, expected_rates = step.dense_correction()
    np.testing.assert_allclose(nodes, expected_nodes, atol=1e-12 * np.abs(nodes).max())
    np.testing.assert_allclose(rates, expected_rates, atol=1e-12 * np.abs(rates).max())


def system_of(J: Array, left: Array, right: Array, method: str) -> LinearSystem:
    """Return the system of a constant Jacobian on three steps of 1, with three stages."""
    return factorise_by(method, GaussRule.of(3), np.ones(3), np.tile(J, (3, 1, 1)), left, right,
                        np.ones(J.shape[0]), NONE)


def test_boundary_value_problem_without_unique_solution_is_refused(method: str) -> None:
    slopes = np.array([[0, 1.0]])  # y'' = 0 with the slope given at both ends
    with pytest.raises(SingularSystemError, match='boundary-value problem is singular'):
        system_of(np.array([[0, 1.0], [0, 0]]), slopes, slopes, method)


@pytest.mark.parametrize('bad', [0.0, np.nan, np.inf])
def test_boundary_row_of_zeros_or_not_finite_is_refused(bad: float, method: str) -> None:
    with pytest.raises(SingularSystemError, match='a boundary row is zero or not finite'):
        system_of(np.zeros((2, 2)), np.array([[1.0, 0]]), np.array([[bad, bad]]), method)


def test_stage_equations_without_solution_are_refused(method: str) -> None:
    # 1 - h lambda J = 0 for the real eigenvalue of an odd rule
    real = GaussRule.of(3).spectrum.eigenvalues
    growth = 1 / real[real.imag == 0].real
    with pytest.raises(SingularSystemError, match='stage equations of an interval'):
        system_of(growth[None], np.ones((1, 1)), np.ones((0, 1)), method)


@pytest.mark.parametrize('unit', [1.0, 1e9])
def test_stage_equations_are_singular_or_not_in_any_units(unit: float, method: str) -> None:
    units, bounds = np.diag([1.0, unit]), (np.eye(2)[:1], np.eye(2)[1:])
    turned = np.array([[3.0, 1.0], [1.0, 3.0]]) / 2  # of eigenvalues 1 and 2
    real = GaussRule.of(3).spectrum.eigenvalues
    growth = 1 / real[real.imag == 0].real
    system_of(units @ (0.9 * growth * turned) @ np.linalg.inv(units), *bounds, method)
    with pytest.raises(SingularSystemError, match='stage equations of an interval'):
        system_of(units @ (growth * turned) @ np.linalg.inv(units), *bounds, method)


# Compiled code


@dataclass(frozen=True, eq=False)
class ArmLike:
    """A random linear problem as large as that of an arm."""

    steps: Array
    jacobians: Array
    ends: Array
    scale: Array
    explicit: Indices

    @classmethod
    def random(cls, stages: int) -> ArmLike:
        rng, size = np.random.default_rng(0), 24
        explicit = np.r_[0:6, 12:18]
        scale = 10.0 ** rng.integers(-1, 2, size)
        jacobians = rng.standard_normal((_COUNT, stages, size, size))
        jacobians[:, :, explicit[:, None], explicit] = 0
        jacobians[:, :, 12:18, 0:6] = rng.standard_normal((_COUNT, stages, 6, 6))
        jacobians *= scale[:, None] / scale
        return cls(rng.uniform(0.02, 0.1, _COUNT), jacobians,
                   np.linalg.qr(rng.standard_normal((size, size)))[0] / scale, scale, explicit)

    def correction(self, method: str, rule: GaussRule, *, exact: bool,
                   other: GaussRule | None = None) -> tuple[Array, Array]:
        jacobians = self.jacobians if exact else self.jacobians.mean(axis=1)
        system = factorise_by(method, rule, self.steps, jacobians, self.ends[:12], self.ends[12:],
                              self.scale, self.explicit)
        rng, stages = np.random.default_rng(1), (other or rule).stages
        residual = Residual(rng.standard_normal((_COUNT, stages, 24)) * self.scale,
                            rng.standard_normal((_COUNT, 24)) * self.scale,
                            rng.standard_normal(12), rng.standard_normal(12))
        nodes, rates = (system.with_rule(other) if other else system).correction(residual)
        return nodes / self.scale, rates / self.scale


@pytest.mark.parametrize('exact', [False, True])
@pytest.mark.parametrize('stages', [4, 8, 9])
def test_compiled_correction_is_numpys(stages: int, exact: bool) -> None:
    arm, rule = ArmLike.random(stages), GaussRule.of(stages)
    expected, found = (arm.correction(method, rule, exact=exact)
                       for method in ('numpy', 'compiled'))
    for mine, theirs in zip(found, expected, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-11 * np.abs(theirs).max())


@pytest.mark.parametrize('exact', [False, True])
def test_system_of_another_rule_is_the_same_compiled(exact: bool) -> None:
    arm = ArmLike.random(4)
    expected, found = (arm.correction(method, GaussRule.of(4), exact=exact, other=GaussRule.of(5))
                       for method in ('numpy', 'compiled'))
    np.testing.assert_allclose(found[0], expected[0], rtol=0,
                               atol=1e-11 * np.abs(expected[0]).max())


def test_numpy_does_without_the_core_where_told_to(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = CoreSizes(2, 1, 1, 3, 0)
    assert load_core(sizes) is not None
    monkeypatch.setenv(CORE_VARIABLE, 'numpy')
    assert load_core(sizes) is None


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
