"""
Position and velocity of the arm: frames, bent links, tip.

Points of planar arms have two coordinates, those of spatial ones three. Written with array
operations and apart from :mod:`flex_planner.dynamics.build_chain`, so that each can check the
other.

"""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Link
from flex_planner.arms.planar_only import require_planar
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_joint import slides
from flex_planner.arms.spatial_kinematics import spatial_link_points, tip_frame, tip_moves
from flex_planner.base.validation import Array
import numpy as np

_STATIONS = 41


def frame_angles(arm: Arm, coordinates: Array) -> Array:
    """
    Return the angle of each link's frame to the x axis, shape (..., n) [rad].

    Parameters
    ----------
    arm : Arm
        A planar one of n joints, n_t coordinates.
    coordinates : numpy.ndarray, shape (..., n_t)
        q.

    Raises
    ------
    PlanarOnlyError
        If the arm is a spatial one.

    """
    require_planar(arm, 'angles in the plane')
    n, turning = arm.n_joints, list(arm.elastic_joints)
    turns = np.array(coordinates[..., :n])
    turns[..., turning] += coordinates[..., n:n + len(turning)]
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
        Points per link, at least 2: both ends are included.

    Returns
    -------
    numpy.ndarray, shape (..., n, stations, 2 or 3)
        In the base frame [m]; a link ends where the next begins.

    """
    if isinstance(arm, SpatialArm):
        return spatial_link_points(arm, coordinates, stations)
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


def link_deflections(arm: Arm, index: int, vectors: Array) -> Array:
    """
    Return the deflections of a link's stations for modal displacements, shape (41, m) [m].

    Parameters
    ----------
    arm : Arm
        n_f coordinates without a motor.
    index : int
        Of the link, from 0.
    vectors : numpy.ndarray, shape (n_f, m)
        Columns are displacements of those coordinates.

    Returns
    -------
    numpy.ndarray, shape (41, m)
        Distances, without a sign, of a spatial arm.

    """
    if isinstance(arm, SpatialArm):
        part = arm.modal_slices[index]
        modal = vectors[part.start - arm.n_joints:part.stop - arm.n_joints].T
        distances: Array = np.linalg.norm(arm.links[index].displace(modal, _STATIONS), axis=-1).T
        return distances
    link, part, n = arm.links[index], arm.modal_slices[index], arm.n_joints
    deflections: Array = _shape_at(link, _STATIONS) @ vectors[part.start - n:part.stop - n]
    return deflections


def link_bends(arm: Arm, index: int, modal: Array, stations: int = _STATIONS) -> Array:
    """
    Return the deflections of a link's stations, with their signs.

    Parameters
    ----------
    arm : Arm
        Its links twist without moving their points.
    index : int
        Of the link, from 0.
    modal : numpy.ndarray, shape (modes, k)
        Columns are displacements of its modes.
    stations : int
        Evenly spaced points, both ends included.

    Returns
    -------
    numpy.ndarray, shape (stations, 1 or 2, k)
        In the plane, or across the link in two planes [m].

    """
    link = arm.links[index]
    if isinstance(arm, SpatialArm):
        shapes = arm.links[index].bend_shapes(np.linspace(0, 1, stations, dtype=np.float64))
    else:
        shapes = _shape_at(link, stations)[:, None]
    bends: Array = shapes @ modal
    return bends


def twist_levers(arm: Arm) -> Array:
    """
    Return by how much a unit of each elastic joint's twist moves the stretched arm's tip at most.

    Returns
    -------
    numpy.ndarray, shape (n_elastic,)
        Lengths of the links beyond it; 1 of a joint that slides [m/rad], [m/m].

    """
    beyond = np.cumsum([link.length for link in reversed(arm.links)])[::-1]
    elastic = list(arm.elastic_joints)
    levers: Array = np.where([slides(arm.joints[i]) for i in elastic], 1.0, beyond[elastic])
    return levers


def bent_distances(arm: Arm, index: int, modal: Array, stations: int) -> Array:
    """
    Return how far points along a link are from where they would be unbent.

    Parameters
    ----------
    arm : Arm
        Its links twist without moving their points.
    index : int
        Of the link, from 0.
    modal : numpy.ndarray, shape (k, modes)
        Displacements of its modes.
    stations : int
        Evenly spaced points, both ends included.

    Returns
    -------
    numpy.ndarray, shape (k, stations)
        >= 0 [m].

    """
    link = arm.links[index]
    if isinstance(arm, SpatialArm):
        distances: Array = np.linalg.norm(arm.links[index].displace(modal, stations), axis=-1)
        return distances
    return np.abs(modal @ _shape_at(link, stations).T)


def _shape_at(link: Link, stations: int) -> Array:
    """Return the modes of a link of a planar arm at evenly spaced points, (stations, modes)."""
    places = np.linspace(0, link.length, stations, dtype=np.float64)
    return link.mode_shapes().shape(places)


def tip_position(arm: Arm, coordinates: Array) -> Array:
    """Return the position of the tip, shape (..., 2 or 3) [m], eq. (18)."""
    if isinstance(arm, SpatialArm):
        return tip_frame(arm, coordinates)[0]
    position: Array = link_points(arm, coordinates)[..., -1, -1, :]
    return position


def payload_position(arm: Arm, coordinates: Array) -> Array:
    """Return the position of the payload's centre of mass, shape (..., 2 or 3) [m]."""
    if isinstance(arm, SpatialArm):
        place, axes = tip_frame(arm, coordinates)
        return place + axes @ arm.payload_com
    tip = tip_position(arm, coordinates)
    if not arm.payload_com.any():
        return tip
    c, s, _ = _tip_frame(arm, coordinates)
    x, y = arm.payload_com
    position: Array = tip + np.stack([c * x - s * y, s * x + c * y], -1)
    return position


