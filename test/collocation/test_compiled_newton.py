"""Newton's method in compiled code: what the Python version does, and every way to fail."""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from pathlib import Path
from typing import Any

from flex_planner.base.compiler import compile_library, find_compiler
from flex_planner.base.progress import Monitor, Progress, StopReason
from flex_planner.collocation import CollocationSolution, GaussRule, solve, SolverSettings
from flex_planner.collocation.core import CORE_VARIABLE
from flex_planner.collocation.newton import newton
from flex_planner.collocation.newton_outcome import NewtonOutcome
from flex_planner.collocation.problem import (
    compiled_rate_of,
    CompiledRate,
    SingularSystemError,
)
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]

# y'' = -a exp(y) of Bratu; in[1] is a
SOURCE = """
#include <math.h>
static void rate_at(const double *z, double a, double *rate, double *jacobian) {
  rate[0] = z[1];
  rate[1] = -a * exp(z[0]);
  if (jacobian) jacobian[0] = 0, jacobian[1] = 1, jacobian[2] = rate[1], jacobian[3] = 0;
}
int rate(long long n, int chain, const double *const *in, double *const *out) {
  for (long long k = 0; k < n; ++k) rate_at(in[0] + 2 * k, in[1][0], out[0] + 2 * k, 0);
  return chain;
}
int rate_jacobian(long long n, int chain, const double *const *in, double *const *out) {
  for (long long k = 0; k < n; ++k)
    rate_at(in[0] + 2 * k, in[1][0], out[0] + 2 * k, out[1] + 4 * k);
  return chain;
}
"""


class Bratu:
    """Bratu's problem with y given at both ends, and its compiled F."""

    size = 2
    scale = np.ones(2)
    explicit = np.array([0])

    def __init__(self, library: ctypes.CDLL, a: float = 1.0) -> None:
        self._library, self.a = library, np.array([a])
        self.end: Callable[[Array], float] = lambda z: float(z[0])
        self.points = 0

    def rate(self, t: Array, z: Array) -> Array:
        self.points += len(z)
        return np.stack([z[:, 1], -self.a * np.exp(z[:, 0])], axis=1)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        jacobian = np.zeros((len(z), 2, 2))
        jacobian[:, 0, 1], jacobian[:, 1, 0] = 1, -self.a * np.exp(z[:, 0])
        return self.rate(t, z), jacobian

    def switches(self, t: Array, z: Array) -> Array:
        return np.zeros((len(z), 0))

    def left(self, z: Array) -> tuple[Array, Array]:
        return z[:1], np.array([[1.0, 0]])

    def right(self, z: Array) -> tuple[Array, Array]:
        return np.array([self.end(z)]), np.array([[1.0, 0]])

    def compiled_rate(self) -> CompiledRate:
        addresses = [ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value or 0
                     for name in ('rate', 'rate_jacobian')]
        return CompiledRate(addresses[0], addresses[1], (self.a,), self._library)


@pytest.fixture(scope='module')
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder: Path = tmp_path_factory.mktemp('bratu')
    return ctypes.CDLL(str(compile_library(find_compiler(), SOURCE, folder)))


def solve_from(problem: Bratu, height: float, monitor: Monitor | None = None, *,
               intervals: int = 12, most: int = 40, exact: bool = False) -> NewtonOutcome:
    mesh = np.linspace(0, 1, intervals + 1)
    nodes = np.stack([4 * height * mesh * (1 - mesh), 4 * height * (1 - 2 * mesh)], axis=1)
    guess = CollocationSolution.from_values(mesh, nodes, GaussRule.of(4))
    return newton(problem, guess, tolerance=1e-10, max_iterations=most,
                  monitor=monitor or Monitor(), exact=exact)


# near both solutions, where steps are damped, and where none helps
# exact steps from 9 come to values of 1e3, where rounding counts
@pytest.mark.parametrize(('height', 'exact'), [
    *((height, False) for height in (0.0, 3.0, 5.0, 7.0, 9.0)),
    *((height, True) for height in (0.0, 3.0, 5.0, 7.0))])
def test_iterates_are_those_of_python(library: ctypes.CDLL, height: float, exact: bool,
                                      monkeypatch: pytest.MonkeyPatch) -> None:
    found = solve_from(Bratu(library), height, exact=exact)
    monkeypatch.setenv(CORE_VARIABLE, 'numpy')
    expected = solve_from(Bratu(library), height, exact=exact)
    assert (found.converged, found.iterations, found.message, found.coarse) == (
        expected.converged, expected.iterations, expected.message, expected.coarse)
    np.testing.assert_allclose(found.solution.nodes, expected.solution.nodes, rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.solution.stages, expected.solution.stages, rtol=1e-11,
                               atol=1e-10)


@pytest.mark.parametrize('core', ['', 'numpy'])
def test_jacobians_of_all_stages_converge_where_their_mean_does_not_fit(
        library: ctypes.CDLL, core: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CORE_VARIABLE, core)
    mean, exact = (solve_from(Bratu(library), 5.0, intervals=2, exact=exact)
                   for exact in (False, True))
    assert not mean.converged
    assert exact.converged and exact.iterations <= 3


