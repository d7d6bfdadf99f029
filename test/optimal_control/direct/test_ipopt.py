"""
Direct collocation: its optimum, and the costates in its multipliers, are those of the conditions.

Errors are relative to the largest magnitude of each costate along the motion.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
import subprocess
import sys
import threading
from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor, Progress
from flex_planner.base.validation import Array
from flex_planner.collocation import GaussRule, Solver, SolverSettings
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import (
    DirectProblem,
    DirectResult,
    DirectSettings,
    DirectStatus,
    solve_direct,
)
from flex_planner.optimal_control.direct.mesh import Mesh, SCHEMES
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest

TaskFactory = Callable[..., Task]
PlanFactory = Callable[[str, float], Plan]

# errors of the costates of the rigid arm, 1 kg, at the nodes and the points of 20 intervals,
# rounded up from those measured, and the orders that halving the steps shows
SMOOTH = [
    ('gauss', 1, (6e-3, 2.0), (6e-3, 1.9)), ('gauss', 2, (2e-6, 4.0), (7e-5, 2.9)),
    ('gauss', 3, (6e-9, 6.0), (5e-6, 3.7)), ('radau', 1, (0.12, 1.0), (0.1, 1.0)),
    ('radau', 2, (8e-5, 3.1), (4e-3, 2.0)), ('radau', 3, (2e-7, 5.0), (2e-4, 2.9)),
    ('hermite_simpson', 3, (1e-5, 3.9), (2e-3, 2.0))]
# the same of the arm with one mode per link, whose modes ring at up to 140 rad/s: at the nodes of
# 80 and of 160 intervals
RINGING = [('gauss', 2e-2, 4e-4), ('radau', 0.15, 6e-3), ('hermite_simpson', 0.7, 6e-2)]
# of the rigid arm, 5.5 kg, with both motors saturated: switches inside intervals leave no order
SATURATED = [('gauss', 1e-3, 4e-5), ('radau', 1e-3, 1e-4), ('hermite_simpson', 3e-3, 1e-4)]
EVERY = pytest.mark.parametrize('scheme', SCHEMES)


@pytest.fixture(scope='module')
def plan_of(request: pytest.FixtureRequest, paper_task: TaskFactory) -> PlanFactory:
    """Plan the paper's motion by the indirect solver, once for each arm and payload."""
    known: dict[tuple[str, float], Plan] = {}

    def plan(arm: str, payload_mass: float) -> Plan:
        key = arm, payload_mass
        if key not in known:
            model = request.getfixturevalue(f'{arm}_model')
            known[key] = plan_path(paper_task(model.arm, payload_mass), model=model,
                                   solver=Solver(SolverSettings(error_tolerance=1e-9)))
        return known[key]

    return plan


@pytest.fixture(scope='module')
def hanging_problem() -> MotionProblem:
    """Lift an arm that gravity pulls at, with all weights."""
    model = ArmModel(load_arm('korayem_hanging'))
    task = Task(arm=model.arm, start_positions=[-1.5, -0.5], goal_positions=[-0.5, 0.5],
                duration=1.2, payload_mass=0.5, payload_inertia=0.02, effort_weights=[0.5, 2.0],
                position_weights=[3.0, 1.0, 2.0, 0.0, 1.0, 5.0],
                velocity_weights=[1.0, 4.0, 0.5, 1.0, 0.0, 0.2])
    return MotionProblem(model, task, task_parameters(task))


def solved(problem: MotionProblem, monitor: Monitor | None = None, guess: Any = None,
           **settings: Any) -> DirectResult:
    return solve_direct(problem.model, problem.parameters, problem.start, problem.goal,
                        problem.task.duration, DirectSettings(**settings), guess, monitor)


def extended(result: DirectResult) -> tuple[Array, Array]:
    """Return z at nodes and points."""
    return (np.hstack([result.states, result.costates]),
            np.hstack([result.point_states, result.point_costates]))


def costate_errors(result: DirectResult, plan: Plan) -> tuple[float, float]:
    """Return the largest errors at nodes and at points."""
    assert plan.solution is not None
    half = result.states.shape[1]
    scale = np.abs(plan.solution.nodes[:, half:]).max(axis=0)
    return tuple(float((np.abs(psi - plan.solution(times)[:, half:]) / scale).max())
                 for psi, times in ((result.costates, result.times),
                                    (result.point_costates, result.point_times)))


# Costates


