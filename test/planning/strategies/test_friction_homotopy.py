"""A homotopy in Coulomb friction: light arms of hobby servos."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flex_planner import Arm, Task
from flex_planner.arms.arm import Joint, Link, Motor, Node
from flex_planner.base.progress import Monitor
from flex_planner.collocation import Solver, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.advice import suggest_changes
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.strategies.catalogue import QUICK
from flex_planner.planning.strategies.friction_homotopy import sharpen_friction, soften_friction
import numpy as np
from plan_checks import problem_of
import pytest

STRIP: dict[str, Any] = {'modes': 1, 'mode_family': 'clamped_free', 'damping_ratio': (0.01,)}


def servo_task(coulomb: float) -> Task:
    """Return a swing of two aluminium strips on two servos in a vertical plane."""
    servo = Motor(stall_torque=3.0, no_load_speed=6.0, rotor_inertia=1.3e-7, gear_ratio=250.0)
    arm = Arm(
        name='servo arm', gravity=[0.0, -9.81],
        links=(Link(length=0.3, linear_density=0.135, flexural_rigidity=1.167, **STRIP),
               Link(length=0.25, linear_density=0.101, flexural_rigidity=0.492, **STRIP)),
        joints=tuple(Joint(motor=servo, viscous_friction=0.05, coulomb_friction=coulomb,
                           housing=Node(mass=0.065, inertia=1e-5)) for _ in range(2)),
        nodes=(Node(inertia=1e-5), Node(inertia=1e-5), Node()))
    return Task(arm=arm, start_positions=np.deg2rad([-80.0, 20.0]),
                goal_positions=np.deg2rad([30.0, -40.0]), duration=1.5, payload_mass=0.1)


@pytest.fixture(scope='module')
def problem() -> MotionProblem:
    """Return a motion with 0.1 N m of Coulomb friction at each joint."""
    task = servo_task(0.1)
    return problem_of(ArmModel.of(task.arm), task)


def test_motion_that_other_quick_strategies_do_not_find_is_certified(
        problem: MotionProblem) -> None:
    others = tuple(one for one in QUICK if one.attempt is not sharpen_friction)
    assert plan_problem(problem, Solver(), others).status is PlanStatus.NOT_CONVERGED
    plan = plan_problem(problem, Solver(), QUICK)
    assert plan.solved
    assert plan.problem.parameters.coulomb_speed.tolist() == [0.1, 0.1]
    assert plan.tried[-1].name == 'homotopy in Coulomb friction'


def test_friction_is_that_of_the_arm_at_the_end(problem: MotionProblem) -> None:
    softened = soften_friction(problem, 4.0)
    assert softened is not None
    assert softened(1.0) is problem
    first = softened(0.0).parameters
    assert first.coulomb_speed == pytest.approx(4.0 * np.deg2rad(110.0) / 1.5)
    assert first.coulomb_friction.tolist() == [0.1, 0.1]
    half = softened(0.5).parameters.coulomb_speed
    assert half == pytest.approx(np.sqrt(0.1 * first.coulomb_speed))


def test_without_friction_or_with_soft_friction_it_adds_nothing(problem: MotionProblem) -> None:
    smooth, slow = problem.parameters, problem.parameters
    smooth = replace(smooth, coulomb_friction=np.zeros(2))
    slow = replace(slow, coulomb_speed=np.full(2, 10.0))
    for parameters in (smooth, slow):
        easy = MotionProblem(problem.model, problem.task, parameters)
        assert sharpen_friction(easy, Solver()) is None
        assert 'coulomb_speed' not in suggest_changes(easy, Solver())


def test_advice_names_friction_where_softer_friction_leads_to_a_motion(
        problem: MotionProblem) -> None:
    assert suggest_changes(problem, Solver()).startswith(
        'what may help: a larger coulomb_speed (with 19 times as much there is a motion), ')


def test_it_is_canceled_between_its_iterations(problem: MotionProblem) -> None:
    for last in (0, 1, 30):
        monitor = Monitor()
        monitor.canceled = lambda count=last, watch=monitor: watch.iteration >= count
        attempt = sharpen_friction(problem, Solver(monitor=monitor))
        assert attempt is not None
        assert (attempt.result.status, monitor.iteration) == (SolverStatus.CANCELED, last)
