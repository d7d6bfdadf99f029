"""An arm in space as the fields of an arm file without URDF."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import IDENTITY, Matrix, NO_INERTIA, SpatialBody
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidValueError


def spatial_fields(arm: SpatialArm, joint_fields: Callable[[SpatialJoint], dict[str, Any]],
                   ) -> dict[str, Any]:
    """
    Return the fields of an arm.

    Names of joints and frames, and notes, are those of a URDF, and are left out.

    Parameters
    ----------
    arm : SpatialArm
        Its links are rigid or beams.
    joint_fields : function
        Returns what files of planar arms say of a joint, too.

    Raises
    ------
    InvalidValueError
        If the arm has links of finite elements, which a file of their own describes, or a payload
        with one number of inertia and a tensor.

    """
    places = [arm.base, *(link.end for link in arm.links)]
    content: dict[str, Any] = {
        'name': arm.name, 'kind': 'spatial', 'source': arm.source,
        'gravity': arm.gravity.tolist(),
        'joints': [_joint(joint, place) | joint_fields(joint)
                   for joint, place in zip(arm.joints, places, strict=False)],
        'tip': {'xyz': list(places[-1])} | _turn(arm.tip_rotation),
        'links': [_link(i, link) for i, link in enumerate(arm.links)]}
    return content | _payload(arm)


def _joint(joint: SpatialJoint, place: tuple[float, ...]) -> dict[str, Any]:
    """Return where a joint is and how it moves."""
    kind = {'type': 'prismatic'} if joint.slides else {}
    return {'xyz': list(place), 'axis': list(joint.axis)} | _turn(joint.rotation) | kind


def _turn(rotation: Matrix) -> dict[str, Any]:
    """Return a rotation, if there is one."""
    return {} if rotation == IDENTITY else {'rpy': [list(row) for row in rotation]}


def _link(index: int, link: SpatialLink) -> dict[str, Any]:
    """Return the fields of a link."""
    if link.elements is not None:
        raise InvalidValueError(f'links[{index}].elements', 'given', 'left out where an arm file '
                                'is written: links of elements are described by a file of theirs')
    fields = {} if link.beam is None else _beam(link.beam)
    bodies = {'inertial': link.body, 'tip_body': link.tip_body}
    return fields | {name: _body(body) for name, body in bodies.items() if not body.is_nothing}


def _body(body: SpatialBody) -> dict[str, Any]:
    """Return a rigid body."""
    return {'mass': body.mass, 'center_of_mass': list(body.center_of_mass),
            'inertia': [list(row) for row in body.inertia]}


def _beam(beam: SpatialBeam) -> dict[str, Any]:
    """Return the fields of a beam."""
    first, second = beam.modes
    fields: dict[str, Any] = {
        'linear_density': beam.linear_density,
        'modes': {'across': first, 'across2': second, 'twist': beam.twist_modes},
        'damping_ratio': beam.damping_ratio, 'mode_family': beam.mode_family,
        'polar_inertia': beam.polar_inertia, 'foreshortening': beam.foreshortening,
        'shape_mass': beam.shape_mass, 'shape_inertia': beam.shape_inertia,
        'shape_twist_inertia': beam.shape_twist_inertia}
    known = [one for one in beam.flexural_rigidity if math.isfinite(one)]
    if known:  # of a plane without modes it may be infinite, and has no effect
        fields['flexural_rigidity'] = [one if math.isfinite(one) else known[0]
                                       for one in beam.flexural_rigidity]
    if math.isfinite(beam.torsional_rigidity):
        fields['torsional_rigidity'] = beam.torsional_rigidity
    if beam.across is not None:
        fields['across'] = list(beam.across)
    return fields


def _payload(arm: SpatialArm) -> dict[str, Any]:
    """Return the payload, if the arm says anything of it."""
    tensor = arm.payload_tensor != NO_INERTIA
    if tensor and arm.payload_inertia:
        raise InvalidValueError('payload_tensor', 'given', 'left out beside payload_inertia where '
                                'an arm file is written: a file has one of them')
    if not tensor and not arm.payload_inertia and not arm.payload_com.any():
        return {}
    inertia = [list(row) for row in arm.payload_tensor] if tensor else arm.payload_inertia
    return {'payload': {'center_of_mass': arm.payload_com.tolist(), 'inertia': inertia}}