@pytest.mark.parametrize(('scheme', 'degree', 'at_nodes', 'at_points'), SMOOTH)
def test_costates_converge_with_the_order_of_the_scheme(
        plan_of: PlanFactory, scheme: str, degree: int, at_nodes: tuple[float, float],
        at_points: tuple[float, float]) -> None:
    plan = plan_of('rigid', 1.0)
    coarse, fine = (costate_errors(solved(plan.problem, scheme=scheme, degree=degree,
                                          intervals=N, tolerance=1e-11), plan) for N in (10, 20))
    for before, after, (error, order) in zip(coarse, fine, (at_nodes, at_points), strict=True):
        assert error / 3 < after < error
        assert math.log2(before / after) == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize(('scheme', 'coarse', 'fine'), RINGING)
def test_costates_of_a_flexible_arm_follow_its_vibration(plan_of: PlanFactory, scheme: str,
                                                         coarse: float, fine: float) -> None:
    plan = plan_of('single_mode', 1.0)
    for intervals, error in ((80, coarse), (160, fine)):
        result = solved(plan.problem, scheme=scheme, intervals=intervals)
        assert error / 3 < costate_errors(result, plan)[0] < error


@pytest.mark.parametrize(('scheme', 'coarse', 'fine'), SATURATED)
def test_costates_are_right_where_motors_saturate(plan_of: PlanFactory, scheme: str,
                                                  coarse: float, fine: float) -> None:
    plan = plan_of('rigid', 5.5)
    for intervals, error in ((40, coarse), (160, fine)):
        result = solved(plan.problem, scheme=scheme, intervals=intervals, tolerance=1e-9)
        assert costate_errors(result, plan)[0] < error
        slope, stall = plan.problem.parameters.torque_slope, plan.problem.parameters.stall_torque
        shifted = np.abs(result.torques + slope * result.point_states[:, 2:])
        # IPOPT relaxes bounds by 1e-8 of their size
        assert (shifted <= stall * (1 + 2e-8)).all()
        assert (np.isclose(shifted, stall, rtol=1e-6).mean(axis=0) > 0.1).all()


@pytest.mark.parametrize(('arm', 'payload_mass', 'intervals', 'tolerance'), [
    ('single_mode', 1.0, 20, 1e-8), ('rigid', 5.5, 20, 2e-6), ('hanging', 0.5, 20, 1e-8)])
def test_gauss_meets_the_discrete_optimality_conditions(
        plan_of: PlanFactory, hanging_problem: MotionProblem, arm: str, payload_mass: float,
        intervals: int, tolerance: float) -> None:
    # its own adjoint: discretising and optimising commute; saturated torques end where the
    # barrier of IPOPT lets them
    problem = hanging_problem if arm == 'hanging' else plan_of(arm, payload_mass).problem
    result = solved(problem, scheme='gauss', degree=3, intervals=intervals, tolerance=1e-10)
    nodes, points = extended(result)
    rule, h = GaussRule.of(3), problem.task.duration / intervals
    rates = problem.model.optimality(points, problem.p).reshape(intervals, 3, -1)
    scale = np.abs(nodes).max(axis=0)
    inner = nodes[:-1, None] + h * np.einsum('ij,kjm->kim', rule.matrix, rates)
    ends = nodes[:-1] + h * np.einsum('j,kjm->km', rule.weights, rates)
    assert np.abs((inner.reshape(points.shape) - points) / scale).max() < tolerance
    assert np.abs((ends - nodes[1:]) / scale).max() < tolerance
    torques = problem.model.controls(points, problem.p).torque
    assert np.abs(torques - result.torques).max() < tolerance * np.abs(torques).max()


