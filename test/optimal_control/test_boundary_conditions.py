"""States at both ends of a motion: given, or at a price, and as the payload bends them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import HoldingError, NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.collocation.linear import SingularSystemError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.boundary_conditions import BoundaryConditions, PayloadEnds
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.motion_problem import task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from free_problems import extended
from known_limits import G, lifted_to
import numpy as np
from plan_checks import problem_of
import pytest

inf = math.inf


def ends_of(model: ArmModel, task: Task) -> BoundaryConditions:
    return BoundaryConditions(model, task, task_parameters(task))


@pytest.fixture
def task(crane_arm: Arm) -> Task:
    """Return a motion under gravity that begins and ends with speeds, some of them at a price."""
    return Task(arm=crane_arm, start_positions=[-1.6, 0.2], goal_positions=[-1.2, -0.2],
                duration=1.0, payload_mass=0.2, start_velocities=[0.1, 0.2],
                goal_velocities=[0.3, 0.4], goal_position_weights=[inf, 7.0],
                goal_velocity_weights=[12.0, inf, 0.0, inf, inf])


def test_start_is_met_by_its_state_whatever_the_costates(crane_model: ArmModel,
                                                         task: Task) -> None:
    ends, costates = ends_of(crane_model, task), np.arange(10.0)
    residual, rows = ends.left(np.concatenate([ends.start, costates]))
    assert not residual.any()
    assert np.array_equal(rows, np.eye(10, 20))
    assert ends.start[[0, 1, 5, 6]].tolist() == [-1.6, 0.2, 0.1, 0.2]
    assert ends.start[2:5].all()  # links sag


def test_goal_is_met_where_it_is_hard_and_priced_where_it_is_not(crane_model: ArmModel,
                                                                 task: Task) -> None:
    ends, rng = ends_of(crane_model, task), np.random.default_rng(1)
    z = rng.normal(size=20)
    residual, rows = ends.right(z)
    miss, psi = z[:10] - ends.goal, z[10:]
    # eq. (16), or transversality of eq. (6): psi = W (x - goal)
    weights = np.array([inf, 7.0, inf, inf, inf, 12.0, inf, 0.0, inf, inf])
    expected = [gap if W == inf else price - W * gap
                for W, gap, price in zip(weights, miss, psi, strict=True)]
    np.testing.assert_allclose(residual, expected, rtol=1e-14)  # rounding
    assert ends.goal_weights.tolist() == weights.tolist()
    np.testing.assert_allclose(rows @ np.concatenate([miss, psi]), expected, rtol=1e-14)


def test_motion_is_to_reach_its_goal_or_where_it_ends_at_a_price(crane_model: ArmModel,
                                                                 task: Task) -> None:
    ends, end = ends_of(crane_model, task), 100.0 + np.arange(10)
    reached = ends.target_state(end)
    priced = np.isfinite(ends.goal_weights)
    assert np.flatnonzero(priced).tolist() == [1, 5, 7]
    assert np.array_equal(reached, np.where(priced, end, ends.goal))


@pytest.mark.parametrize('changes', [
    {'goal_velocity_weights': [0.0]}, {'goal_position_weights': [5.0]},
    {'goal_velocities': [0.1]}], ids=str)
def test_motor_need_not_hold_an_arm_that_does_not_come_to_rest(
        changes: dict[str, list[float]]) -> None:
    # it has 6 N m
    task = lifted_to(0.0, 2.0, payload_mass=0.5)
    ends = ends_of(ArmModel.of(task.arm), replace(task, **changes))
    assert ends.holding_torque == pytest.approx([0.65 * G], rel=1e-12)
    with pytest.raises(HoldingError, match='joint 1 needs 6.377 N m to hold the arm') as raised:
        ends_of(ArmModel.of(task.arm), task)
    assert (raised.value.joint, raised.value.stall) == (0, 6.0)
    assert raised.value.torque == pytest.approx(0.65 * G, rel=1e-12)


# Bent by the payload


def test_payload_bends_the_ends_under_gravity_only(saturated: Callable[[str], Plan]) -> None:
    for name, bends in (('rigid', False), ('ei5', False), ('crane', True)):
        made, solution = extended(saturated(name), FreePayloadProblem)
        for side, z in ((made.left, solution.nodes[0]), (made.right, solution.nodes[-1])):
            assert side(z)[1][:, -2].any() == bends


def payload_ends(model: ArmModel, task: Task) -> PayloadEnds:
    return PayloadEnds(model, task, task_parameters(task), ends_of(model, task))


@pytest.mark.parametrize('end', [0, 1])
def test_ends_are_those_of_the_task_with_that_payload(crane_model: ArmModel, task: Task,
                                                      end: int) -> None:
    def state(payload: float) -> Array:
        ends = ends_of(crane_model, replace(task, payload_mass=payload))
        return (ends.start, ends.goal)[end]

    found, slope = payload_ends(crane_model, task).at(end, 0.3)
    assert np.array_equal(found, state(0.3))
    # truncation: the sag is nearly linear in the payload; rounding of 1e-13 m over 1e-3 kg
    difference = (state(0.301) - state(0.299)) / 2e-3
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-9)
    assert slope[2:5].all()
    assert not slope[[0, 1, *range(5, 10)]].any()  # joints and speeds are given


def test_payload_that_buckles_the_links_leaves_no_ends(crane_model: ArmModel,
                                                       task: Task) -> None:
    with pytest.raises(NoEquilibriumError, match='no static equilibrium'):
        payload_ends(crane_model, task).at(1, 100.0)
    # Newton's method is told, so that it takes a smaller step
    problem = FreePayloadProblem(problem_of(crane_model, task), price=1.0)
    z = np.zeros(problem.size)
    z[-2] = 100.0
    for rows in (problem.left, problem.right):
        with pytest.raises(SingularSystemError, match='no static equilibrium'):
            rows(z)
