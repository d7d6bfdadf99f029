"""Proofs for a point count every way round to it."""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.arms.kinematics import tip_position
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.proofs import bound_duration
from flex_planner.planning.proofs.motion_facts import MotionFacts
import numpy as np
from plan_checks import problem_of
import pytest

# joints turn by less than half a turn, the second link by nearly a whole one
GOAL = np.array([3.0, 3.0])


@pytest.fixture(scope='module')
def arm() -> Arm:
    """Return a short link that carries a long one."""
    links = tuple(Link(length=length, linear_density=1.0) for length in (0.2, 1.0))
    joints = tuple(Joint(motor=Motor(stall_torque=torque)) for torque in (12.0, 1.0))
    return Arm(name='short and long', links=links, joints=joints)


def test_bound_of_a_point_is_no_more_than_that_of_any_way_to_it(arm: Arm) -> None:
    model = ArmModel(arm)
    point = Task.to_point(arm, np.zeros(2), tip_position(arm, GOAL), elbow=1, duration=2.0)
    np.testing.assert_allclose(point.goal_positions, GOAL)
    ways = [Task(arm=arm, start_positions=np.zeros(2), goal_positions=GOAL - turn, duration=2.0)
            for turn in ([0, 0], [2 * np.pi, 0], [0, 2 * np.pi])]
    bounds = [bound_duration(problem_of(model, way)) for way in ways]
    assert 0 < bound_duration(problem_of(model, point)) <= min(bounds) < bounds[0] / 2


def test_strokes_to_a_point_are_the_shortest(arm: Arm) -> None:
    model = ArmModel(arm)
    goal = tip_position(arm, GOAL)
    point = Task.to_point(arm, [-7.0, 0.0], goal, elbow=1, duration=2.0)
    joints, links = MotionFacts(problem_of(model, point)).strokes()
    np.testing.assert_allclose(joints, [4 * np.pi - 10, 3.0])
    np.testing.assert_allclose(links, [4 * np.pi - 10, 13 - 4 * np.pi])
