"""The motion of an arm whose stiff links follow quasi-statically, and the torque that it takes."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.certificate import simulate_to_goal
from flex_planner.planning.quasi_static_motion import follow_quasi_statically
from flex_planner.planning.strategies.initial_guesses import cold_start, rigid_problem
import numpy as np
import pytest

Found = tuple[MotionProblem, MotionProblem, CollocationSolution]


def solved(stall: float, gravity: float) -> Found:
    """Return a problem of stiff links, that of rigid ones, and its solution."""
    link = Link(length=0.5, linear_density=6.0, flexural_rigidity=2e4, modes=1)
    arm = Arm(name='steady', links=(link, link), gravity=[0.0, -gravity],
              joints=(Joint(motor=Motor(stall_torque=stall)),) * 2)
    task = Task(arm=arm, start_positions=[-1.2, 0.5], goal_positions=[-0.9, 0.8], duration=0.7,
                payload_mass=1.0)
    problem = MotionProblem(ArmModel.of(arm), task, task_parameters(task))
    rigid = rigid_problem(problem)
    result = cold_start(rigid, Solver()).result
    assert result.converged
    return problem, rigid, result.solution


@pytest.fixture(scope='module')
def heavy() -> Found:
    return solved(500.0, 9.81)


def follow(found: Found) -> tuple[CollocationSolution, float]:
    kept = np.arange(4) < 2
    return follow_quasi_statically(*found, kept)


def test_links_are_where_their_load_holds_them(heavy: Found) -> None:
    problem, n_t = heavy[0], 4
    z = follow(heavy)[0](np.linspace(0.05, 0.65, 13))
    acceleration = problem.model.controls(z, problem.p).acceleration
    acceleration[:, 2:] = 0.0
    physical = problem.parameters.physical
    force = problem.model.inverse_dynamics(z[:, :2 * n_t], acceleration, physical)[:, 2:]
    straight = np.where(np.arange(2 * n_t) % n_t < 2, z[:, :2 * n_t], 0.0)
    load = problem.model.inverse_dynamics(straight, acceleration, physical)[:, 2:]
    assert np.abs(force).max() < 1e-3 * np.abs(load).max()


def test_the_joints_move_as_those_of_the_rigid_arm(heavy: Found) -> None:
    times = np.linspace(0, 0.7, 15)
    followed = follow(heavy)[0](times)
    assert followed[:, [0, 1, 4, 5]] == pytest.approx(heavy[2](times)[:, :4], rel=1e-10, abs=1e-12)


def miss(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Return how far off the joints are at the goal [rad]."""
    final, asked = simulate_to_goal(problem, solution, Monitor(), 1e-9)
    return float(np.abs(final - asked)[:2].max())


def test_the_torque_leads_the_bent_arm_to_the_goal(heavy: Found) -> None:
    """That of the rigid arm, of which gravity asks the same, leads further away."""
    problem, rigid, solution = heavy
    followed, left_out = follow(heavy)
    plain = follow((problem, replace_limits(rigid), solution))[0]
    assert left_out == 0.0
    assert miss(problem, followed) < 0.3 * miss(problem, plain)


def replace_limits(rigid: MotionProblem) -> MotionProblem:
    """Return a problem in which a motor is on its limit for an instant."""
    return MotionProblem(rigid.model, rigid.task, replace(
        rigid.parameters, stall_torque=0.0 * rigid.parameters.stall_torque + 10.0), holds=False)


def test_on_a_limit_the_torque_is_that_of_the_rigid_arm() -> None:
    found = solved(12.0, 0.0)
    problem, rigid, solution = found
    times = np.linspace(0, 0.7, 15)
    torques = [each.model.controls(motion(times), each.p).torque
               for each, motion in ((rigid, solution), (problem, follow(found)[0]))]
    assert np.abs(torques[0]).max() == pytest.approx(12.0)
    assert torques[1] == pytest.approx(torques[0], abs=1e-9)
    assert follow(found)[1] > 0.0
