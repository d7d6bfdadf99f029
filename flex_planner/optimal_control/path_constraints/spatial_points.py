"""Points of a spatial arm's bent links as CasADi expressions, see `spatial_link_points`."""

from __future__ import annotations

from typing import Any

import casadi as ca
from flex_planner.arms.mechanism import MechanismLink
from flex_planner.arms.mechanism_of_arm import mechanism_of
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.validation import Array
import numpy as np


def express_point(arm: SpatialArm, coordinates: Any, link: int, share: float) -> Any:
    """
    Return the position of a point of a bent link.

    Parameters
    ----------
    arm : SpatialArm
        n_t coordinates.
    coordinates : casadi.SX, shape (n_t, 1)
        q.
    link : int
        From 0.
    share : float
        Of its length, 0 to 1; a rigid link is the straight line between its ends, that of a
        sliding one begins at its joint.

    Returns
    -------
    casadi.SX, shape (3, 1)
        In the frame of the base [m].

    """
    mechanism, slices = mechanism_of(arm), arm.modal_slices
    elastic, n = mechanism.elastic, arm.n_joints
    place, axes = ca.SX.zeros(3), ca.SX(_sparse(np.eye(3)))
    for i, part in enumerate(mechanism.links[:link + 1]):
        place, axes = place + axes @ ca.DM(part.position), axes @ _sparse(part.rotation)
        moved = coordinates[i]
        if i in elastic:
            moved = moved + coordinates[n + elastic.index(i)]
        joint = place
        if part.slides:
            place = place + part.sign * moved * axes[:, part.axis]
        else:
            axes = axes @ _turn(part.axis, part.sign * moved)
        axes, modal = axes @ _sparse(part.turned), coordinates[slices[i]]
        end = place + axes @ _end(part, modal)
        if i == link:
            return _along(arm.links[link], share, (joint, place, end), axes, modal, part.beam.tip)
        place = end
        for k in part.tip_order:
            if part.beam.tip_turn[k].any():
                axes = axes @ _turn(k, ca.dot(ca.DM(part.beam.tip_turn[k]), modal))
    raise IndexError(link)


def _along(body: SpatialLink, share: float, places: tuple[Any, Any, Any], axes: Any, modal: Any,
           rest: Array) -> Any:
    """Return a point between the joint of a link, where it may have slid to, and its end."""
    joint, place, end = places
    if share == 1:
        return end
    if not body.modes:
        return joint + share * (end - joint)
    local = ca.DM(share * rest) + _sparse(body.shapes(np.array([share]))[0]) @ modal
    return place + axes @ local


def _end(part: MechanismLink, modal: Any) -> Any:
    """Return where the end of a link is in its frame."""
    body = part.beam
    place = ca.DM(body.tip) + _sparse(body.tip_displacement) @ modal
    if body.tip_shortening.any():
        place += ca.vertcat(*(ca.bilin(_sparse(rows), modal, modal) / 2
                              for rows in body.tip_shortening))
    return place


def _turn(axis: int, angle: Any) -> Any:
    """Return the rotation by an angle about an axis of a frame."""
    turn = ca.SX(3, 3)
    i, k = (axis + 1) % 3, (axis + 2) % 3
    turn[axis, axis] = 1
    turn[i, i] = turn[k, k] = ca.cos(angle)
    turn[k, i], turn[i, k] = ca.sin(angle), -ca.sin(angle)
    return turn


def _sparse(matrix: Array) -> Any:
    """Return a matrix without its zeros."""
    return ca.sparsify(ca.DM(matrix))