def payload_velocity(arm: Arm, coordinates: Array, rates: Array) -> Array:
    """Return the velocity of the payload's centre of mass, shape (..., 2 or 3) [m/s]."""
    if isinstance(arm, SpatialArm):
        moves = (tip_moves(arm, coordinates) @ rates[..., None])[..., 0]
        lever = tip_frame(arm, coordinates)[1] @ arm.payload_com
        return moves[..., :3] + np.cross(moves[..., 3:], lever)
    velocity = tip_velocity(arm, coordinates, rates)
    if not arm.payload_com.any():
        return velocity
    c, s, _ = _tip_frame(arm, coordinates)
    turning, (x, y) = _tip_frame(arm, rates)[2], arm.payload_com
    moved: Array = velocity + turning[..., None] * np.stack(
        [-s * x - c * y, c * x - s * y], -1)
    return moved


def _tip_frame(arm: Arm, coordinates: Array) -> tuple[Array, Array, Array]:
    """Return cosine, sine and angle of the frame that the bent tip carries."""
    slope = coordinates[..., arm.modal_slices[-1]] @ arm.links[-1].mode_shapes().tip_slope
    angle: Array = frame_angles(arm, coordinates)[..., -1] + slope
    return np.cos(angle), np.sin(angle), angle


def jacobian(arm: Arm, positions: Array) -> Array:
    """
    Return the Jacobian of the tip of the unbent arm, shape (2 or 3, n) [m/rad].

    Parameters
    ----------
    arm : Arm
        n joints.
    positions : numpy.ndarray, shape (n,)
        Joint angles [rad].

    """
    if isinstance(arm, SpatialArm):
        unbent = np.concatenate([positions, np.zeros(arm.n_passive)])
        return tip_moves(arm, unbent)[:3, :arm.n_joints]
    angles = np.cumsum(positions)
    lengths = np.array([link.length for link in arm.links])
    parts = lengths * np.stack([-np.sin(angles), np.cos(angles)])  # (2, n)
    return np.cumsum(parts[:, ::-1], axis=1)[:, ::-1]


def tip_jacobian(arm: Arm, coordinates: Array) -> Array:
    """Return the Jacobian of the bent arm's tip at q (n_t,), (2 or 3, n_t) [m/rad, m/m]."""
    if isinstance(arm, SpatialArm):
        return tip_moves(arm, coordinates)[:3]
    n_t = arm.n_coordinates
    return tip_velocity(arm, np.broadcast_to(coordinates, (n_t, n_t)), np.eye(n_t)).T


def tip_velocity(arm: Arm, coordinates: Array, rates: Array) -> Array:
    """
    Return the velocity of the tip of the bent arm, eq. (22).

    Parameters
    ----------
    arm : Arm
        n_t coordinates.
    coordinates, rates : numpy.ndarray, shape (..., n_t)
        q and q'.

    Returns
    -------
    numpy.ndarray, shape (..., 2 or 3)
        [m/s].

    """
    if isinstance(arm, SpatialArm):
        spatial: Array = (tip_moves(arm, coordinates)[..., :3, :] @ rates[..., None])[..., 0]
        return spatial
    angles, turning = frame_angles(arm, coordinates), frame_angles(arm, rates)
    velocity = np.zeros((*coordinates.shape[:-1], 2))
    for i, (link, modal) in enumerate(zip(arm.links, arm.modal_slices, strict=True)):
        deflection = link.mode_shapes().tip_deflection
        along = -turning[..., i] * (coordinates[..., modal] @ deflection)
        across = turning[..., i] * link.length + rates[..., modal] @ deflection
        c, s = np.cos(angles[..., i]), np.sin(angles[..., i])
        velocity += np.stack([c * along - s * across, s * along + c * across], -1)
    return velocity
