"""
Collocation on textbook problems: error, convergence and work, and every way to fail.

The problems "MC n" are of the Mazzia-Cash test set for boundary-value problems (J. R. Cash and
F. Mazzia, Algorithms for the solution of two-point boundary value problems).

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
import time
from typing import Any

from flex_planner.collocation import CollocationSolution, GaussRule, Settings, solve, Status
from flex_planner.collocation.mesh import defects, levelled
from flex_planner.collocation.newton import newton, NewtonOutcome
from flex_planner.errors import InvalidValueError
from flex_planner.progress import Monitor, Progress
import numpy as np
from numpy.typing import NDArray
import pytest
from scipy.special import erf

Array = NDArray[np.float64]
pi = np.pi


@dataclass(frozen=True, kw_only=True, eq=False)
class System:
    """A boundary-value problem with linear boundary rows, as the solver wants it."""

    rate_of: Callable[[Array, Array], list[Array]]
    jacobian_of: Callable[[Array, Array], list[list[Any]]]
    left_rows: Any
    left_values: Any
    right_rows: Any
    right_values: Any
    scale: Array

    @property
    def size(self) -> int:
        return int(self.scale.size)

    def rate(self, t: Array, z: Array) -> Array:
        return np.stack(np.broadcast_arrays(*self.rate_of(t, z.T)), axis=-1)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        jacobian = np.empty((t.size, self.size, self.size))
        for i, row in enumerate(self.jacobian_of(t, z.T)):
            for j, entry in enumerate(row):
                jacobian[:, i, j] = entry
        return self.rate(t, z), jacobian

    def left(self, z: Array) -> tuple[Array, Array]:
        rows = np.reshape(self.left_rows, (-1, self.size)).astype(float)
        return rows @ z - self.left_values, rows

    def right(self, z: Array) -> tuple[Array, Array]:
        rows = np.reshape(self.right_rows, (-1, self.size)).astype(float)
        return rows @ z - self.right_values, rows


def second_order(f: Callable[[Array, Array, Array], Array], f_y: Any, f_v: Any, start: float,
                 end: float) -> System:
    """Return y'' = f(t, y, y') with y given at both ends; the derivatives are functions too."""
    return System(rate_of=lambda t, z: [z[1], f(t, *z)],
                  jacobian_of=lambda t, z: [[0, 1], [f_y(t, *z), f_v(t, *z)]],
                  left_rows=[1, 0], left_values=[start], right_rows=[1, 0], right_values=[end],
                  scale=np.ones(2))


def constant(value: float) -> Callable[..., float]:
    return lambda t, y, v: value


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A problem with its solution y(t) = z_0(t), its error at the nodes and its work."""

    problem: System
    exact: Callable[[Array], Array]
    error: float
    iterations: int
    intervals: int
    span: tuple[float, float] = (0.0, 1.0)
    guess: Callable[[Array], Array] = field(default=lambda t: np.zeros_like(t))
    settings: Settings = field(default_factory=lambda: Settings(
        intervals=10, defect_tolerance=1e-4))

    def start(self) -> CollocationSolution:
        mesh = np.linspace(*self.span, self.settings.intervals + 1)
        nodes = np.zeros((mesh.size, self.problem.size))
        nodes[:, 0] = self.guess(mesh)
        if self.problem.size > 1:
            nodes[:, 1] = np.gradient(nodes[:, 0], mesh)
        return CollocationSolution.from_values(mesh, nodes, GaussRule.of(self.settings.stages))


def bratu(upper: bool) -> Case:
    """Return y'' = -exp(y), y(0) = y(1) = 0, which has two solutions."""
    # the roots of theta = sqrt(2) cosh(theta / 4)
    theta = 10.938702772122 if upper else 1.5171645990508
    return Case(
        problem=second_order(lambda t, y, v: -np.exp(y), lambda t, y, v: -np.exp(y),
                             constant(0), 0, 0),
        exact=lambda t: -2 * np.log(np.cosh((t - 0.5) * theta / 2) / np.cosh(theta / 4)),
        guess=(lambda t: 16 * t * (1 - t)) if upper else np.zeros_like,
        error=1e-6 if upper else 1e-10, iterations=8 if upper else 3, intervals=25)


def layer_mc14(eps: float, intervals: int) -> Case:
    """MC 14: eps y'' = y - (eps pi^2 + 1) cos(pi t), with layers at both ends."""
    r = np.sqrt(eps)
    return Case(
        problem=second_order(lambda t, y, v: (y - (eps*pi**2 + 1) * np.cos(pi*t)) / eps,
                             constant(1 / eps), constant(0), 0, 0),
        exact=lambda t: np.cos(pi*t) + np.exp((t - 1) / r) + np.exp(-(t + 1) / r),
        span=(-1, 1), error=1e-5, iterations=8, intervals=intervals)


CASES = {
    'linear': Case(
        problem=second_order(lambda t, y, v: y, constant(1), constant(0), 0, 1),
        exact=lambda t: np.sinh(t) / np.sinh(1), error=1e-11, iterations=1, intervals=10),
    'bratu, lower': bratu(upper=False),
    'bratu, upper': bratu(upper=True),
    # MC 4 with eps = 0.01: eps y'' + y' - (1 + eps) y = 0, a layer at the left end
    'one layer': Case(
        problem=second_order(lambda t, y, v: ((1 + 0.01) * y - v) / 0.01, constant(101.0),
                             constant(-100.0), 1 + np.exp(-2), 1 + np.exp(-2 * 1.01 / 0.01)),
        exact=lambda t: np.exp(t - 1) + np.exp(-1.01 * (1 + t) / 0.01),
        span=(-1, 1), error=1e-5, iterations=5, intervals=75),
    # MC 3 with eps = 0.1: coefficients and right-hand side depend on t
    'nonautonomous': Case(
        problem=second_order(
            lambda t, y, v: (-(2 + np.cos(pi*t)) * v + y - (1 + 0.1*pi**2) * np.cos(pi*t)
                             - (2 + np.cos(pi*t)) * pi * np.sin(pi*t)) / 0.1,
            constant(10.0), lambda t, y, v: -10 * (2 + np.cos(pi*t)), -1, -1),
        exact=lambda t: np.cos(pi*t), span=(-1, 1), error=1e-6, iterations=3, intervals=30),
    # MC 6 with eps = 1e-3: a shock inside, at the turning point t = 0
    'turning point': Case(
        problem=second_order(
            lambda t, y, v: (-t*v - 1e-3*pi**2*np.cos(pi*t) - pi*t*np.sin(pi*t)) / 1e-3,
            constant(0), lambda t, y, v: -t / 1e-3, -2, 0),
        exact=lambda t: np.cos(pi*t) + erf(t / np.sqrt(2e-3)) / erf(1 / np.sqrt(2e-3)),
        span=(-1, 1), error=1e-5, iterations=5, intervals=90),
    # growth and decay by e^316 across the span: transition matrices must not be multiplied
    'two layers': layer_mc14(1e-4, intervals=90),
    # SciPy's solve_bvp ends with 1226 intervals for the same tolerance
    'two thin layers': layer_mc14(1e-8, intervals=600),
    # MC 20 with eps = 0.1: eps y'' = 1 - y'^2, a corner
    'corner': Case(
        problem=second_order(lambda t, y, v: (1 - v**2) / 0.1, constant(0),
                             lambda t, y, v: -20 * v, 1 + 0.1*np.log(np.cosh(-7.45)),
                             1 + 0.1*np.log(np.cosh(2.55))),
        exact=lambda t: 1 + 0.1 * np.log(np.cosh((t - 0.745) / 0.1)),
        guess=lambda t: 1.7 - 0.5 * t, error=1e-6, iterations=10, intervals=30),
    # y''' = y with two conditions at the left and one at the right
    'third order': Case(
        problem=System(rate_of=lambda t, z: [z[1], z[2], z[0]],
                       jacobian_of=lambda t, z: [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
                       left_rows=[[1, 0, 0], [0, 1, 1]], left_values=[1, 2],
                       right_rows=[1, 0, 0], right_values=[np.e], scale=np.ones(3)),
        exact=np.exp, error=1e-10, iterations=1, intervals=10),
    # y' = -2 t y^2, y(0) = 1: all conditions at one end
    'initial values': Case(
        problem=System(rate_of=lambda t, z: [-2 * t * z[0]**2],
                       jacobian_of=lambda t, z: [[-4 * t * z[0]]], left_rows=[1],
                       left_values=[1], right_rows=[], right_values=[], scale=np.ones(1)),
        exact=lambda t: 1 / (1 + t**2), span=(0, 3), guess=np.ones_like, error=1e-7,
        iterations=8, intervals=20),
}
cases = pytest.mark.parametrize('name', CASES)


def error(case: Case, solution: CollocationSolution, times: Array) -> float:
    return float(np.abs(solution(times)[:, 0] - case.exact(times)).max())


@cases
def test_textbook_problem_is_solved_within_its_error_and_work(name: str) -> None:
    case = CASES[name]
    result = solve(case.problem, case.start(), case.settings)
    assert result.status is Status.CONVERGED, result.message
    assert result.residual <= case.settings.defect_tolerance
    assert error(case, result.solution, result.solution.mesh) <= case.error
    # between the nodes the order is s + 1, and the defect is an upper bound of the error
    between = error(case, result.solution, np.linspace(*case.span, 2001))
    assert between <= case.settings.defect_tolerance
    assert result.iterations <= case.iterations
    assert result.solution.intervals <= case.intervals


@cases
def test_closed_form_solves_its_problem(name: str) -> None:
    # the test of the tests: y from the table has the derivatives that F gives it
    case, h = CASES[name], 1e-4
    t = np.linspace(case.span[0] + 0.01, case.span[1] - 0.01, 23)
    order = case.problem.size
    y = np.array([case.exact(t + k * h) for k in range(-2, 3)])
    stencils = np.array([[0, 0, 1, 0, 0], [1/12, -2/3, 0, 2/3, -1/12],
                         [-1/12, 4/3, -5/2, 4/3, -1/12], [-1/2, 1, 0, -1, 1/2]])
    derivatives = np.array([stencils[k] @ y / h**k for k in range(order + 1)])
    expected = case.problem.rate(t, derivatives[:order].T)[:, -1]
    # differences of step 1e-4: h^2 = 1e-8 of truncation, 1e-16 / h^order of rounding
    assert np.abs(derivatives[order] - expected).max() <= 1e-3 * max(np.abs(expected).max(), 1)


def solved_on(case: Case, intervals: int, stages: int) -> CollocationSolution:
    mesh = np.linspace(*case.span, intervals + 1)
    values = np.stack([case.exact(mesh), np.gradient(case.exact(mesh), mesh)], axis=1)
    guess = CollocationSolution.from_values(mesh, values, GaussRule.of(stages))
    outcome = newton(case.problem, guess, tolerance=1e-13, max_iterations=20, monitor=Monitor())
    assert outcome.converged
    return outcome.solution


STEEP = Case(problem=second_order(lambda t, y, v: 64 * y, constant(64), constant(0), 0, 1),
             exact=lambda t: np.sinh(8 * t) / np.sinh(8), error=0, iterations=0, intervals=0)


@pytest.mark.parametrize('case', [STEEP, bratu(upper=True)], ids=['linear', 'bratu'])
@pytest.mark.parametrize(('stages', 'intervals'), [(2, 16), (3, 8), (4, 8)])
def test_error_at_the_nodes_falls_with_the_order_2s(case: Case, stages: int,
                                                    intervals: int) -> None:
    errors = []
    for count in (intervals, 2 * intervals, 4 * intervals):
        solution = solved_on(case, count, stages)
        errors.append(error(case, solution, solution.mesh))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    # the next term of the error is two orders smaller: it bends the first halving most
    np.testing.assert_allclose(orders, 2 * stages, atol=0.5)
    assert orders[1] == pytest.approx(2 * stages, abs=0.25)


@pytest.mark.parametrize('stages', [2, 3, 4, 5, 6, 7, 8])
def test_defect_is_the_root_mean_square_between_the_nodes(stages: int) -> None:
    case = bratu(upper=True)
    solution = solved_on(case, 6, stages)
    estimate = defects(case.problem, solution)
    theta = np.linspace(0, 1, 202)[1:-1]
    times = (solution.mesh[:-1, None] + solution.steps[:, None] * theta).ravel()
    left = solution.rate(times) - case.problem.rate(times, solution(times))
    squares = left.reshape(6, -1, 2)**2
    size = np.maximum(np.abs(solution.nodes).max(axis=0), 1)
    dense = (np.sqrt(squares.mean(axis=1)) * solution.steps[:, None] / size).max(axis=1)
    # four probes stand for the whole interval; for 7 stages they lie near the zeros
    np.testing.assert_array_less(np.abs(np.log(estimate / dense)), np.log(2.5))


def test_defect_falls_with_the_order_s_plus_1() -> None:
    for stages in (2, 3, 4):
        first, second = (defects(STEEP.problem, solved_on(STEEP, count, stages)).max()
                         for count in (16, 32))
        assert np.log2(first / second) == pytest.approx(stages + 1, abs=0.3)


def test_levelled_mesh_puts_nodes_where_the_defect_is() -> None:
    case = layer_mc14(1e-2, intervals=60)
    solution = solved_on(case, 20, 3)
    mesh = levelled(solution, defects(case.problem, solution), 1e-4, fewest=25, most=60)
    assert (mesh[0], mesh[-1]) == case.span
    assert 25 <= mesh.size - 1 <= 60
    steps = np.diff(mesh)
    assert (steps > 0).all()
    # the layers are 0.1 wide
    assert max(steps[0], steps[-1]) < 1.01 * steps.min()
    assert steps.max() > 2 * steps.min()


def test_levelled_mesh_grades_towards_a_steep_interval() -> None:
    solution, defect = solved_on(STEEP, 9, 3), np.full(9, 1e-12)
    defect[4] = 1.0
    mesh = levelled(solution, defect, 1e-4, fewest=4, most=100)
    counts, _ = np.histogram(mesh, bins=solution.mesh)
    # six in the steep interval, and in its neighbours half as many instead of a sixth of one
    assert counts[4] >= 6
    assert min(counts[3], counts[5]) >= 3
    assert counts[[0, 1, 7, 8]].max() <= 1


@pytest.mark.parametrize('stages', range(2, 9))
def test_gauss_rule_meets_its_order_conditions(stages: int) -> None:
    rule, powers = GaussRule.of(stages), np.arange(1, 2 * stages + 1)
    # rounding, with coefficients of the polynomials up to 1e4 for 8 stages
    np.testing.assert_allclose(rule.weights @ np.power.outer(rule.nodes, powers - 1), 1 / powers,
                               rtol=1e-12)
    stage = powers[:stages]
    np.testing.assert_allclose(rule.matrix @ np.power.outer(rule.nodes, stage - 1),
                               np.power.outer(rule.nodes, stage) / stage, atol=1e-11)
    np.testing.assert_allclose(rule.basis(np.ones(1))[0], rule.weights, atol=1e-11)
    np.testing.assert_allclose(rule.basis_rate(rule.nodes), np.eye(stages), atol=1e-10)


@pytest.mark.parametrize('stages', [1, 9])
def test_gauss_rule_has_2_to_8_stages(stages: int) -> None:
    with pytest.raises(ValueError, match=f'stages is {stages}, but must be from 2 to 8'):
        GaussRule.of(stages)


def test_solution_is_continuous_and_its_rate_is_its_derivative() -> None:
    solution, h = solved_on(bratu(upper=True), 8, 3), 1e-6
    inner = solution.mesh[1:-1]
    # from the left the value is the end of the interval, up to Newton's tolerance
    np.testing.assert_allclose(solution(inner - 1e-13), solution.nodes[1:-1], atol=1e-10)
    times = np.linspace(0.01, 0.99, 36)  # none within h of a node
    slope = (solution(times + h) - solution(times - h)) / (2 * h)
    np.testing.assert_allclose(slope, solution.rate(times), rtol=1e-7, atol=1e-7)  # h^2, 1e-16/h
    np.testing.assert_allclose(solution(solution.mesh), solution.nodes, atol=1e-12)


def test_polynomial_survives_a_finer_mesh() -> None:
    solution = solved_on(STEEP, 8, 3)
    finer = solution.on_mesh(np.linspace(0, 1, 33))
    times = np.linspace(0, 1, 101)
    # intervals inside intervals hold the same polynomial; rounding
    np.testing.assert_allclose(finer(times), solution(times), atol=1e-13)


# Failures are statuses


SINGULAR = System(  # y'' = 0 with the slope given at both ends, differently
    rate_of=lambda t, z: [z[1], 0 * t], jacobian_of=lambda t, z: [[0, 1], [0, 0]],
    left_rows=[0, 1], left_values=[0], right_rows=[0, 1], right_values=[1], scale=np.ones(2))
LINEAR = CASES['linear']


def failing(problem: System, settings: Settings | None = None,
            monitor: Monitor | None = None) -> tuple[Status, float, str]:
    """Solve from zero on 10 intervals; return status, residual and message."""
    settings = settings or Settings(intervals=10)
    mesh = np.linspace(0, 1, settings.intervals + 1)
    guess = CollocationSolution.from_values(mesh, np.zeros((mesh.size, problem.size)),
                                            GaussRule.of(settings.stages))
    result = solve(problem, guess, settings, monitor)
    assert not result.converged
    return result.status, result.residual, result.message


def test_singular_problem_is_a_status() -> None:
    status, residual, message = failing(SINGULAR)
    assert (status, residual) == (Status.NEWTON_FAILED, np.inf)
    assert 'singular' in message


def test_resonant_problem_does_not_converge() -> None:
    # y'' = -pi^2 y + sin(pi t): singular, which the mesh hides behind amplitudes of 1e7
    problem = second_order(lambda t, y, v: -pi**2 * y + np.sin(pi * t), constant(-pi**2),
                           constant(0), 0, 0)
    assert failing(problem)[:2] == (Status.NEWTON_FAILED, np.inf)


def test_boundary_row_of_zeros_is_a_status() -> None:
    status, residual, message = failing(replace(LINEAR.problem, left_rows=[0, 0]))
    assert (status, residual) == (Status.NEWTON_FAILED, np.inf)
    assert 'boundary row is zero' in message


@pytest.mark.parametrize('bad', [np.nan, np.inf])
def test_right_hand_side_that_is_not_finite_is_a_status(bad: float) -> None:
    problem = second_order(lambda t, y, v: bad + y, constant(1), constant(0), 0, 1)
    assert failing(problem) == (Status.NEWTON_FAILED, np.inf,
                                'the right-hand side is not finite at the current point')


def test_right_hand_side_that_ends_on_the_way_is_a_status() -> None:
    # y'' = -1 / sqrt(y) from y = 1 down to y = -1, where it is not defined
    def f(t: Array, y: Array, v: Array) -> Array:
        return -1 / np.sqrt(np.where(y > 0, y, np.nan))

    problem = second_order(f, lambda t, y, v: -f(t, y, v) / (2 * y), constant(0), 1, -1)
    mesh = np.linspace(0, 1, 11)
    guess = CollocationSolution.from_values(mesh, np.ones((11, 2)), GaussRule.of(3))
    result = solve(problem, guess, Settings(intervals=10, max_intervals=100))
    assert (result.status, result.residual) == (Status.NEWTON_FAILED, np.inf)


def test_problem_without_solution_does_not_converge() -> None:
    # Bratu's problem has none beyond lambda = 3.5138
    problem = second_order(lambda t, y, v: -4 * np.exp(y), lambda t, y, v: -4 * np.exp(y),
                           constant(0), 0, 0)
    status, residual, message = failing(problem)
    assert (status, residual) == (Status.NEWTON_FAILED, np.inf)
    assert 'no step' in message or 'not converged after' in message


def test_iteration_limit_is_a_status() -> None:
    status, residual, message = failing(bratu(upper=False).problem,
                                        Settings(intervals=10, max_iterations=1))
    assert (status, residual) == (Status.NEWTON_FAILED, np.inf)
    assert message == 'not converged after 1 iterations'


def test_mesh_limit_is_a_status_with_the_defect_that_is_left() -> None:
    case = layer_mc14(1e-8, intervals=16)
    settings = Settings(intervals=10, max_intervals=16, defect_tolerance=1e-4)
    result = solve(case.problem, replace(case, settings=settings).start(), settings)
    assert result.status is Status.MESH_LIMIT
    assert 1e-4 < result.residual < np.inf
    assert result.solution.intervals == 16
    assert '16 intervals, 1.0e-04 was asked for' in result.message


def test_cancel_is_obeyed_before_the_first_iteration() -> None:
    monitor = Monitor(canceled=lambda: True)
    assert failing(LINEAR.problem, monitor=monitor) == (Status.CANCELED, np.inf, 'canceled')
    assert monitor.iteration == 0


def test_cancel_is_obeyed_between_iterations() -> None:
    monitor = Monitor()
    monitor.canceled = lambda: monitor.iteration >= 2
    case = bratu(upper=True)
    result = solve(case.problem, case.start(), case.settings, monitor)
    assert (result.status, result.iterations) == (Status.CANCELED, 2)


def test_time_limit_is_obeyed() -> None:
    monitor = Monitor(time_limit=1e-9)
    time.sleep(0.001)
    assert failing(LINEAR.problem, monitor=monitor)[::2] == (
        Status.TIMEOUT, 'time limit reached')


def test_monitor_hears_of_every_iteration() -> None:
    lines: list[Progress] = []
    case = CASES['one layer']
    monitor = Monitor(report=lines.append, phase='testing')
    result = solve(case.problem, case.start(), case.settings, monitor)
    assert [line.iteration for line in lines] == list(range(1, result.iterations + 1))
    assert {line.phase for line in lines} == {'testing'}
    assert (lines[0].intervals, lines[-1].intervals) == (10, result.solution.intervals)
    assert all(np.isfinite(line.residual) for line in lines)
    assert monitor.iteration == result.iterations


def newton_of(case: Case, shift: float = 0.0) -> NewtonOutcome:
    mesh = np.linspace(*case.span, 11)
    values = np.stack([case.exact(mesh) + shift, np.gradient(case.exact(mesh), mesh)], axis=1)
    guess = CollocationSolution.from_values(mesh, values, GaussRule.of(3))
    return newton(case.problem, guess, tolerance=1e-9, max_iterations=60, monitor=Monitor())


def test_linear_problem_takes_one_iteration_from_anywhere() -> None:
    for shift in (0.0, 1e3):
        outcome = newton_of(LINEAR, shift)
        assert (outcome.converged, outcome.iterations, outcome.message) == (True, 1, 'converged')
        assert outcome.correction <= 1e-9


class Arctangent(System):
    """z' = 0 with arctan(z(0)) = 0, the textbook's trap for undamped Newton steps."""

    def left(self, z: Array) -> tuple[Array, Array]:
        return np.arctan(z), 1 / (1 + z**2)[None]


@pytest.mark.parametrize(('start', 'iterations'), [(1.3, 5), (1.4, 5), (3.0, 6), (100.0, 12)])
def test_newton_is_damped_where_full_steps_diverge(start: float, iterations: int) -> None:
    # undamped, the iteration diverges from |z| > 1.3917
    problem = Arctangent(rate_of=lambda t, z: [0 * z[0]], jacobian_of=lambda t, z: [[0]],
                         left_rows=[], left_values=[], right_rows=[], right_values=[],
                         scale=np.ones(1))
    mesh = np.linspace(0, 1, 3)
    guess = CollocationSolution.from_values(mesh, np.full((3, 1), start), GaussRule.of(2))
    outcome = newton(problem, guess, tolerance=1e-9, max_iterations=60, monitor=Monitor())
    assert outcome.converged, outcome.message
    assert outcome.iterations <= iterations
    np.testing.assert_allclose(outcome.solution.nodes, 0, atol=1e-9)  # Newton's tolerance


def test_newton_converges_quadratically_near_the_solution() -> None:
    lines: list[Progress] = []
    case = replace(bratu(upper=False), guess=lambda t: 0.1 + 0 * t)
    newton(case.problem, case.start(), tolerance=1e-13, max_iterations=60,
           monitor=Monitor(report=lines.append))
    sizes = [line.residual for line in lines]
    # each correction is at most the square of the one before, times a constant of order one
    assert len(sizes) <= 4
    assert all(after <= 2 * before**2 for before, after in zip(sizes, sizes[1:], strict=False))


@pytest.mark.parametrize(('name', 'values'), [
    ('stages', [1, 9, 3.0]), ('intervals', [3, 1001, '60']), ('max_intervals', [3, 20001]),
    ('max_iterations', [0, 1001]), ('newton_tolerance', [9e-15, 0.02, np.nan]),
    ('defect_tolerance', [9e-13, 1.1, np.inf])])
def test_settings_out_of_bounds_are_refused_by_name(name: str, values: list[Any]) -> None:
    for value in values:
        with pytest.raises(InvalidValueError, match=f'^{name} is '):
            Settings(**{name: value})
