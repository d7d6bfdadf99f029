"""Spatial arms as plain values, which keep them in recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from flex_planner.arms.element_modes import ElementModes
from flex_planner.arms.joint import Elasticity, Motor, Node
from flex_planner.arms.mechanism import FlexibleBody
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import SpatialBody
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
import numpy as np

_KIND, _SPATIAL = 'kind', 'spatial'


def is_plain_spatial(fields: Mapping[str, Any]) -> bool:
    """Return whether plain values are those of `plain_spatial_arm`."""
    return bool(fields.get(_KIND) == _SPATIAL)


def plain_spatial_arm(arm: SpatialArm) -> dict[str, Any]:
    """Return all values of a spatial arm as YAML can write them, see `arm_files.plain_arm`."""
    values: dict[str, Any] = _plain(asdict(arm))
    return {_KIND: _SPATIAL, **values}


def spatial_arm_from_plain(fields: Mapping[str, Any]) -> SpatialArm:
    """Return the arm whose values `plain_spatial_arm` has written, see `arm_from_plain`."""
    given = {name: _tuples(value) for name, value in fields.items() if name != _KIND}
    return SpatialArm(**{
        **given, 'links': tuple(_link(entry) for entry in fields['links']),
        'joints': tuple(SpatialJoint(**joint_values(entry)) for entry in fields['joints'])})


def joint_values(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a joint of any kind, with its parts, of plain values."""
    parts: dict[str, Any] = {'motor': Motor(**fields['motor'])}
    if fields.get('elasticity') is not None:
        parts['elasticity'] = Elasticity(**fields['elasticity'])
    if 'housing' in fields:
        parts['housing'] = Node(**fields['housing'])
    return {**{name: _tuples(value) for name, value in fields.items()}, **parts}


def _link(fields: Mapping[str, Any]) -> SpatialLink:
    beam = fields['beam']
    bodies = {name: SpatialBody(**{key: _tuples(value) for key, value in fields[name].items()})
              for name in ('body', 'tip_body')}
    return SpatialLink(
        end=_tuples(fields['end']), **bodies, beam=None if beam is None else (
            SpatialBeam(**{key: _tuples(value) for key, value in beam.items()})),
        elements=_elements(fields.get('elements')))


def _elements(fields: Mapping[str, Any] | None) -> ElementModes | None:
    """Return modes of finite elements; recordings of older planners have none."""
    if fields is None:
        return None
    body: dict[str, Any] = {key: value if key == 'mass' else np.array(value)
                            for key, value in fields['body'].items()}
    return ElementModes(**{**fields, 'body': FlexibleBody(**body)})


def _plain(value: Any) -> Any:
    """Return nested values with arrays and tuples as lists."""
    if isinstance(value, Mapping):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_plain(entry) for entry in value] if isinstance(value, (list, tuple)) else value


def _tuples(value: Any) -> Any:
    """Return nested lists as tuples, as parts of arms keep them."""
    return tuple(_tuples(entry) for entry in value) if isinstance(value, list) else value
