"""
Limits on the way as short texts, for messages and command lines.

A text is the kind and its values in SI units and radians, ``kind:values``, with options after it:
``keep_out:0.52,0.25,0.1;stations=4;name=post``. `FORMS` lists the kinds.

"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.number_texts import NumberTextError, read_number
from flex_planner.base.suggestions import one_of
from flex_planner.optimal_control.path_constraints.bending_constraints import (
    BendingMoment,
    Deflection,
)
from flex_planner.optimal_control.path_constraints.joint_constraints import (
    JointRange,
    JointSpeed,
)
from flex_planner.optimal_control.path_constraints.obstacles import KeepOut, SelfClearance
from flex_planner.optimal_control.path_constraints.path_constraint import PathConstraint
from flex_planner.optimal_control.path_constraints.regions import (
    Capsule,
    Circle,
    HalfPlane,
    Region,
)
from flex_planner.optimal_control.path_constraints.spatial_regions import (
    HalfSpace,
    SpatialCapsule,
    Sphere,
)

_Values = list[float]
_Options = dict[str, Any]


def _keep_out(region: Callable[[_Values], Any]) -> Callable[[_Values, _Options], PathConstraint]:
    return lambda values, options: KeepOut(region=region(values), **options)


FORMS: dict[str, tuple[int, str, Callable[[_Values, _Options], PathConstraint]]] = {
    'keep_out': (3, 'x, y, radius', _keep_out(
        lambda v: Circle(center=(v[0], v[1]), radius=v[2]))),
    'keep_out_capsule': (5, 'x, y, x, y, radius', _keep_out(
        lambda v: Capsule(start=(v[0], v[1]), end=(v[2], v[3]), radius=v[4]))),
    'keep_out_half_plane': (4, 'x, y of a point, x, y of the normal to the free side', _keep_out(
        lambda v: HalfPlane(point=(v[0], v[1]), normal=(v[2], v[3])))),
    'keep_out_sphere': (4, 'x, y, z, radius', _keep_out(
        lambda v: Sphere(center=tuple(v[:3]), radius=v[3]))),
    'keep_out_spatial_capsule': (7, 'x, y, z, x, y, z, radius', _keep_out(
        lambda v: SpatialCapsule(start=tuple(v[:3]), end=tuple(v[3:6]), radius=v[6]))),
    'keep_out_half_space': (6, 'x, y, z of a point, x, y, z of the normal to the free side',
                            _keep_out(lambda v: HalfSpace(point=tuple(v[:3]),
                                                          normal=tuple(v[3:])))),
    'joint_range': (3, 'joint, lower, upper', lambda v, o: JointRange(
        joint=_index(v[0]), lower=v[1], upper=v[2], **o)),
    'joint_speed': (2, 'joint, limit', lambda v, o: JointSpeed(
        joint=_index(v[0]), limit=v[1], **o)),
    'self_clearance': (1, 'base radius', lambda v, o: SelfClearance(base_radius=v[0], **o)),
    'bending_moment': (2, 'link, limit', lambda v, o: BendingMoment(
        link=_index(v[0]), limit=v[1], **o)),
    'deflection': (2, 'link, share of its length', lambda v, o: Deflection(
        link=_index(v[0]), limit=v[1], **o)),
}
"""Kinds of limits: how many values, which, and how they are made."""
_REGIONS: dict[type[Region], str] = {
    Circle: 'keep_out', Capsule: 'keep_out_capsule', HalfPlane: 'keep_out_half_plane',
    Sphere: 'keep_out_sphere', SpatialCapsule: 'keep_out_spatial_capsule',
    HalfSpace: 'keep_out_half_space'}
# options by kind, and what they are
_OPTIONS: dict[str, dict[str, type]] = {
    'keep_out': {'tip_radius': float, 'stations': int, 'link_radius': float, 'name': str},
    'self_clearance': {'link_radius': float, 'stations': int},
    'bending_moment': {'stations': tuple}, 'deflection': {'stations': tuple}}


def read_constraint(field: str, text: str) -> PathConstraint:
    """
    Return the limit that a text describes.

    Parameters
    ----------
    field : str
        For messages.
    text : str
        ``kind:value,value,...;option=value;...``

    Raises
    ------
    InvalidValueError
        Naming the field and what is expected.

    """
    head, *rest = text.split(';')
    kind, colon, values = head.partition(':')
    kind = kind.strip().replace('-', '_')
    if kind not in FORMS or not colon:
        raise InvalidValueError(field, text, f'kind:values, kind {one_of(kind, FORMS)}')
    count, meaning, make = FORMS[kind]
    numbers = [_number(field, text, part, meaning) for part in values.split(',')]
    if len(numbers) != count:
        raise InvalidValueError(field, text, f'{kind}: with {count} numbers, {meaning}')
    try:
        return make(numbers, dict(_option(field, text, kind, part) for part in rest))
    except InvalidValueError as error:
        raise InvalidValueError(f'{field} ({kind}) {error.field}', error.value,
                                error.bound) from None


def write_constraint(constraint: PathConstraint) -> str:
    """Return the text of a limit, which `read_constraint` makes the same of."""
    kind, values = _describe(constraint)
    options: dict[str, type] = next((known for name, known in _OPTIONS.items()
                                     if kind.startswith(name)), {})
    given = [(name, getattr(constraint, name)) for name in options]
    shown = [f'{name}={"/".join(map(repr, value)) if isinstance(value, tuple) else value}'
             for name, value in given if value != '']
    return ';'.join([f'{kind}:{",".join(repr(value) for value in values)}', *shown])


def _describe(constraint: PathConstraint) -> tuple[str, list[float]]:
    """Return kind and values of a limit."""
    if isinstance(constraint, KeepOut):
        return _REGIONS[type(constraint.region)], constraint.region.numbers
    if isinstance(constraint, JointRange):
        return 'joint_range', [constraint.joint, constraint.lower, constraint.upper]
    if isinstance(constraint, JointSpeed):
        return 'joint_speed', [constraint.joint, constraint.limit]
    if isinstance(constraint, SelfClearance):
        return 'self_clearance', [constraint.base_radius]
    if isinstance(constraint, (BendingMoment, Deflection)):
        kind = 'bending_moment' if isinstance(constraint, BendingMoment) else 'deflection'
        return kind, [constraint.link, constraint.limit]
    raise InvalidValueError('constraint', constraint, f'one of {", ".join(FORMS)}')


def _option(field: str, text: str, kind: str, part: str) -> tuple[str, Any]:
    """Return the name and the value of an option."""
    known: dict[str, type] = next((options for name, options in _OPTIONS.items()
                                  if kind.startswith(name)), {})
    name, _, value = part.partition('=')
    name = name.strip().replace('-', '_')
    if name not in known:
        raise InvalidValueError(field, text, f'options of {kind}: '
                                f'{", ".join(known) or "none"}')
    if known[name] is str:
        return name, value.strip()
    if known[name] is tuple:
        return name, tuple(_number(field, text, each, name) for each in value.split('/'))
    number = _number(field, text, value, name)
    return name, _index(number) if known[name] is int else number


def _number(field: str, text: str, part: str, meaning: str) -> float:
    try:
        return float(read_number(part.strip()))
    except NumberTextError:
        raise InvalidValueError(field, text, f'numbers: {meaning}') from None


def _index(value: float) -> Any:
    """Return a whole number as such, others as they are: checks say what is wrong."""
    return int(value) if value.is_integer() else value