def test_no_point_is_evaluated_in_python(library: ctypes.CDLL) -> None:
    problem = Bratu(library)
    solve_from(problem, 0.0)
    assert problem.points == 0


def test_guess_stays_as_it_is(library: ctypes.CDLL) -> None:
    guess = CollocationSolution.from_values(np.linspace(0, 1, 9), np.zeros((9, 2)),
                                            GaussRule.of(4))
    newton(Bratu(library), guess, tolerance=1e-10, max_iterations=9, monitor=Monitor())
    assert not guess.nodes.any()
    assert not guess.stages.any()


def test_estimate_with_its_system_is_that_of_python(library: ctypes.CDLL,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    settings = SolverSettings(stages=4, intervals=6, error_tolerance=1e-9)
    guess = CollocationSolution.from_values(np.linspace(0, 1, 7), np.zeros((7, 2)), settings.rule)
    found = solve(Bratu(library), guess, settings)
    monkeypatch.setenv(CORE_VARIABLE, 'numpy')
    expected = solve(Bratu(library), guess, settings)
    assert (found.status, found.meshes) == (expected.status, expected.meshes)
    np.testing.assert_allclose(found.errors, expected.errors, rtol=1e-3)  # differences of 1e-10
    np.testing.assert_allclose(found.solution.nodes, expected.solution.nodes, rtol=0, atol=1e-12)


# How it ends


@pytest.mark.parametrize('core', ['', 'numpy'])
def test_problem_without_solution_ends_alike(library: ctypes.CDLL, core: str,
                                             monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CORE_VARIABLE, core)
    outcome = solve_from(Bratu(library, a=5.0), 1.0)  # there is none beyond 3.51
    assert not outcome.converged
    assert outcome.message == "no step of Newton's method reduces the error"


@pytest.mark.parametrize('core', ['', 'numpy'])
def test_other_ends_are_told_alike(library: ctypes.CDLL, core: str,
                                   monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CORE_VARIABLE, core)
    assert solve_from(Bratu(library), 9.0, most=2).message == 'not converged after 2 iterations'
    outcome = solve_from(Bratu(library, a=np.nan), 0.0)
    assert outcome.message == 'the right-hand side is not finite at the current point'
    problem = Bratu(library)
    problem.right = lambda z: (np.zeros(1), np.zeros((1, 2)))  # type: ignore[method-assign]
    assert solve_from(problem, 0.0).message == 'a boundary row is zero or not finite'


def test_refusal_of_a_problem_is_its_message(library: ctypes.CDLL) -> None:
    problem = Bratu(library)

    def refuse(z: Array) -> float:
        raise SingularSystemError('no such end')

    problem.end = refuse
    assert solve_from(problem, 0.0).message == 'no such end'


@pytest.mark.parametrize('step', [0, 2])
def test_monitor_stops_it_before_a_step(library: ctypes.CDLL, step: int) -> None:
    seen: list[Progress] = []
    monitor = Monitor(canceled=lambda: len(seen) >= step, report=seen.append)
    outcome = solve_from(Bratu(library), 9.0, monitor)
    assert (outcome.stopped, outcome.iterations) == (StopReason.CANCELED, step)
    assert [progress.iteration for progress in seen] == [*range(1, step + 1)]


def test_monitor_is_asked_inside_a_long_step(library: ctypes.CDLL) -> None:
    # the first step factorises once; only asking on the way stops it before it is through
    asked: list[int] = []

    def canceled() -> bool:
        asked.append(1)
        return len(asked) > 1

    outcome = solve_from(Bratu(library), 0.0, Monitor(canceled=canceled), intervals=100_000)
    assert (outcome.stopped, outcome.iterations) == (StopReason.CANCELED, 0)


@pytest.mark.parametrize('place', ['end', 'report'])
def test_error_in_a_call_is_raised(library: ctypes.CDLL, place: str) -> None:
    def fail(*arguments: Any) -> Any:
        raise KeyError(place)

    problem, monitor = Bratu(library), Monitor()
    if place == 'end':
        problem.end = fail
    else:
        monitor = Monitor(report=fail)
    with pytest.raises(KeyError, match=place):
        solve_from(problem, 0.0, monitor)


def test_problem_with_a_right_hand_side_of_its_own_is_not_that_of_its_class(
        library: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> None:
    class Straight(Bratu):
        def rate(self, t: Array, z: Array) -> Array:
            self.points += len(z)
            return np.stack([z[:, 1], np.zeros(len(z))], axis=1)

    derived, changed = Straight(library), Bratu(library)
    monkeypatch.setattr(changed, 'rate', derived.rate)
    for problem in (derived, changed):
        assert compiled_rate_of(problem) is None
    assert compiled_rate_of(Bratu(library)) is not None
    assert np.abs(solve_from(derived, 0.0).solution.nodes).max() < 1e-9
    assert derived.points