@EVERY
def test_costates_at_the_ends_are_derivatives_of_the_cost(workshop_model: ArmModel,
                                                          scheme: str) -> None:
    # of the discrete optimum, on any mesh; the arm and the weights have everything
    n_t, h = workshop_model.arm.n_coordinates, 1e-6
    weights = np.linspace(0.5, 2.0, n_t)
    parameters = Parameters.of(workshop_model.arm, payload_mass=0.3, position_weights=weights,
                               velocity_weights=weights[::-1].copy())
    ends = [np.concatenate([equilibrium(workshop_model, np.array(angles), parameters)[0],
                            speeds, np.zeros(n_t - 2)])
            for angles, speeds in (([-1.7, 0.2], [0.2, -0.3]), ([-1.4, -0.3], [0.3, 0.1]))]
    problem = DirectProblem(workshop_model, DirectSettings(scheme=scheme, intervals=30,
                                                           tolerance=1e-11))
    optimum = problem.solve(parameters, *ends, 1.0)

    def cost(change: Array) -> float:
        changed = np.concatenate(ends) + change
        return problem.solve(parameters, *np.split(changed, 2), 1.0, warm=optimum).cost

    psi = np.concatenate([optimum.costates[0], -optimum.costates[-1]])
    slopes = [(cost(change) - cost(-change)) / (2 * h) for change in h * np.eye(4 * n_t)]
    # 4e-5 of h^2, which radau magnifies
    np.testing.assert_allclose(slopes, psi, rtol=1e-4, atol=1e-4)


# Cost


@EVERY
def test_cost_of_section_5_2(plan_of: PlanFactory, scheme: str) -> None:
    result = solved(plan_of('rigid', 1.0).problem, scheme=scheme, intervals=40)
    assert result.cost == pytest.approx(0.646813, abs=5e-7)
    assert (result.status, result.message) == (DirectStatus.CONVERGED, 'solve succeeded')


@pytest.mark.parametrize(('scheme', 'tolerance'), [
    # modes at 700 rad/s on 100 intervals: radau damps them
    ('gauss', 3e-5), ('radau', 2e-2), ('hermite_simpson', 3e-4)])
def test_weights_and_gravity_count(hanging_problem: MotionProblem, scheme: str,
                                   tolerance: float) -> None:
    plan = plan_path(hanging_problem.task, model=hanging_problem.model)
    result = solved(hanging_problem, scheme=scheme, intervals=100)
    assert plan.solved
    assert result.converged
    assert result.cost == pytest.approx(plan.cost, rel=tolerance)
    assert result.states[[0, -1]] == pytest.approx(
        np.stack([hanging_problem.start, hanging_problem.goal]), abs=1e-9)


# Starts


def test_warm_start_needs_fewer_iterations(plan_of: PlanFactory) -> None:
    motion = plan_of('rigid', 5.5).problem
    problem = DirectProblem(motion.model, DirectSettings(scheme='hermite_simpson'))
    neighbour = replace(motion.parameters, payload_mass=5.5 * 1.005)
    first = problem.solve(neighbour, motion.start, motion.goal, 1.0)
    cold = problem.solve(motion.parameters, motion.start, motion.goal, 1.0)
    warm = problem.solve(motion.parameters, motion.start, motion.goal, 1.0, warm=first)
    assert warm.converged
    assert warm.iterations < cold.iterations / 2
    assert warm.cost == pytest.approx(cold.cost, rel=1e-6)
    assert first.cost > cold.cost * 1.001


@EVERY
def test_start_from_another_solution(plan_of: PlanFactory, scheme: str) -> None:
    plan = plan_of('single_mode', 1.0)
    cold = solved(plan.problem, scheme=scheme, intervals=40)
    for guess in (plan.solution, solved(plan.problem, scheme=scheme, intervals=60)):
        result = solved(plan.problem, guess=guess, scheme=scheme, intervals=40)
        assert result.cost == pytest.approx(cold.cost, rel=1e-7)


# Ends


def test_cancel_stops_it_and_says_so(plan_of: PlanFactory) -> None:
    event = threading.Event()
    reports: list[Progress] = []

    def report(progress: Progress) -> None:
        reports.append(progress)
        if len(reports) == 4:
            event.set()

    result = solved(plan_of('rigid', 5.5).problem, Monitor(canceled=event.is_set, report=report))
    assert (result.status, result.message) == (DirectStatus.STOPPED, 'canceled')
    assert not result.converged
    assert [each.iteration for each in reports] == [1, 2, 3, 4]
    assert {each.intervals for each in reports} == {40}
    # the straight line has the speed but not the rest at its ends, nor the forces
    assert reports[0].residual > 1
    assert result.iterations == 3


def test_time_limit_stops_it(plan_of: PlanFactory) -> None:
    result = solved(plan_of('rigid', 1.0).problem, Monitor(time_limit=0.0))
    assert (result.status, result.message) == (DirectStatus.STOPPED, 'time limit reached')


def test_problem_that_was_stopped_can_be_solved_again(plan_of: PlanFactory) -> None:
    motion = plan_of('rigid', 1.0).problem
    problem = DirectProblem(motion.model)
    data = motion.parameters, motion.start, motion.goal, 1.0
    assert not problem.solve(*data, monitor=Monitor(time_limit=0.0)).converged
    assert problem.solve(*data).converged


