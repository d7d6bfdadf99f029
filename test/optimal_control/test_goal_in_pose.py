"""Goals with an orientation: the tip of the bent arm rests as it is asked to."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.spatial_body import turn_rpy
from flex_planner.arms.spatial_kinematics import tip_frame
from flex_planner.base.errors import InvalidValueError, UnreachableError
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.goal_in_pose import posture_in_pose
from flex_planner.optimal_control.task import Task
import numpy as np
import pytest
from spatial_arms import ur5, yaw_pitch

LOAD = {'payload_mass': 0.4, 'payload_inertia': 1e-3}


def test_bent_arm_rests_in_the_pose_with_its_payload() -> None:
    arm, angles = yaw_pitch(), np.array([0.4, 0.25])
    rest, _ = equilibrium(ArmDynamics.of(arm), angles, PhysicalParameters.of_arm(arm, **LOAD))
    place, axes = tip_frame(arm, rest)
    task = Task.to_pose(arm, [0.0, 0.0], place, axes, duration=0.8, **LOAD)
    np.testing.assert_allclose(task.goal_positions, angles, atol=1e-8)
    # with another payload it sags otherwise: two joints cannot make up for that
    with pytest.raises(UnreachableError, match='bent by gravity, rests with its tip in that pose'):
        posture_in_pose(arm, place, axes, payload_mass=2.0)


def test_rigid_arm_takes_the_pose_nearest_to_the_start() -> None:
    arm, near = ur5(), np.array([0.9, -0.9, 1.0, -1.0, -1.2, 0.4])
    place, axes = tip_frame(arm, np.array([1.0, -0.8, 0.9, -1.0, -1.2, 0.5]))
    found = posture_in_pose(arm, place, axes, near)
    reached, turned = tip_frame(arm, found)
    np.testing.assert_allclose(reached, place, atol=1e-8)
    np.testing.assert_allclose(turned, axes, atol=1e-8)
    assert np.abs(found - near).max() < 0.3


def test_orientation_may_be_roll_pitch_and_yaw_and_may_not_be_reached() -> None:
    arm = replace(yaw_pitch(), gravity=[0.0, 0.0, 0.0])
    place, _ = tip_frame(arm, np.array([0.3, -0.4, 0, 0]))
    np.testing.assert_allclose(posture_in_pose(arm, place, [0.0, -0.4, 0.3], [0.2, -0.3]),
                               [0.3, -0.4], atol=1e-8)
    with pytest.raises(UnreachableError, match='with that orientation'):
        posture_in_pose(arm, place, turn_rpy(0.0, 0.4, 0.3))


def test_planar_arm_has_no_orientation_to_choose() -> None:
    with pytest.raises(InvalidValueError, match='goal_orientation'):
        posture_in_pose(load_arm('korayem_rigid'), [0.5, 0.0, 0.0], [0.0, 0.0, 0.0])
