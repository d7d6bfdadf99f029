"""What motions with a free payload and a free duration have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from free_problems import differences, Extended, extended, steps_of
import numpy as np
from plan_checks import problem_of, solution_of
import pytest

inf = np.inf
# kept clear of the corners at which a motor switches [N m]
GAP = 1e-2
CASES = ['rigid', 'ei5', 'crane']
every_case = pytest.mark.parametrize('name', CASES)
GOALS: list[dict[str, list[float]]] = [
    {}, {'goal_position_weights': [10, 20], 'goal_velocity_weights': [1, inf]},
    {'goal_point': [-0.1, -0.8]}]


def smooth_points(problem: Extended, solution: CollocationSolution,
                  plan: Plan) -> tuple[Array, Array]:
    """Return points (k, m) away from switches, and whether a motor saturates at them (k,)."""
    times = np.linspace(*solution.mesh[[0, -1]], 23)[1:-1]
    z = solution(times)
    gap = problem.switches(times, z)
    clear = (np.abs(gap) > GAP).all(axis=1)
    control = plan.problem.model.controls(z[:, :plan.problem.size], plan.problem.p)
    saturated = (control.torque != control.free_torque).any(axis=1)
    return z[clear], saturated[clear]


@every_case
@pytest.mark.parametrize('which', [FreeDurationProblem, FreePayloadProblem])
def test_jacobian_is_the_derivative_of_the_rate(saturated: Callable[[str], Plan], name: str,
                                                which: type[Any]) -> None:
    problem, solution = extended(saturated(name), which)
    points, saturated = smooth_points(problem, solution, saturated(name))
    assert 0 < saturated.sum() < saturated.size
    for z in points:
        rate, jacobian = problem.rate_jacobian(np.zeros(1), z[None])
        np.testing.assert_array_equal(rate, problem.rate(np.zeros(1), z[None]))
        found = differences(lambda at: problem.rate(np.zeros(1), at[None])[0], z,
                            steps_of(problem))
        # rows and columns in the units of the unknowns; rounding of 1e-16 over the step of 1e-3
        units = problem.scale / problem.scale[:, None]
        error = np.abs(jacobian[0] - found) * units
        assert error.max() <= 1e-10 * np.abs(jacobian[0] * units).max()


@every_case
@pytest.mark.parametrize('which', [FreeDurationProblem, FreePayloadProblem])
def test_the_unknown_more_does_not_change_on_the_way(saturated: Callable[[str], Plan], name: str,
                                                     which: type[Any]) -> None:
    problem, solution = extended(saturated(name), which)
    constant = problem.size - (1 if which is FreeDurationProblem else 2)
    rates = problem.rate(solution.mesh, solution.nodes)
    assert not rates[:, constant].any()
    assert np.ptp(solution.nodes[:, constant]) == 0


def with_goal(plan: Plan, goal: dict[str, list[float]], which: type[Any]) -> Extended:
    """Return the motion of a plan with an unknown more and another kind of goal."""
    values = {field: getattr(plan.task, field) for field in (
        'arm', 'start_positions', 'goal_positions', 'duration', 'payload_mass')}
    problem = problem_of(plan.model, Task(**values, **goal))
    return (FreeDurationProblem(problem, 1.7) if which is FreeDurationProblem
            else FreePayloadProblem(problem, 3.0))


def check_bend_of_the_ends(rows: Array, found: Array, z: Array) -> None:
    """Check the second derivative of the state at an end, and leave it out."""
    # rounding of 1e-15 over the square of 1e-4 kg, times the costates; measured 1e-7
    assert rows[-1, -2] == pytest.approx(found[-1, -2], rel=1e-3, abs=1e-6 * np.abs(z).max())
    rows[-1, -2] = found[-1, -2] = 0


@every_case
@pytest.mark.parametrize('goal', GOALS, ids=['given', 'weighted', 'at a point'])
@pytest.mark.parametrize('which', [FreeDurationProblem, FreePayloadProblem])
def test_rows_are_derivatives_of_the_conditions(
        saturated: Callable[[str], Plan], name: str, goal: dict[str, list[float]],
        which: type[Any]) -> None:
    made = with_goal(saturated(name), goal, which)
    solution, steps = made.extend(solution_of(saturated(name))), steps_of(made)
    # rounding of H, 1e-13 of 10 J, over steps of 1e-6; of the sag over 1e-4 kg
    atol = 1e-6 if which is FreeDurationProblem else 1e-8
    if which is FreePayloadProblem:
        steps[-2] = 1e-2  # the change of the sag is itself taken from differences
    for side, z in ((made.left, solution.nodes[0]), (made.right, solution.nodes[-1])):
        residual, rows = side(z)
        found = differences(lambda at, side=side: side(at)[0], z, steps)
        if which is FreePayloadProblem:
            check_bend_of_the_ends(rows, found, z)
        assert rows.shape == (residual.size, made.size)
        np.testing.assert_allclose(rows, found, rtol=1e-7, atol=atol)
    assert made.left(z)[0].size + made.right(z)[0].size == made.size


@every_case
@pytest.mark.parametrize('which', [FreeDurationProblem, FreePayloadProblem])
def test_switches_are_those_of_the_motion(saturated: Callable[[str], Plan], name: str,
                                          which: type[Any]) -> None:
    made, solution = extended(saturated(name), which)
    problem, inner = saturated(name).problem, solution_of(saturated(name))
    np.testing.assert_array_equal(made.switches(solution.mesh, solution.nodes),
                                  problem.switches(inner.mesh, inner.nodes))
