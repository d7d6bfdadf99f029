"""Trajectories in CDR, against the encoder of recordings and the reader of ROS."""

from __future__ import annotations

from typing import Any

from factories import PlanFactory
from flex_planner.base.errors import InvalidValueError
from flex_planner.planning.plan import Plan
from flex_planner.planning.quick_sampling import sample_quickly
from flex_planner.planning.sampling import SamplingSettings
from flex_planner.ros.messages.classes import (
    FlexibleTrajectory,
    JointTrajectory,
    JointTrajectoryPoint,
    TYPES,
)
from flex_planner.ros.messages.plans import flexible_trajectory, joint_trajectory
from flex_planner.ros.messages.trajectory_bytes import (
    encode_flexible_trajectory,
    encode_joint_trajectory,
    FLEXIBLE_TRAJECTORY,
    JOINT_TRAJECTORY,
)
import pytest


def trajectory_of(plan: Plan, names: list[str], frame: str) -> FlexibleTrajectory:
    """Return what a plan is published as."""
    reference = sample_quickly(plan, SamplingSettings(longest_step=0.2, torque_tolerance=1.0))
    message = flexible_trajectory(plan, reference, joint_trajectory(reference, names), frame)
    message.header.stamp.sec, message.header.stamp.nanosec = 12, 345_678_901
    return message


# names of lengths that move what follows them; a rigid arm has empty sequences in its points
@pytest.mark.parametrize('arm', ['rigid', 'ei50'])
@pytest.mark.parametrize('names', [['a', 'b'], ['joint1', 'joint22'], ['Gelenk', 'grün']])
def test_trajectories_are_encoded_as_by_the_encoder_of_all_messages(
        plan_of: PlanFactory, arm: str, names: list[str]) -> None:
    message = trajectory_of(plan_of(arm), names, 'world'[:len(names[0])])
    joints = message.joint_trajectory
    assert encode_joint_trajectory(joints) == TYPES.encode(JOINT_TRAJECTORY, joints)
    assert encode_flexible_trajectory(message) == TYPES.encode(FLEXIBLE_TRAJECTORY, message)


@pytest.mark.parametrize('lengths', [(0, 0), (1, 1), (3, 3), (1, 0), (2, 3)])
def test_points_of_any_lengths_are_encoded_alike(lengths: tuple[int, int]) -> None:
    points = [JointTrajectoryPoint(positions=[0.5] * size, effort=[-1.0] * (size // 2))
              for size in lengths]
    message = JointTrajectory(joint_names=['x'], points=points)
    assert encode_joint_trajectory(message) == TYPES.encode(JOINT_TRAJECTORY, message)


def test_empty_trajectories_are_encoded_alike() -> None:
    empty = FlexibleTrajectory()
    assert encode_flexible_trajectory(empty) == TYPES.encode(FLEXIBLE_TRAJECTORY, empty)


def test_values_that_do_not_fit_are_refused() -> None:
    message: Any = FlexibleTrajectory()
    message.header.stamp._sec = 2**40
    with pytest.raises(InvalidValueError, match='sec'):
        encode_flexible_trajectory(message)
