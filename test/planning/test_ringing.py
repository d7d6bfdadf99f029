"""What jumps of the torque leave ringing in stiff links, and what it costs to bring to rest."""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.ringing import FastVibrations, price_rest
import numpy as np
import pytest


def problem_of(rigidity: float, damping: float = 0.0, modes: int = 2) -> MotionProblem:
    link = Link(length=0.8, linear_density=4.0, flexural_rigidity=rigidity, modes=modes,
                mode_family='clamped_free', damping_ratio=damping)
    arm = Arm(name='beam', links=(link,), joints=(Joint(motor=Motor(stall_torque=50.0)),),
              nodes=(Node(inertia=0.5), Node(mass=0.5)))
    task = Task(arm=arm, start_positions=[0.0], goal_positions=[0.6], duration=1.0)
    return MotionProblem(ArmModel.of(arm), task, task_parameters(task))


def fast_vibrations(problem: MotionProblem) -> FastVibrations:
    n_t = problem.model.arm.n_coordinates
    return FastVibrations.about(problem, problem.goal, np.arange(n_t) > 0)


def test_they_are_the_modes_of_the_arm_whose_joints_are_free() -> None:
    problem = problem_of(1e4)
    fast = fast_vibrations(problem)
    rates, vectors = natural_modes(problem.model, problem.goal[:3], problem.parameters,
                                   locked=False)
    assert fast.rates == pytest.approx(rates[1:], rel=1e-9)
    assert np.abs(fast.vectors) == pytest.approx(np.abs(vectors[:, 1:]), rel=1e-6)


def test_a_jump_of_the_load_leaves_what_it_bends() -> None:
    problem = problem_of(1e4)
    fast = fast_vibrations(problem)
    bends = fast.bends_under(np.array([3.0]))
    # a constant torque holds the modes where they are bent: nothing is left to accelerate them
    joint = np.linalg.solve(fast.mass, np.array([3.0, 0.0, 0.0]) - fast.stiffness @ bends)
    assert joint[1:] == pytest.approx(np.zeros(2), abs=1e-9 * abs(joint[0]))
    assert fast.vectors @ fast.amplitudes(bends) == pytest.approx(
        [-(fast.mass[0, 1:] @ bends[1:]) / fast.mass[0, 0], *bends[1:]], rel=1e-9)


@pytest.mark.parametrize('damping', [0.0, 0.003, 0.03])
def test_the_price_is_what_least_effort_pays_for_rest(damping: float) -> None:
    """The exact Gramian of the linear arm has it without averaging over cycles."""
    fast = fast_vibrations(problem_of(1e4, damping, modes=1))
    w, d, b = fast.rates[0], fast.damping[0], fast.vectors[0, 0]
    link = fast.problem.model.arm.links[0]
    own = link.linear_density * link.mode_shapes().gram[0, 0]
    coefficient = 2 * damping * np.sqrt(fast.stiffness[1, 1] * own)
    assert d == pytest.approx(fast.vectors[1, 0]**2 * coefficient, abs=1e-12, rel=1e-6)
    t = np.linspace(0, 1, 20001)
    answers = np.stack([np.exp((1j * w - d / 2) * t).imag, np.exp((1j * w - d / 2) * t).real])
    gramian = np.trapezoid(b**2 * answers[:, None] * answers, t)
    goal = np.array([1e-3])
    exact = np.array([0, w * goal[0]]) @ np.linalg.solve(gramian, [0, w * goal[0]]) / 2
    assert price_rest([fast], 0 * goal, goal) == pytest.approx(exact, rel=0.05)
