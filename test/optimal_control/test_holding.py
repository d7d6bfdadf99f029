"""The largest payload that is held at the goal, and that no larger one is."""

from __future__ import annotations

from dataclasses import replace
import math
import pickle
from typing import Any

from flex_planner.arms.arm import Arm, BeamSection, Elasticity, Joint, Link, Motor, Node
from flex_planner.base.errors import HoldingError
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.holding import (
    holding_bound,
    holding_limit,
    knows_holding,
)
from flex_planner.optimal_control.motion_problem import task_parameters
from flex_planner.optimal_control.task import Task
from known_limits import G, lifted_to
from light_model import LightModel
import numpy as np
import pytest

inf = math.inf


@pytest.mark.parametrize('angle', [0.0, -0.4, 1.2])
def test_payload_that_a_pendulum_holds_has_its_closed_form(angle: float) -> None:
    # u_max = (m / 2 + m_p) G l cos(goal)
    task = lifted_to(angle, 2.0)
    for function in (holding_limit, holding_bound):
        limit, joint = function(ArmModel.of(task.arm), task, task_parameters(task))
        assert limit == pytest.approx(6 / (G * math.cos(angle)) - 0.15, rel=1e-10)
        assert joint == 0


@pytest.mark.parametrize(('torques', 'joint'), [((inf, 4.0), 1), ((9.0, 40.0), 0)])
def test_joint_that_holds_least_is_named(torques: tuple[float, float], joint: int) -> None:
    link = Link(length=0.5, linear_density=1.0)
    arm = Arm(name='two', links=(link, link), gravity=[0, -G], joints=tuple(
        Joint(motor=Motor(stall_torque=torque)) for torque in torques))
    task = Task(arm=arm, start_positions=[-0.7, 0.7], goal_positions=[0.0, 0.0], duration=1.0)
    # level: link 2 alone has 0.125 kg m and the payload 0.5 m, both links have 0.5 kg m and 1 m
    expected = (4 / G - 0.125) / 0.5 if joint else 9 / G - 0.5
    for function in (holding_limit, holding_bound):
        limit, first = function(ArmModel.of(arm), task, task_parameters(task))
        assert (limit, first) == (pytest.approx(expected, rel=1e-9), joint)


@pytest.mark.parametrize('changes', [{'gravity': [0.0, 0.0]}, {'joints': (Joint(),)}], ids=str)
def test_any_payload_is_held_without_gravity_or_without_limits(changes: dict[str, Any]) -> None:
    task = lifted_to(0.0, 2.0)
    task = replace(task, arm=replace(task.arm, **changes))
    for function in (holding_limit, holding_bound):
        assert function(ArmModel.of(task.arm), task, task_parameters(task)) == (inf, 0)


def test_counterweight_that_can_be_held_has_a_limit_though_nothing_cannot() -> None:
    # link 1 weighs 2 kg, link 2 is balanced over joint 1 and carries the payload on the other side
    links = (Link(length=1.0, linear_density=2.0), Link(length=2.0, linear_density=1.0))
    joints = (Joint(motor=Motor(stall_torque=2.0)), Joint())
    arm = Arm(name='balance', links=links, joints=joints, gravity=[0.0, -9.81])
    task = Task(arm=arm, start_positions=[0.1, np.pi], goal_positions=[0.0, np.pi], duration=2.0,
                payload_mass=1.0)
    for function in (holding_limit, holding_bound):
        limit, joint = function(ArmModel.of(arm), task, task_parameters(task))
        assert limit == pytest.approx(1 + 2.0 / 9.81, rel=1e-9)
        assert joint == 0


# Links that bend


def hanging(links: tuple[Link, ...], goal: list[float], stall: float = 12.0) -> Task:
    joints = (Joint(motor=Motor(stall_torque=stall)),) * len(links)
    arm = Arm(name='bent', links=links, joints=joints, gravity=[2.0, -G])
    return Task(arm=arm, start_positions=[0.1] * len(links), goal_positions=goal, duration=1.0)


def flexible(family: str) -> Link:
    return Link(length=0.6, linear_density=0.5, flexural_rigidity=4.0, modes=2,
                mode_family=family)


STIFF = Link(length=0.4, linear_density=0.8)
BODY = Link(length=0.4, linear_density=0.8, center_of_mass=(0.1, -0.2), inertia=0.01)
HUB = (BeamSection(share=0.2, density=0.5, rigidity=inf), BeamSection(share=0.8, density=1.125))


