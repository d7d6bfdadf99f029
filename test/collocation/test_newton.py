"""Newton's method for the collocation equations: its steps, its work, and every way to fail."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

from bvp_problems import bratu, Case, CASES, mc_14, second_order, System
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor, Progress
from flex_planner.collocation import (
    CollocationSolution,
    GaussRule,
    solve,
    SolverSettings,
    SolverStatus,
)
from flex_planner.collocation.newton import newton, NewtonOutcome
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]
pi = np.pi
LINEAR = CASES['linear']


def newton_of(case: Case, shift: float = 0.0, tolerance: float = 1e-9,
              monitor: Monitor | None = None) -> NewtonOutcome:
    """Start on 10 intervals from the closed form and a shift."""
    mesh = np.linspace(*case.span, 11)
    values = np.stack([case.exact(mesh) + shift, np.gradient(case.exact(mesh), mesh)], axis=1)
    guess = CollocationSolution.from_values(mesh, values, GaussRule.of(3))
    return newton(case.problem, guess, tolerance=tolerance, max_iterations=60,
                  monitor=monitor or Monitor())


# Steps


@pytest.mark.parametrize('shift', [0.0, 1e3])
def test_linear_problem_takes_one_iteration_from_anywhere(shift: float) -> None:
    outcome = newton_of(LINEAR, shift)
    assert (outcome.converged, outcome.iterations, outcome.message) == (True, 1, 'converged')
    assert outcome.correction <= 1e-9


@pytest.mark.parametrize(('start', 'iterations'), [
    (1.0, 3), (1.3, 2), (1.4, 2), (3.0, 4), (100.0, 8)])
def test_newton_is_damped_where_full_steps_diverge(start: float, iterations: int) -> None:
    # z' = 0 with arctan(z(0)) = 0: undamped, the iteration diverges from |z| > 1.3917
    problem = System(size=1, rate_of=lambda t, z: [0 * z[0]],
                     left_of=lambda z: [np.arctan(z[0])], right_of=lambda z: [])
    mesh = np.linspace(0, 1, 3)
    guess = CollocationSolution.from_values(mesh, np.full((3, 1), start), GaussRule.of(2))
    outcome = newton(problem, guess, tolerance=1e-9, max_iterations=60, monitor=Monitor())
    assert outcome.converged, outcome.message
    assert outcome.iterations <= iterations
    np.testing.assert_allclose(outcome.solution.nodes, 0, atol=1e-9)  # Newton's tolerance


@dataclass(frozen=True, kw_only=True, eq=False)
class Watched(System):
    """A system that notes what it is asked for, F or J, and may change the answer."""

    inner: System
    calls: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, problem: System) -> Watched:
        return cls(**vars(problem), inner=problem)

    def rate(self, t: Array, z: Array) -> Array:
        self.calls.append('F')
        return self.inner.rate(t, z)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        self.calls.append('J')
        return self.inner.rate_jacobian(t, z)


def test_matrix_is_kept_while_it_pays() -> None:
    lines: list[Progress] = []
    problem = Watched.of(bratu(upper=False).problem)
    outcome = newton_of(replace(bratu(upper=False), problem=problem), 0.1, tolerance=1e-13,
                        monitor=Monitor(report=lines.append))
    assert outcome.converged
    assert outcome.correction <= 1e-13
    # from 0.1 away each correction with the first matrix is a hundredth of the one before
    assert ''.join(problem.calls) == 'JFFFFFFF'
    assert outcome.iterations == len(lines) == 1


def test_matrix_is_renewed_where_it_does_not_pay() -> None:
    problem = Watched.of(bratu(upper=True).problem)
    outcome = newton_of(replace(bratu(upper=True), problem=problem), 0.5, tolerance=1e-13)
    assert outcome.converged
    assert ''.join(problem.calls).startswith('JFFJF')
    assert outcome.iterations == problem.calls.count('J') == 2


def test_monitor_hears_of_every_iteration() -> None:
    lines: list[Progress] = []
    case, settings = CASES['MC 14, two layers'], SolverSettings(intervals=10)
    monitor = Monitor(report=lines.append, phase='testing')
    result = solve(case.problem, case.start(settings), settings, monitor)
    assert [line.iteration for line in lines] == list(range(1, result.iterations + 1))
    assert {line.phase for line in lines} == {'testing'}
    assert (lines[0].intervals, lines[-1].intervals) == (10, result.solution.intervals)
    assert all(np.isfinite(line.residual) for line in lines)
    assert monitor.iteration == result.iterations


# Failures are statuses


def failing(problem: System, settings: SolverSettings | None = None,
            monitor: Monitor | None = None) -> tuple[SolverStatus, float, str]:
    """Solve from zero on 10 intervals; return status, residual and message."""
    settings = settings or SolverSettings(intervals=10)
    mesh = np.linspace(0, 1, settings.intervals + 1)
    guess = CollocationSolution.from_values(mesh, np.zeros((mesh.size, problem.size)),
                                            settings.rule)
    result = solve(problem, guess, settings, monitor)
    assert not result.converged
    assert np.isinf(result.errors).all() or result.status is SolverStatus.MESH_LIMIT
    return result.status, result.residual, result.message


def test_singular_problem_is_a_status() -> None:
    # y'' = 0 with the slope given at both ends, differently
    problem = System(size=2, rate_of=lambda t, z: [z[1], 0 * z[0]], left_of=lambda z: [z[1]],
                     right_of=lambda z: [z[1] - 1])
    status, residual, message = failing(problem)
    assert (status, residual) == (SolverStatus.NEWTON_FAILED, np.inf)
    assert 'singular' in message


def test_resonant_problem_does_not_converge() -> None:
    # y'' = -pi^2 y + sin(pi t): singular, which the mesh hides behind amplitudes of 1e7 and more
    problem = second_order(lambda t, y, v: -pi**2 * y + np.sin(pi * t), 0, 0)
    assert failing(problem,
                   SolverSettings(intervals=10, stages=3))[0] is not SolverStatus.CONVERGED


def test_boundary_row_of_zeros_is_a_status() -> None:
    status, residual, message = failing(replace(LINEAR.problem, left_of=lambda z: [0 * z[0]]))
    assert (status, residual) == (SolverStatus.NEWTON_FAILED, np.inf)
    assert 'boundary row is zero' in message


@pytest.mark.parametrize('bad', [np.nan, np.inf])
def test_right_hand_side_that_is_not_finite_is_a_status(bad: float) -> None:
    problem = second_order(lambda t, y, v: bad + y, 0, 1)
    assert failing(problem) == (SolverStatus.NEWTON_FAILED, np.inf,
                                'the right-hand side is not finite at the current point')


def test_right_hand_side_that_ends_on_the_way_is_a_status() -> None:
    # y'' = -1 / sqrt(y) from y = 1 down to y = -1, where it is not defined
    problem = second_order(lambda t, y, v: np.where(np.real(y) > 0, -np.abs(y)**-0.5, np.nan),
                           1, -1)
    case = Case(problem=problem, guess=np.ones_like)
    result = solve(problem, case.start(SolverSettings()), SolverSettings(max_intervals=100))
    assert (result.status, result.residual) == (SolverStatus.NEWTON_FAILED, np.inf)


def test_problem_without_solution_does_not_converge() -> None:
    # Bratu's problem has none beyond lambda = 3.5138
    status, residual, message = failing(second_order(lambda t, y, v: -4 * np.exp(y), 0, 0))
    assert (status, residual) == (SolverStatus.NEWTON_FAILED, np.inf)
    assert 'no step' in message or 'not converged after' in message


def test_iteration_limit_is_a_status() -> None:
    case, settings = CASES['MC 20, corner'], SolverSettings(max_iterations=5)
    result = solve(case.problem, case.start(settings), settings)
    assert (result.status, result.residual) == (SolverStatus.NEWTON_FAILED, np.inf)
    assert result.message == 'not converged after 5 iterations'


@pytest.mark.parametrize(('limits', 'intervals'), [
    ({'max_intervals': 12}, 12), ({'max_meshes': 1}, 10)])
def test_mesh_limit_is_a_status_with_the_error_that_is_left(limits: dict[str, int],
                                                            intervals: int) -> None:
    case, settings = mc_14(1e-8), SolverSettings(intervals=10, stages=3, **limits)
    result = solve(case.problem, case.start(settings), settings)
    assert result.status is SolverStatus.MESH_LIMIT
    assert result.solution.intervals == intervals
    assert result.solution.rule.stages == 3  # not the improved one
    assert 1e-6 < result.errors.max() < np.inf
    assert 1e-6 < result.residual < np.inf
    assert result.message == (f'an error of {result.errors.max():.1e} is left on {intervals} '
                              'intervals, 1.0e-06 was asked for')


# Stops


def test_cancel_is_obeyed_before_the_first_iteration() -> None:
    monitor = Monitor(canceled=lambda: True)
    assert failing(LINEAR.problem, monitor=monitor) == (SolverStatus.CANCELED, np.inf, 'canceled')
    assert monitor.iteration == 0


def test_cancel_is_obeyed_between_iterations() -> None:
    monitor = Monitor()
    monitor.canceled = lambda: monitor.iteration >= 2
    case, settings = mc_14(1e-8), SolverSettings()
    result = solve(case.problem, case.start(settings), settings, monitor)
    assert (result.status, result.iterations) == (SolverStatus.CANCELED, 2)
    assert np.isinf(result.errors).all()


@dataclass(frozen=True, kw_only=True, eq=False)
class Laborious(System):
    """z' = 0 of 40 unknowns, whose Jacobian takes twice the time of a compiled arm's."""

    clock: list[float] = field(default_factory=lambda: [0.0])

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        self.clock[0] += 50e-9 * t.size * self.size**2
        return np.zeros_like(z), np.zeros((t.size, self.size, self.size))


def laborious() -> tuple[Laborious, CollocationSolution]:
    """Return a problem whose Jacobian on 2000 intervals takes 1.28 s, and a guess."""
    problem = Laborious(size=40, rate_of=lambda t, z: [0 * each for each in z],
                        left_of=lambda z: [*z], right_of=lambda z: [])
    mesh = np.linspace(0, 1, 2001)
    return problem, CollocationSolution.from_values(mesh, np.ones((2001, 40)), GaussRule.of(8))


def test_cancel_is_obeyed_inside_a_long_jacobian() -> None:
    problem, guess = laborious()
    monitor = Monitor(canceled=lambda: problem.clock[0] >= 0.3)
    result = solve(problem, guess, SolverSettings(), monitor)
    assert (result.status, result.iterations) == (SolverStatus.CANCELED, 0)
    assert problem.clock[0] - 0.3 <= 0.05


def test_time_limit_is_obeyed_inside_a_long_jacobian(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, guess = laborious()
    clock = SimpleNamespace(monotonic=lambda: problem.clock[0])
    monkeypatch.setattr('flex_planner.base.progress.time', clock)
    result = solve(problem, guess, SolverSettings(), Monitor(time_limit=0.3, started=0.0))
    assert (result.status, result.message) == (SolverStatus.TIMEOUT, 'time limit reached')
    assert problem.clock[0] - 0.3 <= 0.05


# Settings


@pytest.mark.parametrize(('name', 'values'), [
    ('stages', [1, 12, 3.0]), ('intervals', [3, 2001, '60']), ('max_intervals', [3, 20001]),
    ('max_iterations', [0, 1001]), ('max_meshes', [0, 101]),
    ('error_tolerance', [9e-12, 1.1, np.inf, np.nan])])
def test_settings_out_of_bounds_are_refused_by_name(name: str, values: list[Any]) -> None:
    for value in values:
        with pytest.raises(InvalidValueError, match=f'^{name} is '):
            SolverSettings(**{name: value})


def test_settings_on_their_bounds_are_taken() -> None:
    for stages in (2, 11):
        settings = SolverSettings(stages=stages, intervals=4, max_intervals=4, max_iterations=1,
                                  max_meshes=1, error_tolerance=1e-11)
        assert settings.rule is GaussRule.of(stages)
    assert SolverSettings(intervals=20000, max_intervals=20000,
                          error_tolerance=1).intervals == 20000


def test_guess_of_another_rule_is_taken_over() -> None:
    case, settings = bratu(upper=True), SolverSettings(stages=5)
    result = solve(case.problem, case.start(SolverSettings(stages=3, intervals=10)), settings)
    assert result.converged
    assert result.solution.rule.stages == 6