def test_error_of_a_callback_comes_through(plan_of: PlanFactory) -> None:
    def report(progress: Progress) -> None:
        raise KeyError('not mine')

    with pytest.raises(KeyError, match='not mine'):
        solved(plan_of('rigid', 1.0).problem, Monitor(report=report))


def test_failure_is_a_status(plan_of: PlanFactory) -> None:
    result = solved(plan_of('rigid', 5.5).problem, max_iterations=2)
    assert (result.status, result.iterations) == (DirectStatus.FAILED, 2)
    assert result.message == 'maximum iterations exceeded'


def test_motion_that_the_motors_cannot_make_fails(plan_of: PlanFactory) -> None:
    motion = plan_of('rigid', 1.0).problem
    result = solve_direct(motion.model, motion.parameters, motion.start, motion.goal, 0.05)
    assert result.status is DirectStatus.FAILED


def test_it_prints_nothing(plan_of: PlanFactory, capfd: pytest.CaptureFixture[str]) -> None:
    motion = plan_of('rigid', 1.0).problem
    solved(motion)
    bad = np.full((1, motion.size), np.nan)
    result = solved(motion, guess=lambda times: np.repeat(bad, times.size, axis=0))
    assert result.status is DirectStatus.FAILED
    assert capfd.readouterr() == ('', '')


# Settings


@pytest.mark.parametrize(('changes', 'message'), [
    ({'scheme': 'euler'}, "scheme is 'euler', but must be one of gauss, radau, hermite_simpson"),
    ({'degree': 0}, 'degree is 0, but must be an integer from 1 to 12'),
    ({'intervals': 1}, 'intervals is 1, but must be an integer from 2 to 20000'),
    ({'max_iterations': 0}, 'max_iterations is 0, but must be an integer from 1 to 100000'),
    ({'tolerance': 0.0}, 'tolerance is 0.0, but must be a number >= 1e-14 and <= 0.01')])
def test_bad_settings_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        DirectSettings(**changes)


def test_bad_ends_are_refused(rigid_model: ArmModel) -> None:
    parameters, state = Parameters.of(rigid_model.arm), np.zeros(4)
    with pytest.raises(InvalidValueError, match='start has 3 numbers'):
        solve_direct(rigid_model, parameters, np.zeros(3), state, 1.0)
    with pytest.raises(InvalidValueError, match=r'goal\[1\] is nan'):
        solve_direct(rigid_model, parameters, state, np.array([0, np.nan, 0, 0]), 1.0)
    with pytest.raises(InvalidValueError, match='duration is 0.0, but must be a number > 0 s'):
        solve_direct(rigid_model, parameters, state, state, 0.0)


# Meshes


@pytest.mark.parametrize(('scheme', 'degree', 'stage', 'quadrature'), [
    *(('gauss', d, d, 2 * d - 1) for d in (1, 2, 3, 8, 12)),
    *(('radau', d, d, 2 * d - 2) for d in (1, 2, 3, 8, 12)), ('hermite_simpson', 1, 3, 3)])
def test_mesh_integrates_polynomials(scheme: str, degree: int, stage: int,
                                     quadrature: int) -> None:
    mesh = Mesh.of(scheme, degree, 3)
    bare = np.linspace(0, 1, 4)[mesh.nodes >= mesh.points.size]
    times = np.concatenate([mesh.points, bare])
    np.testing.assert_allclose(times[mesh.nodes], np.linspace(0, 1, 4), atol=1e-15)
    for k in range(1, stage + 1):
        np.testing.assert_allclose((mesh.P @ times**k)[:-2],
                                   (mesh.Q @ (k * mesh.points**(k - 1)))[:-2], atol=1e-13)
    for k in range(quadrature + 1):
        assert mesh.weights @ mesh.points**k == pytest.approx(1 / (k + 1), abs=1e-13)
    assert (mesh.P @ times)[-2:].tolist() == [0.0, 1.0]


def test_import_needs_no_casadi() -> None:
    code = "import flex_planner.optimal_control.direct.ipopt, sys; print('casadi' in sys.modules)"
    result = subprocess.run([sys.executable, '-c', code], text=True, capture_output=True,
                            check=True)
    assert result.stdout == 'False\n'
