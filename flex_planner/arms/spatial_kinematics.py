"""
Where a spatial arm is and how it moves: frames, bent links, tip, Jacobians.

By rotation matrices in the axes of the base, apart from the recursion of
:mod:`flex_planner.dynamics.build_chain`, so that each can check the other.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flex_planner.arms.mechanism import Mechanism, MechanismLink
from flex_planner.arms.mechanism_of_arm import mechanism_of
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.validation import Array
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkFrames:
    """
    The frames of a link in the axes of the base.

    Attributes
    ----------
    link : MechanismLink
        Joint, bodies and shapes.
    modal : numpy.ndarray, shape (..., m)
        Modal displacements.
    joint_position : numpy.ndarray, shape (..., 3)
        Where the joint is, before it slides [m].
    axis : numpy.ndarray, shape (..., 3)
        About which the link turns, or along which it slides.
    position, rotation : numpy.ndarray, shapes (..., 3) and (..., 3, 3)
        Of the link's frame; columns of the rotation are axes.
    tip_position, tip_rotation : numpy.ndarray, shapes (..., 3) and (..., 3, 3)
        Of the frame at its end, as it is bent.
    turns : list of (int, numpy.ndarray)
        Axes of the end's elementary turns, each with its direction (..., 3).

    """

    link: MechanismLink
    modal: Array
    joint_position: Array
    axis: Array
    position: Array
    rotation: Array
    tip_position: Array
    tip_rotation: Array
    turns: list[tuple[int, Array]]


def walk_links(mechanism: Mechanism, coordinates: Array) -> Iterator[LinkFrames]:
    """Yield the frames of each link at q (..., n_t), from the base to the tip."""
    n, elastic = len(mechanism.links), mechanism.elastic
    at = n + len(elastic)
    shape = coordinates.shape[:-1]
    place, axes = np.zeros((*shape, 3)), np.broadcast_to(np.eye(3), (*shape, 3, 3))
    for i, link in enumerate(mechanism.links):
        place, axes = place + axes @ link.position, axes @ link.rotation
        moved = coordinates[..., i]
        if i in elastic:
            moved = moved + coordinates[..., n + elastic.index(i)]
        joint, axis = place, link.sign * axes[..., link.axis]
        if link.slides:
            place = place + moved[..., None] * axis
        else:
            axes = axes @ turn_about(link.axis, link.sign * moved)
        axes = axes @ link.turned
        modal = coordinates[..., at:at + link.beam.count]
        at += link.beam.count
        tip = place + _apply(axes, _tip(link, modal))
        end, turns = axes, []
        for k in link.tip_order:
            turns.append((k, end[..., k]))
            if link.beam.tip_turn[k].any():
                end = end @ turn_about(k, modal @ link.beam.tip_turn[k])
        yield LinkFrames(link=link, modal=modal, joint_position=joint, axis=axis, position=place,
                         rotation=axes, tip_position=tip, tip_rotation=end, turns=turns)
        place, axes = tip, end


def turn_about(axis: int, angle: Array) -> Array:
    """Return the rotations by angles (...) about an axis of the frame, shape (..., 3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.zeros((*np.shape(angle), 3, 3))
    i, k = (axis + 1) % 3, (axis + 2) % 3
    turn[..., axis, axis] = 1.0
    turn[..., i, i] = turn[..., k, k] = c
    turn[..., k, i], turn[..., i, k] = s, -s
    return turn


def spatial_link_points(arm: SpatialArm, coordinates: Array, stations: int) -> Array:
    """
    Return points along the bent links, shape (..., n, stations, 3), see `link_points`.

    A rigid link is the straight line between its ends; that of a sliding one begins at its joint.

    """
    points = []
    for i, frames in enumerate(walk_links(mechanism_of(arm), coordinates)):
        share = np.linspace(0.0, 1.0, stations)[:, None]
        link = arm.links[i]
        if not link.modes:
            start, end = frames.joint_position[..., None, :], frames.tip_position[..., None, :]
            points.append(start + share * (end - start))
            continue
        # of the mechanism, in which beams lie along x
        beam = link.axes().T
        local = share * frames.link.beam.tip + link.displace(frames.modal, stations) @ beam.T
        local[..., -1, :] = _tip(frames.link, frames.modal)
        points.append(frames.position[..., None, :]
                      + local @ np.swapaxes(frames.rotation, -1, -2))
    return np.stack(points, axis=-3)


def tip_frame(arm: SpatialArm, coordinates: Array) -> tuple[Array, Array]:
    """Return position (..., 3) [m] and axes (..., 3, 3) of the tip at q (..., n_t)."""
    mechanism = mechanism_of(arm)
    *_, last = walk_links(mechanism, coordinates)
    return last.tip_position, last.tip_rotation @ mechanism.tip_rotation


def tip_moves(arm: SpatialArm, coordinates: Array) -> Array:
    """
    Return how coordinates move the tip: its velocity and its turning for unit rates.

    Parameters
    ----------
    arm : SpatialArm
        n_t coordinates.
    coordinates : numpy.ndarray, shape (..., n_t)
        q.

    Returns
    -------
    numpy.ndarray, shape (..., 6, n_t)
        The first three rows are the velocity, the others the turning, in the axes of the base.

    """
    mechanism = mechanism_of(arm)
    walked = list(walk_links(mechanism, coordinates))
    tip = walked[-1].tip_position
    n, elastic = len(mechanism.links), mechanism.elastic
    moves = np.zeros((*coordinates.shape[:-1], 6, coordinates.shape[-1]))
    at = n + len(elastic)
    for i, frames in enumerate(walked):
        column = _screw(frames, tip)
        moves[..., i] = column
        if i in elastic:
            moves[..., n + elastic.index(i)] = column
        count = frames.link.beam.count
        moves[..., at:at + count] = _bending_moves(frames, tip)
        at += count
    return moves


def _screw(frames: LinkFrames, tip: Array) -> Array:
    """Return velocity and turning of the tip for a unit rate of a joint, shape (..., 6)."""
    if frames.link.slides:
        return np.concatenate([frames.axis, np.zeros_like(frames.axis)], axis=-1)
    lever = tip - frames.joint_position
    return np.concatenate([np.cross(frames.axis, lever), frames.axis], axis=-1)


def _bending_moves(frames: LinkFrames, tip: Array) -> Array:
    """Return velocity and turning of the tip for unit rates of a link's modes, (..., 6, m)."""
    body, q = frames.link.beam, frames.modal
    shift = body.tip_displacement + np.einsum('ajk,...k->...aj', body.tip_shortening, q) if (
        body.tip_shortening.size) else body.tip_displacement
    velocity = frames.rotation @ shift
    turning = np.zeros_like(velocity)
    for k, direction in frames.turns:
        turning = turning + direction[..., None] * body.tip_turn[k]
    lever = (tip - frames.tip_position)[..., None]
    velocity = velocity + np.cross(turning, lever, axis=-2)
    return np.concatenate([velocity, turning], axis=-2)


def _tip(link: MechanismLink, modal: Array) -> Array:
    """Return where the end of a link is in its frame, shape (..., 3) [m]."""
    body = link.beam
    place: Array = body.tip + modal @ body.tip_displacement.T
    if body.tip_shortening.any():
        place = place + np.einsum('ajk,...j,...k->...a', body.tip_shortening, modal, modal) / 2
    return place


def _apply(axes: Array, vectors: Array) -> Array:
    """Return vectors (..., 3) of frames in the axes of the base."""
    turned: Array = (axes @ vectors[..., None])[..., 0]
    return turned
