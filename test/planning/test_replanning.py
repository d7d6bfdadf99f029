"""Planning again from a moving, bent arm: the rest of the best motion is the best rest."""

from __future__ import annotations

from dataclasses import replace

from applied_torques import crane_plan
from factories import PlanFactory
from flex_planner.arms.arm import Arm
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
import numpy as np
from plan_checks import solution_of
import pytest
from scipy.integrate import simpson


@pytest.fixture(scope='module')
def plan(crane_model: ArmModel) -> Plan:
    """Return a quick motion under gravity of links with damping, motors on their limit."""
    return crane_plan(crane_model)


def task_from(plan: Plan, time: float) -> Task:
    """Return the task of the rest of a plan, from the state that it has reached."""
    n, at = plan.arm.n_joints, plan.sample(time)
    return replace(plan.task, duration=plan.task.duration - time,
                   start_positions=at.coordinates[0, :n], start_velocities=at.rates[0],
                   start_modal_displacements=at.coordinates[0, n:])


def cost_to_go(plan: Plan, time: float) -> float:
    """Integrate half the squared torques from a time on."""
    # so many points that the kinks where motors switch cost less than 1e-8
    samples = plan.sample(np.linspace(time, plan.task.duration, 20001))
    return float(simpson((samples.torques**2).sum(axis=1) / 2, x=samples.times))


@pytest.mark.parametrize('share', [0.5, 0.8])
def test_rest_of_the_best_motion_is_the_best_rest(plan: Plan, share: float) -> None:
    # Bellman's principle
    time = share * plan.task.duration
    again = plan_path(task_from(plan, time), model=plan.model)
    assert again.solved, again.message
    assert np.abs(again.problem.start[7:]).max() > 1e-3  # the links ring
    assert again.cost == pytest.approx(cost_to_go(plan, time), rel=1e-6)
    later = again.sample(again.task.duration / 3)
    there = plan.sample(time + again.task.duration / 3)
    np.testing.assert_allclose(later.coordinates, there.coordinates, rtol=0, atol=1e-6)


def test_bending_that_is_left_out_is_not_the_arm_that_moves(plan: Plan) -> None:
    time = plan.task.duration / 2
    moving = task_from(plan, time)
    at_rest = replace(moving, start_modal_displacements=[])
    right, wrong = (plan_path(task, model=plan.model) for task in (moving, at_rest))
    assert wrong.solved
    assert np.abs(right.problem.start - wrong.problem.start)[2:5].max() > 1e-4
    assert abs(wrong.cost / cost_to_go(plan, time) - 1) > 1e-4


def test_samples_begin_with_the_moving_arm(plan: Plan) -> None:
    task = task_from(plan, plan.task.duration / 2)
    again = plan_path(task, model=plan.model, start_from=solution_of(plan))
    first = sample_plan(again, SamplingSettings()).samples
    assert np.array_equal(first.coordinates[0, 2:], task.start_modal_displacements)
    assert np.array_equal(first.rates[0], task.start_velocities)
    assert np.abs(first.rates[0]).min() > 0
    assert not first.rates[-1].any()


def test_given_start_does_not_change_with_the_payload(plan: Plan, crane_arm: Arm) -> None:
    task = task_from(plan, plan.task.duration / 2)
    problem = plan_path(task, model=plan.model).problem
    heavier = problem.with_changes(payload_mass=2 * task.payload_mass)
    assert np.array_equal(heavier.start, problem.start)
    assert not np.array_equal(heavier.goal, problem.goal)


# Starting from the plan of a similar task


@pytest.mark.parametrize('payload', [1.0, 5.3, 5.5])
def test_plan_of_a_similar_task_is_as_good_as_a_first_one(plan_of: PlanFactory,
                                                          payload: float) -> None:
    first = plan_of('ei50', payload)
    task = replace(first.task, payload_mass=1.005 * payload)
    again, cold = (plan_path(task, start_from=start, search='fast') for start in (first, None))
    assert again.solved, again.message
    assert again.strategy == 'warm start'
    # a tolerance of 1e-4 leaves ten digits of the cost, which is stationary
    assert again.cost == pytest.approx(cold.cost, rel=1e-10)
    certificate = again.certificate
    assert max(certificate.state_error, certificate.costate_error) <= 1e-5
    assert certificate.tip_error <= 1e-8


def test_plan_of_a_similar_task_takes_one_linear_system(plan_of: PlanFactory) -> None:
    first = plan_of('ei50')
    again = plan_path(replace(first.task, payload_mass=1.02), start_from=first)
    assert again.iterations == 1
    assert np.array_equal(solution_of(again).mesh, solution_of(first).mesh)


def test_errors_that_are_said_hold_along_many_plans(plan_of: PlanFactory) -> None:
    at = plan_of('ei50')
    for payload in np.linspace(1.0, 2.0, 11)[1:]:
        at = plan_path(replace(at.task, payload_mass=payload), start_from=at)
        assert at.solved
    solution = solution_of(at)
    exact = solution_of(plan_path(at.task, solver=Solver(SolverSettings(error_tolerance=1e-9)),
                                  search='fast'))(solution.mesh)
    error = np.abs(solution.nodes - exact).max(axis=0) / np.abs(exact).max(axis=0)
    half = error.size // 2
    assert error[:half].max() <= at.certificate.state_error <= 1e-4
    assert error[half:].max() <= at.certificate.costate_error <= 1e-4


def test_another_duration_starts_from_the_stretched_plan(plan_of: PlanFactory) -> None:
    first = plan_of('ei50', 5.5)
    task = replace(first.task, duration=1.01)
    again, cold = (plan_path(task, start_from=start, search='fast') for start in (first, None))
    assert (again.solved, again.strategy) == (True, 'warm start')
    assert again.cost == pytest.approx(cold.cost, rel=1e-10)
