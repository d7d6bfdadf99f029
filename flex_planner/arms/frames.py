"""
Frames that an arm carries, and the names of frames and joints.

The frame of a link is that of its joint, moved by it: as a URDF file has it for a spatial arm,
with x along the link for a planar one, whose plane is that of x and y.

"""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import frame_angles, link_points
from flex_planner.arms.mechanism_of_arm import mechanism_of
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_kinematics import tip_frame, turn_about, walk_links
from flex_planner.base.validation import Array
import numpy as np

_Z = 2


def name_joints(arm: Arm) -> tuple[str, ...]:
    """Return the names of the joints: those of its URDF file, or ``joint1`` and so on."""
    own = arm.joint_names if isinstance(arm, SpatialArm) else ()
    return own or tuple(f'joint{i}' for i in range(1, arm.n_joints + 1))


def name_frames(arm: Arm, base: str = 'base_link') -> tuple[str, ...]:
    """
    Return the names of the frames of base, links and tip: those of its URDF file, if it has one.

    Parameters
    ----------
    arm : Arm
        n joints.
    base : str
        Name of the base where no file has named it; then follow ``link1`` and so on, and ``tip``.

    Returns
    -------
    tuple of str
        n + 2 names.

    """
    own = arm.frame_names if isinstance(arm, SpatialArm) else ()
    return own or (base, *(f'link{i}' for i in range(1, arm.n_joints + 1)), 'tip')


def link_frames(arm: Arm, coordinates: Array) -> tuple[Array, Array]:
    """
    Return where the frames of the links and of the tip are, as the arm is bent.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    coordinates : numpy.ndarray, shape (n_t,)
        q.

    Returns
    -------
    positions : numpy.ndarray, shape (n + 1, 3)
        In the frame of the base [m].
    axes : numpy.ndarray, shape (n + 1, 3, 3)
        Columns are axes of the frames.

    """
    if not isinstance(arm, SpatialArm):
        return _planar_frames(arm, coordinates)
    mechanism, positions, rotations = mechanism_of(arm), [], []
    rest = walk_links(mechanism, np.zeros(arm.n_coordinates))
    own = np.eye(3)  # of the link where all joints are at 0, in the frame of the base
    for joint, unmoved, frames in zip(arm.joints, rest, walk_links(mechanism, coordinates),
                                      strict=True):
        own = own @ np.array(joint.rotation)
        positions.append(frames.position)
        rotations.append(frames.rotation @ unmoved.rotation.T @ own)
    place, axes = tip_frame(arm, coordinates)
    return np.array([*positions, place]), np.array([*rotations, axes])


def _planar_frames(arm: Arm, coordinates: Array) -> tuple[Array, Array]:
    """Return the frames of a planar arm."""
    angles, points = frame_angles(arm, coordinates), link_points(arm, coordinates)
    slope = coordinates[arm.modal_slices[-1]] @ arm.links[-1].mode_shapes().tip_slope
    places = np.vstack([points[:, 0], points[-1:, -1]])
    return (np.hstack([places, np.zeros((len(places), 1))]),
            turn_about(_Z, np.append(angles, angles[-1] + slope)))
