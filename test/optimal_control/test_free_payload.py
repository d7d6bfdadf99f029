"""Duration and payload as unknowns: derivatives against differences, and there and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
from plan_checks import problem_of, share_of, solution_of
import pytest

PlanFactory = Callable[..., Plan]
TaskFactory = Callable[..., Task]
Extended = FreeDurationProblem | FreePayloadProblem

inf = np.inf
# kept clear of the corners at which a motor switches [N m]
ROOM = 1e-2
CASES = ['rigid', 'ei5', 'crane']
every_case = pytest.mark.parametrize('name', CASES)


@pytest.fixture(scope='module')
def crane_task(crane_model: ArmModel) -> Task:
    """Return a motion under gravity with all weights, on whose way motors saturate."""
    return Task(arm=crane_model.arm, start_positions=[-1.6, 0.2], goal_positions=[-1.2, -0.2],
                duration=0.5, payload_mass=0.2, payload_inertia=0.01, effort_weights=[0.5, 2.0],
                position_weights=[1, 2, 3, 4, 5], velocity_weights=[5, 4, 3, 2, 1])


@pytest.fixture(scope='module')
def plan(request: pytest.FixtureRequest, plan_of: PlanFactory,
         crane_task: Task) -> Callable[[str], Plan]:
    """Return plans of saturated motions."""
    known = {'crane': plan_path(crane_task, model=request.getfixturevalue('crane_model'))}
    assert known['crane'].solved, known['crane'].message

    def saturated(name: str) -> Plan:
        return known[name] if name in known else plan_of(name, 5.5)

    return saturated


def extended(plan: Plan, which: type[Any]) -> tuple[Extended, CollocationSolution]:
    """Return a problem with an unknown more, and a point of it that is no solution."""
    problem = problem_of(plan.model, plan.task)
    made = (FreeDurationProblem(problem) if which is FreeDurationProblem
            else FreePayloadProblem(plan.problem, 3.0))
    return made, made.extend(solution_of(plan))


def differences(function: Callable[[Array], Array], z: Array, steps: Array) -> Array:
    """Return the Jacobian by differences of fourth order, shape (n, m)."""
    columns = []
    for k, h in enumerate(steps):
        change = np.zeros_like(z)
        change[k] = h
        values = [function(z + count * change) for count in (-2, -1, 1, 2)]
        columns.append(np.tensordot([1, -8, 8, -1], values, 1) / (12 * h))
    return np.stack(columns, axis=-1)


def steps_of(problem: Extended) -> Array:
    return 1e-3 * np.maximum(problem.scale, 1e-3)


def smooth_points(problem: Extended, solution: CollocationSolution,
                  plan: Plan) -> tuple[Array, Array]:
    """Return points (k, m) away from switches, and whether a motor saturates at them (k,)."""
    times = np.linspace(*solution.mesh[[0, -1]], 23)[1:-1]
    z = solution(times)
    room = problem.switches(times, z)
    clear = (np.abs(room) > ROOM).all(axis=1)
    n = plan.arm.n_joints
    saturated = ((room[:, :n] > 0) | (room[:, n:] < 0)).any(axis=1)
    return z[clear], saturated[clear]


@every_case
@pytest.mark.parametrize('which', [FreeDurationProblem, FreePayloadProblem])
def test_jacobian_is_the_derivative_of_the_rate(plan: Callable[[str], Plan], name: str,
                                                which: type[Any]) -> None:
    problem, solution = extended(plan(name), which)
    points, saturated = smooth_points(problem, solution, plan(name))
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
def test_the_unknown_more_does_not_change_on_the_way(plan: Callable[[str], Plan], name: str,
                                                     which: type[Any]) -> None:
    problem, solution = extended(plan(name), which)
    constant = problem.size - (1 if which is FreeDurationProblem else 2)
    rates = problem.rate(solution.mesh, solution.nodes)
    assert not rates[:, constant].any()
    assert np.ptp(solution.nodes[:, constant]) == 0


GOALS: list[dict[str, list[float]]] = [
    {}, {'goal_position_weights': [10, 20], 'goal_velocity_weights': [1, inf]}]


@every_case
@pytest.mark.parametrize('goal', GOALS, ids=['given', 'weighted'])
@pytest.mark.parametrize('which', [FreeDurationProblem, FreePayloadProblem])
def test_rows_are_derivatives_of_the_conditions(
        plan: Callable[[str], Plan], crane_task: Task, name: str, goal: dict[str, list[float]],
        which: type[Any]) -> None:
    task = plan(name).task
    values = {field: getattr(task, field) for field in (
        'arm', 'start_positions', 'goal_positions', 'duration', 'payload_mass')}
    problem = problem_of(plan(name).model, Task(**values, **goal))
    made = (FreeDurationProblem(problem) if which is FreeDurationProblem else FreePayloadProblem(
        problem, 3.0))
    solution = made.extend(solution_of(plan(name)))
    steps = steps_of(made)
    if which is FreePayloadProblem:
        steps[-2] = 1e-2  # the change of the sag is itself taken from differences
    for side, z in ((made.left, solution.nodes[0]), (made.right, solution.nodes[-1])):
        residual, rows = side(z)
        found = differences(lambda at, side=side: side(at)[0], z, steps)
        if which is FreePayloadProblem:
            # the second derivative of the sag, some millimetres a square kilogram, is left out
            assert abs(found[-1, -2]) < 0.02 * np.abs(z).max()
            assert rows[-1, -2] == 0
            found[-1, -2] = 0
        assert rows.shape == (residual.size, made.size)
        # rounding of H, 1e-13 of 10 J, over steps of 1e-6; of the sag over 1e-4 kg
        atol = 1e-6 if which is FreeDurationProblem else 1e-8
        np.testing.assert_allclose(rows, found, rtol=1e-7, atol=atol)
    assert made.left(z)[0].size + made.right(z)[0].size == made.size


def test_payload_bends_the_ends_under_gravity_only(plan: Callable[[str], Plan]) -> None:
    for name, bends in (('rigid', False), ('ei5', False), ('crane', True)):
        made, solution = extended(plan(name), FreePayloadProblem)
        for side, z in ((made.left, solution.nodes[0]), (made.right, solution.nodes[-1])):
            assert side(z)[1][:, -2].any() == bends


@every_case
def test_duration_is_added_and_taken_away(plan: Callable[[str], Plan], name: str) -> None:
    made, solution = extended(plan(name), FreeDurationProblem)
    assert isinstance(made, FreeDurationProblem)
    assert solution.mesh[[0, -1]].tolist() == [0, 1]
    before, (_, after) = solution_of(plan(name)), made.restrict(solution)
    np.testing.assert_allclose(after.mesh, before.mesh, rtol=1e-15)
    np.testing.assert_array_equal(after.nodes, before.nodes)
    np.testing.assert_allclose(after.stages, before.stages, rtol=1e-15)
    shorter = made.fix(0.5)
    assert (shorter.task.duration, shorter.model) == (0.5, plan(name).model)


@every_case
def test_payload_is_added_and_taken_away(plan: Callable[[str], Plan], name: str) -> None:
    made, solution = extended(plan(name), FreePayloadProblem)
    assert isinstance(made, FreePayloadProblem)
    mass, after = made.restrict(solution)
    assert mass == plan(name).task.payload_mass
    np.testing.assert_array_equal(after.nodes, solution_of(plan(name)).nodes)
    np.testing.assert_array_equal(after.stages, solution_of(plan(name)).stages)
    # nu gathers the share of the payload
    share = share_of(plan(name).problem, solution_of(plan(name)))
    assert solution.nodes[[0, -1], -1] == pytest.approx([0, -share], rel=1e-12)
    heavier = made.fix(0.3)
    assert (heavier.task.payload_mass, heavier.parameters.payload_mass) == (0.3, 0.3)
    assert heavier.p[0] == 0.3


@every_case
@pytest.mark.parametrize('which', [FreeDurationProblem, FreePayloadProblem])
def test_switches_are_those_of_the_motion(plan: Callable[[str], Plan], name: str,
                                          which: type[Any]) -> None:
    made, solution = extended(plan(name), which)
    problem, inner = plan(name).problem, solution_of(plan(name))
    np.testing.assert_array_equal(made.switches(solution.mesh, solution.nodes),
                                  problem.switches(inner.mesh, inner.nodes))


def test_switches_know_the_payload_of_the_iterate(plan: Callable[[str], Plan]) -> None:
    made, solution = extended(plan('rigid'), FreePayloadProblem)
    heavier = solution.nodes.copy()
    heavier[:, -2] += 1
    assert not np.allclose(made.switches(solution.mesh, heavier),
                           made.switches(solution.mesh, solution.nodes))
