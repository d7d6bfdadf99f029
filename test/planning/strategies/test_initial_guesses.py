"""Guesses that a motion is solved from at once: of the rigid arm, and of similar tasks."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    solve,
    Solver,
    SolverSettings,
)
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.first_extremals import approach_limit
from flex_planner.planning.strategies.free_parameters import PAYLOAD
from flex_planner.planning.strategies.initial_guesses import (
    lift_rigid_motion,
    rigid_problem,
    warm_start,
)
import numpy as np
from plan_checks import problem_of, SAME_COST, solution_of
import pytest

# From the rigid arm


@pytest.mark.parametrize('modes', [2, 3])
def test_what_rings_many_times_is_solved_on_a_mesh_that_shows_it(modes: int) -> None:
    """Undamped, its torque sets the beam ringing through 650 and 1300 rad in these 45 s."""
    arm = load_arm('space_beam')
    task = Task(arm=replace(arm, links=(replace(arm.links[0], modes=modes),)), duration=45.0,
                start_positions=[0.0], goal_positions=[math.pi / 6])
    found = plan_path(task, search='fast', monitor=Monitor(time_limit=60))
    assert found.solved
    assert found.strategy == 'rigid motion first'
    assert found.iterations <= 100
    assert found.mesh_intervals <= 800


def test_lifted_guess_is_the_rigid_motion_with_its_torque_and_links_bent_by_its_forces(
        ei5_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    guesses: list[CollocationSolution] = []

    def watched(problem: MotionProblem, guess: CollocationSolution,
                *rest: Any, **options: Any) -> CollocationResult:
        guesses.append(guess)
        return solve(problem, guess, *rest, **options)

    problem = problem_of(ei5_model, paper_task(ei5_model.arm, w_2=10.0))
    lift_rigid_motion(problem, Solver(backend=watched))
    rigid = solution_of(plan_of('rigid', 1.0, 10.0))
    joints, arm = np.array([0, 1, 6, 7]), ei5_model.arm
    times, lifted = np.linspace(0, 1, 7)[1:-1], guesses[-1]
    z, straight = lifted(times), rigid(times)
    # the last of nine Gauss points of the solution is dropped, relative to costates up to 10
    np.testing.assert_allclose(z[:, joints], straight[:, :4], atol=1e-9)
    torque, rigid_torque = (model.controls(values, stack).torque for model, values, stack in (
        (ei5_model, z, problem.p), (ArmModel.of(arm.rigid()), straight,
                                    problem.parameters.drop_modes().stack())))
    np.testing.assert_allclose(torque, rigid_torque, atol=1e-6)
    # forces of the modes with their accelerations left out are those of bending
    accelerations = np.zeros((times.size, 6))
    accelerations[:, :2] = rigid.rate(times)[:, 2:4]
    states = np.zeros((times.size, 12))
    states[:, joints] = straight[:, :4]
    forces = ei5_model.inverse_dynamics(states, accelerations, problem.parameters.physical)
    stiffness = ei5_model.static_forces(states[:1, :6], problem.parameters.physical)[1][0]
    np.testing.assert_allclose(z[:, 2:6] @ stiffness[2:, 2:], -forces[:, 2:], atol=1e-5)
    assert np.abs(z[:, 2:6]).max() > 5e-4  # [m]


def test_rigid_motion_takes_the_weights_and_velocities_of_the_joints(
        ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    tasks: list[Task] = []

    def watched(problem: MotionProblem, *rest: Any, **options: Any) -> CollocationResult:
        tasks.append(problem.task)
        return solve(problem, *rest, **options)

    numbers = {'position_weights': [1, 2, 3, 4, 5, 6], 'velocity_weights': [6, 5, 4, 3, 2, 1],
               'start_velocities': [0.1, 0.2, 0.01, 0, 0, 0], 'goal_velocities': [0.3, 0.4],
               'goal_position_weights': [math.inf, 7, 8, 9, 10, 11],
               'goal_velocity_weights': [12, 13]}
    task = paper_task(ei5_model.arm, **numbers)
    lift_rigid_motion(problem_of(ei5_model, task), Solver(backend=watched))
    for name, values in numbers.items():
        assert getattr(tasks[0], name).tolist() == values[:2]
    assert tasks[0].arm.n_modes == 0


# Warm starts


@pytest.mark.parametrize('changes', [
    {}, {'duration': 1.3}, {'payload_mass': 5.0}, {'w_2': 10.0}, {'goal_velocities': [0.2, 0.1]}],
    ids=str)
def test_plan_of_a_similar_task_is_a_start(ei5_model: ArmModel, paper_task: TaskFactory,
                                           plan_of: PlanFactory, changes: dict[str, Any]) -> None:
    task = paper_task(ei5_model.arm, **changes)
    warm = plan_path(task, model=ei5_model, start_from=plan_of('ei5'))
    cold = plan_path(task, model=ei5_model)
    assert (warm.solved, warm.strategy) == (True, 'warm start'), warm.message
    assert warm.cost == pytest.approx(cold.cost, rel=SAME_COST)


def test_solution_solves_its_own_task_at_once(ei5_model: ArmModel, paper_task: TaskFactory,
                                              plan_of: PlanFactory) -> None:
    again = plan_path(paper_task(ei5_model.arm), model=ei5_model, start_from=plan_of('ei5'))
    assert again.iterations <= 2  # its stages are one fewer, so that it is not exact
    assert again.mesh_intervals == plan_of('ei5').mesh_intervals


def test_plan_may_start_one_of_another_rule_or_stiffness(
        ei50_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    plan = plan_path(paper_task(ei50_model.arm), model=ei50_model, start_from=plan_of('ei5'),
                     solver=Solver(SolverSettings(stages=5)))
    assert (plan.solved, plan.strategy) == (True, 'warm start')
    assert plan.cost == pytest.approx(plan_of('ei50').cost, rel=SAME_COST)


def test_plan_of_an_arm_with_other_coordinates_is_no_start(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    task = paper_task(rigid_model.arm)
    strategy = warm_start(solution_of(plan_of('ei5')))
    assert strategy.attempt(problem_of(rigid_model, task), Solver()) is None
    plan = plan_path(task, model=rigid_model, start_from=plan_of('ei5'))
    assert (plan.solved, plan.strategy) == (True, 'cold start')


def test_plan_without_solution_is_no_start(rigid_model: ArmModel,
                                           paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    canceled = plan_path(task, model=rigid_model, monitor=Monitor(canceled=lambda: True))
    plan = plan_path(task, model=rigid_model, start_from=canceled)
    assert (plan.solved, plan.strategy) == (True, 'cold start')


def test_arm_that_only_its_bending_lets_the_motor_hold_is_planned_without_a_rigid_twin() -> None:
    # at -0.6 rad the bent link needs 5.6 N m, and the straight one 6.5 N m
    link = Link(length=1.0, linear_density=1.0, flexural_rigidity=8.0, modes=2,
                mode_family='clamped_free', damping_ratio=0.02)
    arm = Arm(name='drooping', links=(link,), joints=(Joint(motor=Motor(stall_torque=6.0)),),
              gravity=[0.0, -9.81])
    task = Task(arm=arm, start_positions=[-0.9], goal_positions=[-0.6], duration=2.0,
                payload_mass=0.3)
    problem = problem_of(ArmModel.of(arm), task)
    with pytest.raises(InvalidTaskError, match='joint 1 needs'):
        rigid_problem(problem)
    assert lift_rigid_motion(problem, Solver()) is None
    found = next(approach_limit(PAYLOAD, problem, Solver()))
    assert isinstance(found, Extremal)
