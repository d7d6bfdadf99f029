"""Frames on /tf: together they lead where the arm is bent to."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.frames import link_frames, name_frames
from flex_planner.ros.messages.frames import frame_transforms
from geometry_msgs.msg import TransformStamped
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def moved(place: np.ndarray, turn: Rotation,
          message: TransformStamped) -> tuple[np.ndarray, Rotation]:
    """Return a frame that a transform carries on."""
    shift, own = message.transform.translation, message.transform.rotation
    quaternion = [own.x, own.y, own.z, own.w]
    assert np.linalg.norm(quaternion) == pytest.approx(1)
    return place + turn.apply([shift.x, shift.y, shift.z]), turn * Rotation.from_quat(quaternion)


@pytest.mark.parametrize('name', ['tudor_like', 'korayem_ei50'])
@pytest.mark.parametrize('scale', [0.0, 0.1, np.pi])  # at rest, bent, and half turns
def test_transforms_lead_from_the_base_to_each_frame(name: str, scale: float) -> None:
    arm = load_arm(name)
    coordinates = np.zeros(arm.n_coordinates)
    coordinates[arm.n_joints:] = scale / 10
    coordinates[:arm.n_joints] = scale
    names = name_frames(arm)
    place, turn = np.zeros(3), Rotation.identity()
    messages = frame_transforms(arm, coordinates, names, Time(sec=7))
    for message, *frame in zip(messages, *link_frames(arm, coordinates), strict=True):
        place, turn = moved(place, turn, message)
        np.testing.assert_allclose(place, frame[0], atol=1e-14)
        np.testing.assert_allclose(turn.as_matrix(), frame[1], atol=1e-14)
        assert message.header.stamp.sec == 7
    assert [message.header.frame_id for message in messages] == list(names[:-1])
    assert [message.child_frame_id for message in messages] == list(names[1:])