def largest_share(task: Task, payload: float) -> float:
    model: Any = LightModel(task.arm)
    parameters = replace(task_parameters(task), payload_mass=payload)
    torque: Array = equilibrium(model, task.goal_positions, parameters)[1]
    return float((np.abs(torque) / parameters.stall_torque).max())


@pytest.mark.parametrize(('links', 'goal'), [
    ((flexible('pinned_pinned'), flexible('pinned_pinned')), [0.3, -0.9]),
    ((flexible('pinned_pinned'), STIFF), [0.3, 0.4]),
    ((flexible('clamped_free'),), [0.0]),
    ((flexible('clamped_free'),), [0.8]),  # bends back to where its weight pulls less
    ((flexible('clamped_mass'),), [-0.8]),
    ((STIFF, flexible('clamped_free')), [0.5, 0.6]),
    ((STIFF, replace(flexible('clamped_free'), sections=HUB)), [0.5, 0.6]),
    ((BODY, STIFF), [0.3, 0.4])], ids=str)
def test_no_payload_above_the_limit_is_held(links: tuple[Link, ...], goal: list[float]) -> None:
    assert_no_more_is_held(hanging(links, goal))


@pytest.mark.parametrize(('links', 'goal'), [
    ((BODY, STIFF), [0.3, 0.4]), ((flexible('pinned_pinned'),) * 2, [0.3, -0.9]),
    ((STIFF,), [0.8])], ids=str)
def test_payload_off_the_tip_is_held_up_to_its_limit(links: tuple[Link, ...],
                                                     goal: list[float]) -> None:
    task = hanging(links, goal)
    housed = tuple(replace(joint, housing=Node(mass=0.3)) for joint in task.arm.joints)
    task = replace(task, arm=replace(task.arm, payload_com=[-0.1, 0.2], joints=housed))
    assert_no_more_is_held(task)


def assert_no_more_is_held(task: Task) -> None:
    model: Any = LightModel(task.arm)
    limit, _ = holding_bound(model, task, task_parameters(task))
    assert knows_holding(task.arm)
    # statics are solved to 1e-13 m
    assert largest_share(task, limit) == pytest.approx(1.0, rel=1e-9)
    heavier = limit * np.geomspace(1.001, 100.0, 25)
    assert min(largest_share(task, payload) for payload in heavier) > 1


def test_arm_that_bends_back_holds_payloads_in_two_ranges() -> None:
    # sags until its weight pulls along the link: the end of the first range is not the last
    task = hanging((flexible('clamped_free'),), [-0.8], stall=2.0)
    model: Any = LightModel(task.arm)
    payloads = np.linspace(0.0, 5.0, 51)
    held = np.array([largest_share(task, payload) for payload in payloads]) <= 1
    first, second, last = payloads[:-1][np.diff(held)]
    limit, bound = (function(model, task, task_parameters(task))[0]
                    for function in (holding_limit, holding_bound))
    assert first < limit < first + 0.1 < second
    assert last < bound < last + 0.1


def test_clamped_link_that_carries_another_leaves_it_open() -> None:
    task = hanging((flexible('clamped_free'), STIFF), [0.5, 0.6])
    assert not knows_holding(task.arm)
    model: Any = LightModel(task.arm)
    assert holding_bound(model, task, task_parameters(task)) == (inf, 0)


@pytest.mark.parametrize('changes', [
    {'links': (STIFF, flexible('clamped_free')), 'payload_com': [0.1, 0.0]},
    {'links': (STIFF, STIFF), 'joints': (Joint(), Joint(
        motor=Motor(rotor_inertia=0.1), elasticity=Elasticity(stiffness=50.0)))}], ids=str)
def test_payload_that_turns_or_twists_what_holds_it_leaves_it_open(
        changes: dict[str, Any]) -> None:
    task = hanging((STIFF, STIFF), [0.5, 0.6])
    task = replace(task, arm=replace(task.arm, **changes))
    assert not knows_holding(task.arm)
    model: Any = LightModel(task.arm)
    assert holding_bound(model, task, task_parameters(task)) == (inf, 0)


def test_payload_right_above_the_joints_loads_none() -> None:
    task = lifted_to(math.pi / 2, 2.0)
    for function in (holding_limit, holding_bound):
        assert function(ArmModel.of(task.arm), task, task_parameters(task)) == (inf, 0)


def test_error_survives_another_process() -> None:
    error = pickle.loads(pickle.dumps(HoldingError(1, -7.5, 6.0)))
    assert (error.joint, error.torque, error.stall) == (1, -7.5, 6.0)
    assert str(error).startswith('joint 2 needs 7.5 N m to hold the arm')
