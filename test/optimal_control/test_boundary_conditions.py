"""States at both ends of a motion: given, or at a price, and as the payload bends them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math

from flex_planner.arms.arm import Arm, Joint, Motor
from flex_planner.arms.kinematics import tip_jacobian, tip_position
from flex_planner.base.errors import HoldingError, NoEquilibriumError, UnreachableError
from flex_planner.base.validation import Array
from flex_planner.collocation.problem import SingularSystemError
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.boundary_conditions import BoundaryConditions, PayloadEnds
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.holding import holding_limit
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


@pytest.mark.parametrize('stall_torque', [9.0, 1e4])
def test_motors_that_outlast_the_links_do_not_say_what_is_held(
        crane_model: ArmModel, crane_arm: Arm, task: Task, stall_torque: float) -> None:
    joint = Joint(motor=Motor(stall_torque=stall_torque))
    strong = replace(task, arm=replace(crane_arm, joints=(joint, joint)))
    limit, _ = holding_limit(crane_model, strong, task_parameters(strong))
    with pytest.raises(NoEquilibriumError):
        payload_ends(crane_model, task).at(1, 100.0)
    assert (limit < 10) if stall_torque == 9 else (limit == inf)


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

    found, slope, _ = payload_ends(crane_model, task).at(end, 0.3)
    assert np.array_equal(found, state(0.3))
    # truncation: the sag is nearly linear in the payload; rounding of 1e-13 m over 1e-3 kg
    difference = (state(0.301) - state(0.299)) / 2e-3
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-9)
    assert slope[2:5].all()
    assert not slope[[0, 1, *range(5, 10)]].any()  # joints and speeds are given


# Points where the tip rests


@pytest.fixture
def between_points(crane_arm: Arm) -> Task:
    """Return a motion between points under gravity."""
    return Task.between_points(crane_arm, (0.1, -0.8), (0.3, -0.75), duration=1.0, elbow=1,
                               payload_mass=0.2)


@pytest.mark.parametrize('payload', [0.2, 0.0, 0.5])
def test_tip_rests_at_both_points_whatever_it_carries(crane_model: ArmModel, payload: float,
                                                      between_points: Task) -> None:
    task = replace(between_points, payload_mass=payload)
    ends = ends_of(crane_model, task)
    unbent = np.array([task.start_positions, task.goal_positions])
    for state, angles, point in zip((ends.start, ends.goal), unbent,
                                    (task.start_point, task.goal_point), strict=True):
        q, torque = equilibrium(crane_model, state[:2], task_parameters(task))
        np.testing.assert_allclose(tip_position(crane_model.arm, q), point, rtol=0, atol=1e-11)
        assert np.abs(state[:2] - angles).max() > 1e-3  # the unbent arm would miss
        assert not state[5:].any()
    np.testing.assert_allclose(ends.holding_torque, torque, rtol=1e-9)


@pytest.mark.parametrize('end', [0, 1])
def test_posture_at_a_point_follows_the_payload(crane_model: ArmModel, between_points: Task,
                                                end: int) -> None:
    def state(payload: float) -> Array:
        ends = ends_of(crane_model, replace(between_points, payload_mass=payload))
        return (ends.start, ends.goal)[end]

    found, slope, _ = payload_ends(crane_model, between_points).at(end, 0.3)
    assert np.array_equal(found, state(0.3))
    difference = (state(0.301) - state(0.299)) / 2e-3
    # of second order in 1e-3 kg; the tip is exact to 1e-12 m, over 1e-4 kg
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-7)
    assert slope[:5].all()
    # the tip stays where it is
    tip = tip_jacobian(crane_model.arm, found[:5]) @ slope[:5]
    np.testing.assert_allclose(tip, 0, atol=1e-7)


def test_payload_is_held_in_the_posture_that_it_bends_the_arm_to(crane_model: ArmModel,
                                                                 between_points: Task) -> None:
    parameters = task_parameters(between_points)
    limit, joint = holding_limit(crane_model, between_points, parameters)
    ends = ends_of(crane_model, replace(between_points, payload_mass=limit * (1 - 1e-9)))
    shares = np.abs(ends.holding_torque) / parameters.stall_torque
    assert (shares.argmax(), shares.max()) == (joint, pytest.approx(1, abs=1e-8))
    unbent, _ = holding_limit(crane_model, replace(between_points, goal_point=[]), parameters)
    assert abs(limit / unbent - 1) > 1e-3


@pytest.mark.parametrize(('name', 'point', 'error'), [
    ('start', (0.9, 0.8), UnreachableError), ('goal', (2.0, 0.0), UnreachableError)])
def test_point_that_the_bent_arm_cannot_reach_is_named(
        crane_model: ArmModel, between_points: Task, name: str, point: tuple[float, float],
        error: type[Exception]) -> None:
    task = replace(between_points, **{f'{name}_point': point})  # type: ignore[arg-type]
    with pytest.raises(error, match=f'^{name}_point: no posture was found in which the arm, bent'):
        ends_of(crane_model, task)


def test_payload_that_cannot_rest_at_its_point_leaves_no_ends(crane_model: ArmModel,
                                                              between_points: Task) -> None:
    ends = payload_ends(crane_model, between_points)
    with pytest.raises(NoEquilibriumError):
        ends.at(1, 100.0)


# A start that moves


def test_start_that_moves_is_that_of_the_task_for_any_payload(crane_model: ArmModel,
                                                              task: Task) -> None:
    moving = replace(task, start_modal_displacements=[0.01, -0.02, 0.03],
                     start_velocities=[0.1, 0.2, 0.3, 0.4, 0.5])
    expected = [-1.6, 0.2, 0.01, -0.02, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5]
    assert ends_of(crane_model, moving).start.tolist() == expected
    ends = payload_ends(crane_model, moving)
    state, slope, bend = ends.at(0, 3.0)
    assert state.tolist() == expected
    assert not slope.any()
    assert not bend.any()
    assert ends.at(1, 0.3)[1].any()


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
