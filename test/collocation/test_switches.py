"""Switches of F: found, given a node, and what that is worth for bounded controls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bvp_problems import CASES, solved_on, System
from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    solve,
    SolverSettings,
    SolverStatus,
)
from flex_planner.collocation.mesh import switching_times
from flex_planner.collocation.newton import newton
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]
pi = np.pi


# Switching times


def switching(f: Callable[[Array], list[Any]]) -> Array:
    """Return the switching times of functions of time on ten intervals."""
    mesh = np.linspace(0, 1, 11)
    problem = System(size=1, rate_of=lambda t, z: [0], left_of=lambda z: [z[0]],
                     right_of=lambda z: [], switches_of=lambda t, z: f(t))
    solution = CollocationSolution.from_values(mesh, np.zeros((mesh.size, 1)), GaussRule.of(8))
    return switching_times(problem, solution)


@pytest.mark.parametrize(('f', 'times'), [
    (lambda t: [np.sin(20 * t + 0.3)], (pi * np.arange(1, 7) - 0.3) / 20),
    # several in an interval
    (lambda t: [np.sin(100 * t + 0.3)], (pi * np.arange(1, 32) - 0.3) / 100),
    (lambda t: [np.exp(3 * t) - np.exp(1.234)], [1.234 / 3]),
    (lambda t: [np.sqrt(t) - np.sqrt(0.437)], [0.437]),
    (lambda t: [np.tanh((t - 0.437) * 500)], [0.437]),
    (lambda t: [np.cos(3 * t), np.exp(t) - 2], [pi / 6, np.log(2)])])
def test_changes_of_sign_are_found_to_rounding(f: Callable[[Array], list[Any]],
                                               times: Any) -> None:
    found = switching(f)
    assert found.size == len(times)
    np.testing.assert_allclose(found, np.sort(times), rtol=0, atol=1e-14)


@pytest.mark.parametrize(('f', 'times'), [
    # straight, and at a node
    (lambda t: [0.437 - t], [0.437]),
    (lambda t: [t - 0.5], [0.5]),
    (lambda t: [0.5 - t], [0.5]),
    # two functions, the same time, and others near it
    (lambda t: [t - 0.2, 0.2 - t, t - 0.31, t - 0.3101], [0.2, 0.31, 0.3101]),
    # tangencies, and zeros at the ends
    (lambda t: [(t - 0.5)**2, (t - 0.437)**2, -(t - 0.437)**2], []),
    (lambda t: [t, -t, 1 - t, t - 1], []),
    (lambda t: [0 * t, 1 + 0 * t], []),
    (lambda t: [], [])])
def test_changes_of_sign_are_told_from_zeros(f: Callable[[Array], list[Any]],
                                             times: list[float]) -> None:
    found = switching(f)
    assert found.size == len(times)
    np.testing.assert_allclose(found, times, rtol=0, atol=1e-15)


def test_change_of_sign_at_a_node_is_not_lost() -> None:
    # where the mesh has a node on a switch, the function is zero up to rounding
    rng = np.random.default_rng(0)
    problem = System(size=1, rate_of=lambda t, z: [1], left_of=lambda z: [z[0]],
                     right_of=lambda z: [], switches_of=lambda t, z: [z[0]])
    for _ in range(50):
        mesh = np.sort(np.concatenate([[0, 1], rng.uniform(0, 1, 5)]))
        solution = CollocationSolution.from_values(mesh, (mesh - mesh[3])[:, None],
                                                   GaussRule.of(8))
        np.testing.assert_allclose(switching_times(problem, solution), mesh[3:4], atol=1e-15)


# A kink: y'' = |y|


KINK = CASES['kink']


@pytest.mark.parametrize('stages', [2, 3])
def test_node_on_a_kink_keeps_the_order(stages: int) -> None:
    errors, without = [], []
    for half in (8, 16):
        mesh = np.concatenate([np.linspace(-1, 0, half, endpoint=False),
                               np.linspace(0, 1.3, half + 1)])
        errors.append(KINK.error(solved_on(KINK, mesh, stages)))
        without.append(KINK.error(solved_on(KINK, 2 * half, stages)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * stages, abs=0.1)
    # on as many intervals, hundreds and millions of times worse
    assert without[1] > {2: 10, 3: 1e6}[stages] * errors[1]


@pytest.mark.parametrize('tolerance', [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize('intervals', [4, 10, 20])
def test_kink_is_met_by_a_node(tolerance: float, intervals: int) -> None:
    settings = SolverSettings(intervals=intervals, error_tolerance=tolerance)
    result = solve(KINK.problem, KINK.start(settings), settings)
    assert result.converged
    assert KINK.error(result.solution) <= 0.1 * tolerance
    # y(t) = t to first order
    np.testing.assert_allclose(result.switches, [0], atol=tolerance)
    nearest = np.abs(result.solution.mesh).min()
    assert nearest <= np.sqrt(tolerance) * result.solution.steps.max()
    assert result.meshes <= 3


# Bounded controls


def clipped(x: Any, bound: float) -> Any:
    """Return x within its bounds; analytic where it is smooth."""
    return np.where(np.real(x) < -bound, -bound, np.where(np.real(x) > bound, bound, x))


BOUND = 4.5
# u = clip(SLOPE (1/2 - t)) brings a mass from 0 to 1 in a second; it is linear for LINEAR
# seconds before and after the middle, by 1 = BOUND (1/4 - LINEAR^2 / 3)
LINEAR = np.sqrt(3 * (1/4 - 1 / BOUND))
SLOPE = BOUND / LINEAR


def least_effort(bound: float, *, switches: bool = True) -> System:
    """Return q'' = u, cost 1/2 u^2, |u| <= bound, from rest to rest: u = clip(-psi_2)."""
    return System(
        size=4, rate_of=lambda t, z: [z[1], clipped(-z[3], bound), 0, -z[2]],
        left_of=lambda z: [z[0], z[1]], right_of=lambda z: [z[0] - 1, z[1]],
        switches_of=lambda t, z: [z[3] + bound, z[3] - bound] if switches else [],
        explicit=np.array([0, 2]))


def unbounded(intervals: int, stages: int = 8) -> CollocationSolution:
    """Return the motion of least effort without bounds."""
    t = np.linspace(0, 1, intervals + 1)
    values = [3 * t**2 - 2 * t**3, 6 * t * (1 - t), -12 + 0 * t, 12 * t - 6]
    return CollocationSolution.from_values(t, np.stack(values, axis=1), GaussRule.of(stages))


def solved(problem: System, guess: CollocationSolution, **settings: Any) -> CollocationResult:
    result = solve(problem, guess, SolverSettings(**settings))
    assert result.status is SolverStatus.CONVERGED, result.message
    return result


def costate_error(solution: CollocationSolution, k: float = SLOPE) -> float:
    """Return the largest error of psi_1 = -k and psi_2 = k (t - 1/2) at the nodes, relative."""
    expected = np.stack([-k + 0 * solution.mesh, k * (solution.mesh - 0.5)], axis=1)
    return float(np.abs(solution.nodes[:, 2:] - expected).max() / k)


@pytest.mark.parametrize('stages', [2, 3, 4, 8, 11])
@pytest.mark.parametrize('intervals', [10, 21])
def test_bounded_least_effort_is_found_to_ten_digits(stages: int, intervals: int) -> None:
    result = solved(least_effort(BOUND), unbounded(intervals), stages=stages,
                    error_tolerance=1e-10)
    np.testing.assert_allclose(result.switches, [0.5 - LINEAR, 0.5 + LINEAR], atol=1e-10)
    assert costate_error(result.solution) <= 1e-10
    times = np.linspace(0, 1, 101)
    u = np.clip(-result.solution(times)[:, 3], -BOUND, BOUND)
    np.testing.assert_allclose(u, np.clip(SLOPE * (0.5 - times), -BOUND, BOUND), atol=1e-9)


def test_same_intervals_are_orders_worse_without_switches() -> None:
    result = solved(least_effort(BOUND), unbounded(20), error_tolerance=1e-10)
    count = result.solution.intervals
    other = solve(least_effort(BOUND, switches=False), unbounded(count),
                  SolverSettings(error_tolerance=1e-11, max_meshes=1))
    assert count <= 21
    assert costate_error(result.solution) <= 1e-13
    assert costate_error(other.solution) >= 5e-6


def test_stalled_newton_is_rescued_by_nodes_on_the_switches() -> None:
    # nearly infeasible: all but a 37th of the second is spent on the bounds
    bound = 4.001
    linear = np.sqrt(3 * (1/4 - 1 / bound))
    stalled = newton(least_effort(bound), unbounded(20), tolerance=1e-9, max_iterations=60,
                     monitor=Monitor())
    assert (stalled.converged, stalled.message) == (
        False, "no step of Newton's method reduces the error")
    result = solved(least_effort(bound), unbounded(20), error_tolerance=1e-8)
    np.testing.assert_allclose(result.switches, [0.5 - linear, 0.5 + linear], atol=1e-8)
    assert costate_error(result.solution, bound / linear) <= 1e-6
    assert result.meshes <= 6


def time_and_effort(R: float) -> System:
    """
    Return q'' = u, |u| <= 1, cost T + integral of R u^2 / 2, from rest to rest one metre away.

    The final time is a state, T' = 0, on the interval [0, 1]; H(T) = -1 chooses it.

    """
    def rate(s: Array, z: Any) -> list[Any]:
        _, v, psi_1, psi_2, T = z
        return [T * v, T * clipped(-psi_2 / R, 1), 0, -T * psi_1, 0]

    def right(z: Any) -> list[Any]:
        q, v, psi_1, psi_2, _ = z
        u = clipped(-psi_2 / R, 1)
        return [q - 1, v, 1 + R / 2 * u**2 + psi_1 * v + psi_2 * u]

    return System(size=5, rate_of=rate, left_of=lambda z: [z[0], z[1]], right_of=right,
                  switches_of=lambda s, z: [z[3] / R + 1, z[3] / R - 1],
                  explicit=np.array([0, 2, 4]))


def optimal_time(R: float) -> tuple[float, float]:
    """
    Return the optimal time, and the share of it on which the control is linear.

    H = 0 at the end gives the slope k = (1/R + 1/2) / (T/2) of u = clip(k (T/2 - t)), linear for
    the share b = 2 / (k T) of T, and the distance is T^2/4 (1 - b^2/3).

    """
    share = 2 * R / (2 + R)
    return 2 / np.sqrt(1 - share**2 / 3), share


def test_time_and_effort_tends_to_least_time() -> None:
    t, times = np.linspace(0, 1, 11), []
    values = [t, 1 + 0 * t, -2 + 0 * t, 4 * t - 2, 3 + 0 * t]
    point = CollocationSolution.from_values(t, np.stack(values, axis=1), GaussRule.of(8))
    for R in (1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001):
        result = solved(time_and_effort(R), point, error_tolerance=1e-10)
        point, (time, share) = result.solution, optimal_time(R)
        np.testing.assert_allclose(point.nodes[:, 4], time, rtol=1e-12)
        np.testing.assert_allclose(result.switches, [(1 - share) / 2, (1 + share) / 2],
                                   atol=1e-10)
        times.append(time)
        # bang-bang control takes 2 sqrt(distance / bound) = 2, and effort costs R^2 / 3 more
        assert time - 2 == pytest.approx(R**2 / 3, rel=R + 1e-6)
    assert (np.diff(times) < 0).all()


def test_expensive_effort_leaves_the_control_inside_its_bounds() -> None:
    # u = k (T/2 - t) with R (k T/2)^2 / 2 = 1 and k T^3 / 12 = 1
    t, R = np.linspace(0, 1, 11), 4.0
    values = [t, 1 + 0 * t, -2 + 0 * t, 4 * t - 2, 3 + 0 * t]
    guess = CollocationSolution.from_values(t, np.stack(values, axis=1), GaussRule.of(8))
    result = solved(time_and_effort(R), guess)
    assert result.switches.size == 0
    np.testing.assert_allclose(result.solution.nodes[:, 4], np.sqrt(6 / np.sqrt(2 / R)),
                               rtol=1e-12)
