"""Frames of links: where the joints of a URDF file put them, bent with the arm; their names."""

from __future__ import annotations

from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.frames import link_frames, name_frames, name_joints
from flex_planner.arms.kinematics import link_points, tip_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.urdf import parse_urdf
from flex_planner.base.errors import InvalidSizeError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from spatial_arms import yaw_pitch

FOLDER = Path(__file__).parents[2] / 'examples' / 'urdf'
ANGLES = {'yaw': 0.4, 'shoulder': -0.7, 'elbow': 1.1}


@pytest.fixture(scope='module')
def tubes() -> Arm:
    return load_arm(FOLDER / 'two_tubes.yaml')


def test_unbent_frames_are_those_of_the_joints_of_the_file(tubes: Arm) -> None:
    urdf = parse_urdf((FOLDER / 'two_tubes.urdf').read_text())
    place, axes, expected = np.zeros(3), np.eye(3), []
    for joint in urdf.joints:  # one after the other, from the base to the tip
        place = place + axes @ joint.position
        axes = axes @ np.array(joint.rotation) @ Rotation.from_rotvec(
            ANGLES.get(joint.name, 0.0) * np.array(joint.axis)).as_matrix()
        expected.append((joint.child, place, axes))
    unbent = np.zeros(tubes.n_coordinates)
    unbent[:3] = list(ANGLES.values())
    frames = dict(zip(name_frames(tubes)[1:], zip(*link_frames(tubes, unbent), strict=True),
                      strict=True))
    for name, place, axes in expected:
        if name in frames:
            np.testing.assert_allclose(frames[name][0], place, atol=1e-14)
            np.testing.assert_allclose(frames[name][1], axes, atol=1e-14)
    assert set(frames) <= {name for name, _, _ in expected}


@pytest.mark.parametrize('name', ['spatial_3r', 'korayem_ei50'])
def test_bent_frames_are_where_bent_links_begin_and_the_tip_is(name: str) -> None:
    arm = load_arm(name)
    bent = np.random.default_rng(1).normal(0.0, 0.2, arm.n_coordinates)
    places, axes = link_frames(arm, bent)
    first = link_points(arm, bent)[:, 0]
    np.testing.assert_allclose(places[1:-1, :arm.dimension], first[1:], atol=1e-14)
    np.testing.assert_allclose(places[-1, :arm.dimension], tip_position(arm, bent), atol=1e-14)
    np.testing.assert_allclose(axes @ np.swapaxes(axes, 1, 2),
                               np.broadcast_to(np.eye(3), axes.shape), atol=1e-14)


def test_names_are_those_of_the_file_or_counted(tubes: Arm) -> None:
    assert name_joints(tubes) == ('yaw', 'shoulder', 'elbow')
    assert name_frames(tubes) == ('base', 'column', 'upper_arm', 'forearm', 'gripper')
    arm = yaw_pitch()
    assert name_joints(arm) == ('joint1', 'joint2')
    assert name_frames(arm, 'floor') == ('floor', 'link1', 'link2', 'tip')
    with pytest.raises(InvalidSizeError, match='joint_names has 1 name, but must be 2, or none'):
        SpatialArm(name='two', links=arm.links, joints=arm.joints, joint_names=('one',))
