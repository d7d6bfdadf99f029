"""Inverse kinematics in space: points, poses, limits, redundant arms."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.inverse_kinematics import check_singularity, inverse_kinematics
from flex_planner.arms.kinematics import tip_position
from flex_planner.arms.spatial_inverse_kinematics import (
    spatial_inverse_kinematics,
    spatial_posture_near_point,
)
from flex_planner.arms.spatial_kinematics import tip_frame
from flex_planner.base.errors import InvalidValueError, SingularError, UnreachableError
import numpy as np
import pytest
from spatial_arms import flexible_3r, oblique, panda, tudor, ur5, yaw_pitch

POSTURE = np.array([0.4, -1.2, 1.3, -0.9, -1.1, 0.6])


def test_pose_is_reached() -> None:
    arm = ur5()
    place, axes = tip_frame(arm, POSTURE)
    found = spatial_inverse_kinematics(arm, place, POSTURE + 0.3, orientation=axes)
    there, turned = tip_frame(arm, found)
    np.testing.assert_allclose(there, place, atol=1e-8)
    np.testing.assert_allclose(turned, axes, atol=1e-8)


def test_pose_is_found_from_far() -> None:
    arm = ur5()
    place, axes = tip_frame(arm, POSTURE)
    found = spatial_inverse_kinematics(arm, place, orientation=axes)
    np.testing.assert_allclose(tip_frame(arm, found)[1], axes, atol=1e-8)


def test_redundant_arm_stays_near_a_posture() -> None:
    arm = panda()
    near = np.array([0.3, -0.5, 0.2, -2.0, 0.1, 1.6, 0.8])
    point = tip_position(arm, near) + [0.02, -0.03, 0.01]
    found = inverse_kinematics(arm, point, -1, near)
    np.testing.assert_allclose(tip_position(arm, found), point, atol=1e-8)
    assert np.abs(found - near).max() < 0.2


@pytest.mark.parametrize('limit', [np.inf, 4.0])
def test_no_joint_is_a_whole_turn_farther_away_than_it_must_be(limit: float) -> None:
    arm, rng = ur5(), np.random.default_rng(3)
    arm = replace(arm, joints=tuple(
        replace(joint, lower_limit=-limit, upper_limit=limit) for joint in arm.joints))
    for inside, near in rng.uniform(-2, 2, (8, 2, arm.n_joints)):
        place, axes = tip_frame(arm, inside)
        found = spatial_inverse_kinematics(arm, place, near, orientation=axes)
        np.testing.assert_allclose(tip_frame(arm, found)[1], axes, atol=1e-8)
        assert np.abs(found).max() <= limit
        for turned in (found - 2 * np.pi, found + 2 * np.pi):
            nearer = (np.abs(turned) <= limit) & (np.abs(turned - near) < np.abs(found - near))
            assert not nearer.any(), (found, near)


def test_limits_are_kept() -> None:
    arm = oblique()
    limited = replace(arm, joints=tuple(
        replace(joint, lower_limit=-0.2 if joint.slides else -1.0,
                upper_limit=0.2 if joint.slides else 1.0) for joint in arm.joints))
    inside = np.array([0.5, -0.8, 0.1, 0.9, -0.15, 0.3])
    point = tip_position(arm, inside)
    found = spatial_inverse_kinematics(limited, point)
    np.testing.assert_allclose(tip_position(arm, found), point, atol=1e-8)
    lower, upper = limited.angle_limits()
    assert ((lower <= found) & (found <= upper)).all()


def test_points_out_of_reach_are_refused() -> None:
    with pytest.raises(UnreachableError, match='the arm reaches at most 1.23958 m'):
        spatial_inverse_kinematics(ur5(), [3.0, 0, 0])
    with pytest.raises(UnreachableError, match=r'puts the tip at \(0, 0, -0.95\) m: .* from it'):
        spatial_inverse_kinematics(tudor(), [0, 0, -0.95])


def test_sagging_arm_may_start_from_a_posture_close_to_its_point() -> None:
    arm = tudor()
    point = [0.86, 0.0, 0.1]  # a little out of the reach of the unbent arm
    with pytest.raises(UnreachableError):
        spatial_inverse_kinematics(arm, point)
    near = spatial_posture_near_point(arm, point)
    unbent = np.concatenate([near, np.zeros(arm.n_passive)])
    assert np.linalg.norm(tip_position(arm, unbent) - point) < 0.05 * arm.reach


def test_stretched_arm_is_singular() -> None:
    arm = flexible_3r()
    with pytest.raises(SingularError, match='cannot move in every direction'):
        check_singularity(arm, [0.3, 0.4, 0.0])
    check_singularity(arm, [0.3, 0.4, 0.5])


def test_arm_that_moves_on_a_surface_is_not_singular_everywhere() -> None:
    check_singularity(yaw_pitch(), [0.3, 0.4])
    with pytest.raises(SingularError):  # upright: the yaw no longer moves the tip
        check_singularity(replace(yaw_pitch(), links=(
            replace(yaw_pitch().links[0], end=(0, 0, 0.3)), yaw_pitch().links[1])),
            [0.3, -np.pi / 2])


def test_orientation_must_be_a_rotation() -> None:
    with pytest.raises(InvalidValueError, match='orientation is .* must be a rotation'):
        spatial_inverse_kinematics(ur5(), [0.3, 0.3, 0.3], orientation=np.ones((3, 3)))
