"""An arm as the text of an arm file, which `load_arm` reads back."""

from __future__ import annotations

import math
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Node
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.yaml_text import format_yaml
from flex_planner.reports.spatial_arm_file import spatial_fields

_UNLIMITED = 'unlimited'
_HEAD = '# SI units, radians. One entry per link and per joint, from the base outwards.\n'


def format_arm_file(arm: Arm) -> str:
    """
    Return an arm file, complete and in SI units.

    The file may say the same in other quantities than the one that the arm was read from.

    Raises
    ------
    InvalidValueError
        If the arm is one in space that a file of its own cannot describe, see `spatial_fields`.

    """
    if isinstance(arm, SpatialArm):
        return _HEAD + format_yaml(spatial_fields(arm, _joint))
    content: dict[str, Any] = {
        'name': arm.name, 'source': arm.source, 'gravity': arm.gravity.tolist(),
        'links': [_link(link) for link in arm.links],
        'joints': [_joint(joint) for joint in arm.joints],
        'nodes': [_node(node) for node in arm.nodes]}
    if arm.payload_com.any() or arm.payload_inertia:
        content['payload'] = {'center_of_mass': arm.payload_com.tolist(),
                              'inertia': arm.payload_inertia}
    return _HEAD + format_yaml(content)


def _link(link: Link) -> dict[str, Any]:
    """Return the fields of a link."""
    fields: dict[str, Any] = {'length': link.length}
    if link.sections and not link.sections[0].density:
        fields |= _with_hub(link)
    elif link.sections:
        fields['sections'] = [_piece(link, i) for i in range(len(link.sections))]
    else:
        fields['linear_density'] = link.linear_density
        if math.isfinite(link.flexural_rigidity):
            fields['flexural_rigidity'] = link.flexural_rigidity
    if link.modes:
        given = link.damping_ratio
        fields |= {'modes': link.modes, 'mode_family': link.mode_family,
                   'damping_ratio': list(given) if isinstance(given, tuple) else given}
    if link.modes and link.mode_family == 'clamped_mass':
        fields |= {'shape_mass': link.shape_mass, 'shape_inertia': link.shape_inertia}
    if math.isfinite(link.allowable_moment):
        fields['allowable_moment'] = link.allowable_moment
    if link.center_of_mass is not None:
        fields['center_of_mass'] = list(link.center_of_mass)
    if link.inertia is not None:
        fields['inertia'] = link.inertia
    return fields


def _with_hub(link: Link) -> dict[str, Any]:
    """Return the fields of a uniform beam on a hub, whose mass is elsewhere."""
    hub, *pieces = link.sections
    beam = next(i for i, piece in enumerate(pieces) if math.isfinite(piece.rigidity))
    base, tip = (sum(piece.share for piece in part) * link.length
                 for part in (pieces[:beam], pieces[beam + 1:]))
    return {'hub_radius': hub.share * link.length, 'rigid_base': base, 'rigid_tip': tip,
            'linear_density': pieces[beam].density * link.linear_density,
            'flexural_rigidity': pieces[beam].rigidity * link.flexural_rigidity}


def _piece(link: Link, index: int) -> dict[str, Any]:
    """Return a piece of a link in sections."""
    section = link.sections[index]
    piece: dict[str, Any] = {'length': section.share * link.length,
                             'linear_density': section.density * link.linear_density}
    rigidity = section.rigidity * link.flexural_rigidity
    stiff: dict[str, Any] = {'rigid': True}
    return piece | (stiff if math.isinf(rigidity) else {'flexural_rigidity': rigidity})


def _joint(joint: Joint) -> dict[str, Any]:
    """Return the fields of a joint."""
    motor = joint.motor
    fields: dict[str, Any] = {
        'motor': {'stall_torque': _limit(motor.stall_torque)},
        'friction': {'viscous': joint.viscous_friction, 'coulomb': joint.coulomb_friction,
                     'coulomb_speed': joint.coulomb_speed}}
    if motor.max_torque is not None:
        fields['motor']['max_torque'] = _limit(motor.max_torque)
    for name in ('no_load_speed', 'max_speed'):
        if math.isfinite(getattr(motor, name)):
            fields['motor'][name] = getattr(motor, name)
    if motor.gear_ratio != 1 or motor.rotor_inertia:
        fields['motor'] |= {'gear_ratio': motor.gear_ratio, 'rotor_inertia': motor.rotor_inertia}
    if joint.elasticity is not None:
        fields['elasticity'] = {'stiffness': joint.elasticity.stiffness,
                                'damping': joint.elasticity.damping}
    if joint.housing != Node():
        fields['housing'] = _node(joint.housing)
    for name in ('lower_limit', 'upper_limit'):
        if math.isfinite(getattr(joint, name)):
            fields[name] = getattr(joint, name)
    return fields


def _node(node: Node) -> dict[str, float]:
    """Return a lumped mass."""
    return {'mass': node.mass, 'inertia': node.inertia}


def _limit(value: float) -> float | str:
    """Return a limit, in words if there is none."""
    return value if math.isfinite(value) else _UNLIMITED
