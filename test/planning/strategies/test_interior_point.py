"""The interior point as a strategy: motions that Newton's method does not find by itself."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.joint import Motor
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.collocation import CollocationResult, Solver, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.paper.cases import paper_arm, point_to_point
from flex_planner.planning.strategies.extremals import no_target
from flex_planner.planning.strategies.free_parameters import DURATION, PAYLOAD
from flex_planner.planning.strategies.initial_guesses import cold_start
from flex_planner.planning.strategies.interior_point import (
    pass_barrier,
    pass_barrier_from,
    pass_barrier_from_rigid,
)
from flex_planner.planning.strategies.limit_barrier import is_cheap, reach_limit
import numpy as np
import pytest


def clamped(rigidity: float = 5.0, payload: float = 1.0) -> MotionProblem:
    """Return the paper's motion with one clamped mode per link."""
    return problem_of(point_to_point(paper_arm(rigidity, 1, 'clamped_free'), payload))


def problem_of(task: Task) -> MotionProblem:
    """Return the problem of a task."""
    return MotionProblem(ArmModel.of(task.arm), task, task_parameters(task))


def result_of(problem: MotionProblem, monitor: Monitor | None = None) -> CollocationResult:
    """Return where a straight line leads to."""
    attempt = pass_barrier(problem, Solver(monitor=monitor or Monitor()))
    assert attempt is not None
    return attempt.result


def test_clamped_links_are_solved_where_a_cold_start_fails() -> None:
    problem, monitor = clamped(), Monitor()
    assert cold_start(problem, Solver()).result.status is SolverStatus.NEWTON_FAILED
    found = result_of(problem, monitor)
    assert found.converged
    # by transcription on meshes of up to 1280 intervals: 0.71364 to 0.71365
    assert integrate_totals(problem, found.solution).cost == pytest.approx(0.713645, abs=1e-5)
    assert monitor.iteration <= 40


def test_saturated_motion_is_that_of_a_cold_start() -> None:
    problem = problem_of(point_to_point(paper_arm(50.0, 1), 5.5))
    attempts = [attempt(problem, Solver())
                for attempt in (cold_start, pass_barrier, pass_barrier_from_rigid)]
    costs = [integrate_totals(problem, attempt.result.solution).cost
             for attempt in attempts if attempt is not None]
    assert len(costs) == 3
    np.testing.assert_allclose(costs, costs[0], rtol=1e-9)


def test_rigid_arm_has_no_rigid_motion_to_start_from() -> None:
    problem = problem_of(point_to_point(paper_arm(np.inf), 1.0))
    assert pass_barrier_from_rigid(problem, Solver()) is None


def test_motion_nearby_is_enough_to_start_from() -> None:
    problem = clamped()
    known = result_of(problem)
    heavier = problem.with_changes(payload_mass=1.1)
    costs = []
    for result in (pass_barrier_from(heavier, known.solution, Solver()),
                   result_of(heavier)):
        assert result.converged
        costs.append(integrate_totals(heavier, result.solution).cost)
    assert costs[0] == pytest.approx(costs[1], rel=1e-8)


def test_task_that_is_too_fast_is_not_solved() -> None:
    problem = clamped().with_changes(duration=0.2)
    found = result_of(problem)
    assert found.status is SolverStatus.NEWTON_FAILED
    assert found.message.startswith('with a barrier: ')


def test_cancellation_ends_it() -> None:
    problem = clamped()
    with pytest.raises(StoppedError):
        pass_barrier(problem, Solver(monitor=Monitor(canceled=lambda: True)))


@pytest.mark.parametrize(('rigidity', 'modes', 'limit'), [
    (np.inf, 0, 5.85514), (5.0, 2, 5.74184)])
def test_payload_comes_to_its_limit_in_one_run(rigidity: float, modes: int, limit: float) -> None:
    task = point_to_point(paper_arm(rigidity, modes) if modes else paper_arm(rigidity), 1.0)
    problem, monitor = problem_of(task), Monitor()
    assert is_cheap(PAYLOAD, problem)
    found = reach_limit(PAYLOAD, problem, Solver(monitor=monitor).coarse(), lambda value: 1e-2)
    assert found is not None and found.result.converged
    # the limit lies between the payload and the gap above it, which is about the one wanted
    assert found.value - 1e-4 < limit < found.value + found.gap
    assert found.gap < 5e-2
    assert monitor.iteration <= 45


@pytest.mark.parametrize(('rigidity', 'modes', 'shortest'), [
    (np.inf, 0, 0.64209), (5.0, 2, 0.64950)])
def test_duration_comes_to_its_limit_in_one_run(rigidity: float, modes: int,
                                                shortest: float) -> None:
    task = point_to_point(paper_arm(rigidity, modes) if modes else paper_arm(rigidity), 1.0)
    problem, monitor = problem_of(task), Monitor()
    assert is_cheap(DURATION, problem)
    found = reach_limit(DURATION, problem, Solver(monitor=monitor).coarse(), lambda value: 1e-3)
    assert found is not None and found.result.converged
    # between the gap below the duration and the duration, 5e-5 within which the price walk ends
    assert found.value - found.gap < shortest < found.value + 5e-5
    assert found.gap < 1e-2
    assert monitor.iteration <= 45


def test_light_clamped_arm_starts_a_little_below_what_the_barrier_reached() -> None:
    found = reach_limit(PAYLOAD, clamped(50.0), Solver().coarse(), no_target)
    assert found is not None and found.result.converged
    assert 5.3 < found.value < 5.689


def test_motors_without_limits_have_no_limit_to_reach() -> None:
    arm = paper_arm(np.inf)
    endless = replace(arm, joints=tuple(replace(joint, motor=Motor()) for joint in arm.joints))
    problem = problem_of(point_to_point(endless, 1.0))
    assert reach_limit(PAYLOAD, problem, Solver(), no_target) is None
