"""
Where the arm is: positions of joints and tip, inverse kinematics, condition (I) of the paper.

Written with array operations and apart from :mod:`flex_planner.dynamics`, so that each can
check the other.

"""

from __future__ import annotations

from flex_planner.arm import Arm
from flex_planner.errors import (
    InvalidTaskError,
    InvalidValueError,
    SingularError,
    UnreachableError,
)
from flex_planner.validation import Array
import numpy as np
from numpy.typing import ArrayLike

# relative to reach^2: nearer to a stretched or folded arm a small step needs huge joint motion
_SINGULAR = 1e-3


def frame_angles(arm: Arm, coordinates: Array) -> Array:
    """
    Return the angle of each link's frame to the x axis, shape (..., n) [rad].

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    coordinates : numpy.ndarray, shape (..., n_t)
        q.

    """
    turns = np.array(coordinates[..., :arm.n_joints])
    for i, (link, modal) in enumerate(zip(arm.links[:-1], arm.modal_slices, strict=False)):
        turns[..., i + 1] += coordinates[..., modal] @ link.mode_shapes().tip_slope
    angles: Array = np.cumsum(turns, axis=-1)
    return angles


def link_points(arm: Arm, coordinates: Array, stations: int = 2) -> Array:
    """
    Return points along the bent links, from base to tip.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    coordinates : numpy.ndarray, shape (..., n_t)
        q.
    stations : int
        Points a link, at least 2: both ends are included.

    Returns
    -------
    numpy.ndarray, shape (..., n, stations, 2)
        In the base frame [m]; a link ends where the next begins.

    """
    angles = frame_angles(arm, coordinates)
    base = np.zeros((*coordinates.shape[:-1], 2))
    points = []
    for i, (link, modal) in enumerate(zip(arm.links, arm.modal_slices, strict=True)):
        x = np.linspace(0, link.length, stations, dtype=np.float64)
        shapes = link.mode_shapes()
        bend = coordinates[..., modal] @ shapes.shape(x).T  # (..., stations)
        c, s = np.cos(angles[..., i, None]), np.sin(angles[..., i, None])
        points.append(base[..., None, :] + np.stack([c * x - s * bend, s * x + c * bend], -1))
        tip_bend = coordinates[..., modal] @ shapes.tip_deflection
        c, s = c[..., 0], s[..., 0]
        base = base + np.stack([c * link.length - s * tip_bend,
                                s * link.length + c * tip_bend], -1)
    return np.stack(points, axis=-3)


def tip_position(arm: Arm, coordinates: Array) -> Array:
    """Return the position of the tip, shape (..., 2) [m], eq. (18)."""
    position: Array = link_points(arm, coordinates)[..., -1, -1, :]
    return position


def jacobian(arm: Arm, positions: Array) -> Array:
    """
    Return the Jacobian of the tip of the unbent arm, shape (2, n) [m/rad].

    Parameters
    ----------
    arm : Arm
        n joints.
    positions : numpy.ndarray, shape (n,)
        Joint angles [rad].

    """
    angles = np.cumsum(positions)
    lengths = np.array([link.length for link in arm.links])
    parts = lengths * np.stack([-np.sin(angles), np.cos(angles)])  # (2, n)
    return np.cumsum(parts[:, ::-1], axis=1)[:, ::-1]


def check_singularity(arm: Arm, positions: Array) -> None:
    """
    Apply the second half of condition (I): the Jacobian must not lose rank.

    An arm with one joint moves its tip along a circle only and is never refused.

    Raises
    ------
    SingularError
        With the reason in words.

    """
    if arm.n_joints < 2:
        return
    J = jacobian(arm, np.asarray(positions, dtype=float))
    # for two joints this is |det J|
    measure = float(np.sqrt(max(np.linalg.det(J @ J.T), 0.0)))
    if measure < _SINGULAR * arm.reach**2:
        degrees = ', '.join(f'{np.degrees(angle):.2f}' for angle in positions)
        raise SingularError(
            f'the arm is stretched out or folded at joint angles ({degrees}) deg: '
            f'sqrt(det(J J^T)) = {measure:.3g} m^2 is below {_SINGULAR * arm.reach**2:.3g} m^2, '
            'so its tip cannot move in every direction')


def inverse_kinematics(arm: Arm, point: ArrayLike, elbow: int) -> Array:
    """
    Return the joint angles of a two-link arm that put its unbent tip at a point.

    Parameters
    ----------
    arm : Arm
        Two links.
    point : array_like, shape (2,)
        In the base frame [m].
    elbow : int
        Sign of the second joint angle, +1 or -1.

    Returns
    -------
    numpy.ndarray, shape (2,)
        [rad].

    Raises
    ------
    UnreachableError
        If the point is out of the workspace.
    SingularError
        If the arm is stretched out or folded there.
    InvalidTaskError
        If the arm has not two links.
    InvalidValueError
        If `elbow` is not +1 or -1.

    """
    if arm.n_joints != 2:
        raise InvalidTaskError(f'the arm has {arm.n_joints} links; points of the tip determine '
                               'the joint angles of two links only: give joint angles instead')
    if elbow not in (-1, 1):
        raise InvalidValueError('elbow', elbow, '+1 or -1')
    x, y = np.asarray(point, dtype=float)
    L_1, L_2 = (link.length for link in arm.links)
    cosine = (x**2 + y**2 - L_1**2 - L_2**2) / (2 * L_1 * L_2)
    slack = 1e-12
    if not abs(cosine) <= 1 + slack:
        raise UnreachableError(
            f'the point ({x:.6g}, {y:.6g}) m is {np.hypot(x, y):.6g} m from the base; the arm '
            f'reaches from {abs(L_1 - L_2):.6g} m to {L_1 + L_2:.6g} m')
    theta_2 = elbow * np.arccos(np.clip(cosine, -1, 1))
    theta_1 = np.arctan2(y, x) - np.arctan2(L_2 * np.sin(theta_2), L_1 + L_2 * np.cos(theta_2))
    positions = np.array([np.remainder(theta_1 + np.pi, 2 * np.pi) - np.pi, theta_2])
    check_singularity(arm, positions)
    return positions
