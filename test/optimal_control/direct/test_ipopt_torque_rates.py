"""IPOPT's motions whose torques are states, beside those of the optimality conditions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from factories import TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.conversion import to_solution
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.point_layout import TorqueRates
from flex_planner.optimal_control.direct.result import DirectResult
from flex_planner.optimal_control.direct.unknowns import Free, Guess
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.initial_guesses import direct_collocation
import numpy as np
import pytest

# times over which the prices let torques turn [s]
TURN = 0.02


def problem_of(model: ArmModel, task: Task) -> MotionProblem:
    return MotionProblem(model, task, task_parameters(task))


def priced(task: Task) -> Task:
    return replace(task, torque_rate_weight=task.effort_weights * TURN**2)


def solved(motion: MotionProblem, free: Free = Free.NOTHING, price: float = 0.0,
           guess: Guess | None = None, **settings: Any) -> DirectResult:
    chosen = DirectSettings(**{'degree': 4, 'intervals': 30, **settings})
    return DirectProblem(motion.model, chosen, rates=TorqueRates.of(motion)).solve(
        motion.parameters, motion.start, motion.goal, motion.task.duration, free=free,
        price=price, guess=guess)


@pytest.fixture(scope='module')
def gentle(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, priced(paper_task(rigid_model.arm)))


@pytest.fixture(scope='module')
def found(gentle: MotionProblem) -> DirectResult:
    return solved(gentle)


def test_cost_torques_and_costates_are_those_of_the_conditions(
        gentle: MotionProblem, found: DirectResult) -> None:
    plan = plan_path(gentle.task, model=gentle.model, search='fast')
    assert plan.solution is not None and found.converged
    assert found.cost == pytest.approx(plan.cost, rel=1e-7)
    for mine, expected in ((found.nodes, plan.solution(found.times)),
                           (found.points, plan.solution(found.point_times))):
        scale = np.abs(expected).max(axis=0)
        np.testing.assert_allclose(mine / scale, expected / scale, atol=2e-4)
    np.testing.assert_allclose(found.torque_rates, -found.point_torque_costates
                               / gentle.task.torque_rate_weight, atol=0.5)


def test_motion_is_a_start_for_newtons_method(gentle: MotionProblem, found: DirectResult) -> None:
    result = Solver().solve(gentle, to_solution(found, gentle))
    assert result.converged and result.iterations <= 3


def test_motion_is_a_guess_with_the_same_unknowns(gentle: MotionProblem,
                                                  found: DirectResult) -> None:
    again = solved(gentle, guess=to_solution(found, gentle))
    assert again.converged and again.iterations < found.iterations
    np.testing.assert_allclose(again.iterate['x0'], found.iterate['x0'], atol=1e-3)


def test_torques_start_and_end_at_what_holds_the_arm() -> None:
    model = ArmModel(Arm(name='bar', links=(Link(length=1.0, linear_density=3.0),),
                         joints=(Joint(),), gravity=[0.0, -9.81]))
    task = Task(arm=model.arm, start_positions=[0.0], goal_positions=[0.5], duration=2.0,
                max_torque_rate=12.0)
    motion = problem_of(model, task)
    held, found = motion.torque_ends, solved(motion)
    assert held is not None and found.converged
    np.testing.assert_allclose(held.goal, 3 * 9.81 * 0.5 * np.cos(0.5))
    np.testing.assert_allclose(found.node_torques[[0, -1]], [held.start, held.goal], rtol=1e-9)
    assert np.abs(found.torque_rates).max() == pytest.approx(12, rel=1e-6)
    with pytest.raises(ValueError, match='the payload is free, but must be given under gravity'):
        solved(motion, Free.PAYLOAD, 1.0)


def test_rates_and_torques_are_bounded_at_once(rigid_model: ArmModel,
                                               paper_task: TaskFactory) -> None:
    task = priced(paper_task(rigid_model.arm, 5.5, max_torque_rate=900.0))
    plan, found = plan_path(task, model=rigid_model, search='fast'), solved(
        problem_of(rigid_model, task), scheme='radau', degree=3, intervals=120)
    assert plan.solved and found.converged, plan.message
    # limits hold at IPOPT's points alone; the plan costs more by what its barrier keeps
    assert 0 < plan.cost - found.cost < plan.barrier_gap
    assert plan.cost == pytest.approx(found.cost, rel=3e-3)
    assert np.abs(found.torque_rates).max() <= 900 * (1 + 1e-6)


def test_price_of_a_payload_is_what_it_costs(gentle: MotionProblem, found: DirectResult) -> None:
    light, heavy = (solved(gentle.with_changes(payload_mass=mass)).cost for mass in (0.99, 1.01))
    priced_motion = solved(gentle, Free.PAYLOAD, (heavy - light) / 0.02)
    assert priced_motion.payload == pytest.approx(1.0, abs=1e-3)
    assert priced_motion.cost == pytest.approx(found.cost, rel=5e-3)


def test_motion_must_rest_at_both_ends(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    moving = problem_of(rigid_model, priced(paper_task(
        rigid_model.arm, start_velocities=[0.1, 0.0])))
    with pytest.raises(ValueError, match='must rest at both ends'):
        TorqueRates.of(moving)
    assert direct_collocation(moving, Solver()) is None


def test_strategy_finds_the_motion(gentle: MotionProblem, found: DirectResult) -> None:
    attempt = direct_collocation(gentle, Solver())
    assert attempt is not None and attempt.result.converged
    np.testing.assert_allclose(attempt.result.solution(found.times)[:, :4], found.states,
                               atol=1e-6)
