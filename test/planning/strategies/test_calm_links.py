"""Motions of clamped links that ring at no cost, found with a price on the speed of bending."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flex_planner import Arm, load_arm, Plan, plan_path, Task
from flex_planner.arms.arm import Motor
from flex_planner.collocation import Solver
from flex_planner.collocation.newton_outcome import NewtonOutcome
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.path_constraints import JointSpeed
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.strategies import calm_links as strategy
from flex_planner.planning.strategies.catalogue import CALM
from flex_planner.planning.warnings import bends_at_once, WarningKind
import numpy as np
import pytest
from scipy_backend import solve_by_scipy

# one link of the paper, clamped, that is lifted by 0.6 rad in 2 s with 1 kg: by homotopy in
# stiffness on 2000 intervals, which took 22 s of CPU time
COST, WITH_ONE_MODE = 35.95994497, 35.96219256


def lifting(modes: int, **joint: Any) -> Task:
    """Return a motion of one clamped link under gravity."""
    paper = load_arm('korayem_ei50')
    link = replace(paper.links[0], modes=modes, mode_family='clamped_free')
    motor = replace(paper.joints[0], motor=Motor(stall_torque=1e3, **joint))
    arm = Arm(name='one clamped link', links=(link,), joints=(motor,), gravity=[0.0, -9.81])
    return Task(arm=arm, start_positions=[0.5], goal_positions=[1.1], duration=2.0,
                payload_mass=1.0)


def calmly(task: Task) -> Plan:
    """Return what this strategy alone leads to."""
    return plan_path(task, strategies=(CALM,), search='fast')


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the price stay since there are no iterations to lower it."""
    monkeypatch.setattr(strategy, '_PATIENCE_FALLING', 0)


@pytest.mark.parametrize(('modes', 'cost'), [(1, WITH_ONE_MODE), (2, COST)])
def test_price_falls_to_nothing(modes: int, cost: float) -> None:
    plan = calmly(lifting(modes))
    assert plan.solved
    assert plan.cost == pytest.approx(cost, rel=1e-7)
    assert not plan.task.velocity_weights.any()
    assert WarningKind.PRICE_ON_BENDING not in {one.kind for one in plan.warnings}


def test_links_are_softened_where_the_rigid_motion_is_not_near(
        monkeypatch: pytest.MonkeyPatch) -> None:
    walked: list[float] = []
    solve = strategy._Walk._solve

    def watched(walk: strategy._Walk, problem: MotionProblem, *rest: Any) -> NewtonOutcome:
        walked.append(float(problem.parameters.rigidity[0]))
        outcome = solve(walk, problem, *rest)
        # from the rigid motion, and from links that are much stiffer
        return replace(outcome, converged=outcome.converged and len(walked) not in {1, 3})

    monkeypatch.setattr(strategy._Walk, '_solve', watched)
    plan = calmly(lifting(1))
    stiff, half = 500.0, 500 / 3.2
    softened = walked[:walked.index(50.0, 1) + 1]
    assert softened[:3] == pytest.approx([50.0, stiff, half])
    assert half < softened[3] < stiff
    assert softened[3:] == sorted(softened[3:], reverse=True)
    assert plan.cost == pytest.approx(WITH_ONE_MODE, rel=1e-7)


def test_nothing_is_softened_that_does_not_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    solve, walked = strategy._Walk._solve, []

    def failing(walk: strategy._Walk, *rest: Any) -> NewtonOutcome:
        walked.append(rest)
        return replace(solve(walk, *rest), converged=False, message='made to fail')

    monkeypatch.setattr(strategy._Walk, '_solve', failing)
    plan = calmly(lifting(1))
    assert plan.status is PlanStatus.NOT_CONVERGED
    assert 'made to fail' in plan.message
    assert len(walked) == 2  # as they are, and stiffer


def test_other_methods_do_not_walk() -> None:
    task = lifting(1)
    problem = MotionProblem(ArmModel.of(task.arm), task, task_parameters(task))
    assert strategy.calm_links(problem, Solver(backend=solve_by_scipy)) is None


@pytest.mark.usefixtures('impatient')
def test_price_that_stays_is_told() -> None:
    task = lifting(1)
    plan = calmly(task)
    assert bends_at_once(task.arm)
    assert plan.solved
    assert plan.certified
    weights = plan.task.velocity_weights
    assert weights[0] == 0.0 < weights[1]
    [told] = [one for one in plan.warnings if one.kind is WarningKind.PRICE_ON_BENDING]
    assert told.value == pytest.approx(weights[1])
    # the plan is that of the task with these weights, and costs little more than the best
    again = plan_path(replace(task, velocity_weights=weights), search='fast')
    assert plan.cost == pytest.approx(again.cost, rel=1e-6)
    assert WITH_ONE_MODE < plan.cost == pytest.approx(WITH_ONE_MODE, rel=2e-2)


@pytest.mark.usefixtures('impatient')
def test_price_is_told_of_plans_that_limits_bend_too() -> None:
    plan = calmly(replace(lifting(1), path_constraints=(JointSpeed(joint=1, limit=0.42),)))
    assert plan.solved
    assert plan.constraints
    assert plan.task.velocity_weights.any()
    assert WarningKind.PRICE_ON_BENDING in {one.kind for one in plan.warnings}


@pytest.mark.usefixtures('impatient')
def test_no_price_is_added_where_joints_have_inertia() -> None:
    task = lifting(1, rotor_inertia=0.05)
    assert not bends_at_once(task.arm)
    plan = calmly(task)
    assert plan.status is PlanStatus.NOT_CONVERGED
    np.testing.assert_array_equal(plan.task.velocity_weights, task.velocity_weights)


def test_rigid_arms_have_nothing_to_calm() -> None:
    plan = calmly(lifting(0))
    assert plan.status is PlanStatus.NOT_CONVERGED
    assert 'no strategy applies' in plan.message
