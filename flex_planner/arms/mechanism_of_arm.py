"""
Arms as mechanisms: planar ones by their own rules, spatial ones here.

Of a link in space only what turns it matters, not how its axes are named: frames of the mechanism
are chosen so that joints turn about axes of the frame before wherever they can, and beams lie
along x, so that as little as possible has to be rotated.

"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from flex_planner.arms.arm import Arm
from flex_planner.arms.mechanism import (
    FlexibleBody,
    Mechanism,
    MechanismLink,
    RigidBody,
    X,
    Y,
    Z,
)
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_body import clean
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.base.validation import Array
import numpy as np

# of the sine of the angle between an axis and one of the frame
_ALIGNED = 1e-12


def mechanism_of(arm: Arm) -> Mechanism:
    """Return an arm as bodies and joints; that of a spatial arm is kept."""
    return _of_spatial(arm) if isinstance(arm, SpatialArm) else Mechanism.of(arm)


@lru_cache(maxsize=64)
def _of_spatial(arm: SpatialArm) -> Mechanism:
    """Return a spatial arm."""
    links, axes = [], np.eye(3)  # of the link before, in the frame before
    for i, joint in enumerate(arm.joints):
        made, axes = _link(arm, i, joint, axes)
        links.append(made)
    tip = clean(axes @ np.array(arm.tip_rotation))
    return Mechanism(
        links=links, friction=np.array([joint.viscous_friction for joint in arm.joints]),
        gravity=arm.gravity, payload_com=clean(tip @ arm.payload_com), tip_rotation=tip,
        payload_axes=(X, Y, Z),
        coulomb=tuple(i for i, joint in enumerate(arm.joints) if joint.coulomb_friction))


def _link(arm: SpatialArm, index: int, joint: SpatialJoint,
          axes: Array) -> tuple[MechanismLink, Array]:
    """Return a link, and the axes of its nominal frame in that of its tip."""
    link, lies = arm.links[index], clean(axes @ np.array(joint.rotation))
    before, axis, sign = _align(clean(lies @ np.array(joint.axis)))
    axes = clean(before.T @ lies)  # of the link in the frame of its joint
    turned = np.eye(3)
    if link.modes:
        beam_axes = link.axes()
        turned, axes = clean(axes @ beam_axes), beam_axes.T
    beam = _beam(arm, index, axes)
    made = MechanismLink(
        base=_base(arm, index, axes), beam=beam, end=_end(arm, index, axes),
        position=np.array(arm.base) if index == 0 else np.zeros(3), rotation=before, axis=axis,
        sign=sign, slides=joint.slides, turned=turned,
        tip_order=_tip_order(arm, index, axes), rotor=joint.motor.reflected_inertia,
        elasticity=joint.elasticity)
    return made, axes


def _align(direction: Array) -> tuple[Array, int, float]:
    """Return a rotation, an axis of the rotated frame and a sign that make a direction."""
    axis = int(np.abs(direction).argmax())
    sign = float(np.sign(direction[axis]))
    if np.linalg.norm(np.delete(direction, axis)) < _ALIGNED:
        return np.eye(3), axis, sign
    helper = np.eye(3)[int(np.abs(direction).argmin())]
    across = np.cross(helper, direction)
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(direction, across), direction]), Z, 1.0


def _beam(arm: SpatialArm, index: int, axes: Array) -> FlexibleBody:
    """Return what lies between a joint and the end of its link: what bends, or a way alone."""
    link = arm.links[index]
    if link.modes:
        return link.flexible_body()
    none, empty = np.zeros((3, 0)), np.zeros((0, 0))
    return FlexibleBody(
        mass=0.0, first_moment=np.zeros(3), inertia=np.zeros((3, 3)), displacement=none,
        inertia_slope=np.zeros((0, 3, 3)), inertia_bend=np.zeros((0, 0, 3, 3)), moment=none,
        cross_moment=np.zeros((0, 0, 3)), gram=empty, stiffness=empty, damping=np.zeros(0),
        tip=clean(axes @ np.array(link.end)), tip_displacement=none, tip_turn=none)


def _base(arm: SpatialArm, index: int, axes: Array) -> RigidBody:
    """Return what is fixed to the frame of a link, a beam without modes included."""
    link = arm.links[index]
    body = link.body.about(np.zeros(3), axes)
    if link.beam is None or link.modes:
        return body
    rod, turn = link.beam.flexible_body(link.length), axes @ link.axes()
    return RigidBody(mass=body.mass + rod.mass,
                     first_moment=body.first_moment + turn @ rod.first_moment,
                     inertia=clean(body.inertia + turn @ rod.inertia @ turn.T))


def _end(arm: SpatialArm, index: int, axes: Array) -> RigidBody:
    """Return what is fixed to the end of a link, the payload's tensor included."""
    body = arm.links[index].tip_body.about(np.zeros(3), axes)
    if index < arm.n_joints - 1 or not np.any(arm.payload_tensor):
        return body
    tip = axes @ np.array(arm.tip_rotation)
    carried = tip @ np.array(arm.payload_tensor) @ tip.T
    return replace(body, inertia=clean(body.inertia + (carried + carried.T) / 2))


def _tip_order(arm: SpatialArm, index: int, axes: Array) -> tuple[int, ...]:
    """
    Return in which order a bent tip turns about its axes.

    Last about that of the next joint, if it is one of them: both turns are then one. The order
    matters to second order in the slopes only, where beams of the model end.

    """
    joint = arm.joints[min(index + 1, arm.n_joints - 1)]
    own = np.eye(3) if index == arm.n_joints - 1 else np.array(joint.rotation)
    _, last, _ = _align(clean(axes @ own @ np.array(joint.axis)))
    return (*(i for i in (X, Z, Y) if i != last), last)
