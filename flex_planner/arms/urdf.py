"""
URDF files, as far as dynamics need them: links with their inertia, joints, limits, friction.

Read with the standard library. Meshes, materials, transmissions and tags of others have no
meaning here and are passed over.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import xml.etree.ElementTree as ElementTree
from xml.etree.ElementTree import Element

from flex_planner.arms.spatial_body import (
    as_matrix,
    as_point,
    Matrix,
    place_body,
    Point,
    SpatialBody,
    turn_rpy,
)
from flex_planner.arms.urdf_files import expand_urdf, find_urdf, UrdfError
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.text_files import say_file
from flex_planner.base.validation import Array
import numpy as np

MOVING = ('revolute', 'continuous', 'prismatic')
_KINDS = (*MOVING, 'fixed', 'floating', 'planar')
# of entries of rotations: angles are written with few digits, 1.5708 for a right angle
_SNAP, _FINE = 2e-5, 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfJoint:
    """
    A joint of a URDF file.

    Attributes
    ----------
    name, kind, parent, child : str
        As the file has them.
    position, rotation : tuple
        Of the joint's frame, which is that of the child, in the frame of the parent [m].
    axis : tuple
        In the frame of the joint.
    lower, upper : float
        Limits [rad, m]; infinite for none.
    effort, velocity : float
        Limits [N m, N], [rad/s, m/s]; infinite where none, or 0, is given.
    damping, friction : float
        Viscous and Coulomb friction.
    mimics : str
        The joint that it follows, or nothing.

    """

    name: str
    kind: str
    parent: str
    child: str
    position: Point
    rotation: Matrix
    axis: Point
    lower: float
    upper: float
    effort: float
    velocity: float
    damping: float
    friction: float
    mimics: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Urdf:
    """
    A URDF file.

    Attributes
    ----------
    name : str
        Of the robot.
    bodies : dict of str to SpatialBody
        Of the links, in their frames.
    joints : tuple of UrdfJoint
        In the order of the file.
    notes : tuple of str
        What was made of it.

    """

    name: str
    bodies: dict[str, SpatialBody]
    joints: tuple[UrdfJoint, ...]
    notes: tuple[str, ...] = ()

    @property
    def root(self) -> str:
        """Return the link that is no child."""
        children = {joint.child for joint in self.joints}
        return next(name for name in self.bodies if name not in children)

    @property
    def leaves(self) -> list[str]:
        """Return the links that are no parents."""
        parents = {joint.parent for joint in self.joints}
        return [name for name in self.bodies if name not in parents]

    def joint_to(self, link: str) -> UrdfJoint | None:
        """Return the joint of a link; None of the root."""
        return next((joint for joint in self.joints if joint.child == link), None)

    def joints_from(self, link: str) -> list[UrdfJoint]:
        """Return the joints that a link carries."""
        return [joint for joint in self.joints if joint.parent == link]


def read_urdf(given: str, folder: Path) -> Urdf:
    """
    Return what a URDF file says.

    Parameters
    ----------
    given : str
        Its path, from `folder` on; ``package://PACKAGE/PATH`` for a file of an installed package.
        A file that ends in ``.xacro`` is expanded first, if xacro is installed.
    folder : pathlib.Path
        Of the file that names it.

    Raises
    ------
    UrdfError
        If it cannot be found, read or expanded, or as `read_urdf_text`.

    """
    path = find_urdf(given, folder)
    return read_urdf_text(expand_urdf(path), say_file(path))


def read_urdf_text(text: str, source: str) -> Urdf:
    """
    Return what the text of a URDF file says.

    Parameters
    ----------
    text : str
        Not of a ``.xacro`` file.
    source : str
        Where it comes from, for messages.

    Raises
    ------
    UrdfError
        If it is no XML, or something in it is wrong; the message names the element.

    """
    try:
        return parse_urdf(text)
    except ElementTree.ParseError as error:
        raise UrdfError(f'{source}: is no XML: {error}') from None
    except InvalidValueError as error:
        raise UrdfError(f'{source}: {error}') from None


def parse_urdf(text: str) -> Urdf:
    """
    Return what the text of a URDF file says.

    Raises
    ------
    xml.etree.ElementTree.ParseError
        If it is no XML.
    InvalidValueError
        If something in it is wrong; the message names the element.

    """
    root = ElementTree.fromstring(text)
    if root.tag != 'robot':
        raise InvalidValueError('the root element', root.tag, 'robot')
    notes: list[str] = []
    bodies: dict[str, SpatialBody] = {}
    for element in root.findall('link'):
        name = _attribute(element, 'name', 'a link')
        if name in bodies:
            raise InvalidValueError(f'link {name}', 'there twice', 'there once')
        bodies[name] = _body(element, f'link {name}', notes)
    joints = tuple(_joint(element, notes) for element in root.findall('joint'))
    _check_tree(bodies, joints)
    return Urdf(name=root.get('name', ''), bodies=bodies, joints=joints, notes=tuple(notes))


def _check_tree(bodies: dict[str, SpatialBody], joints: Sequence[UrdfJoint]) -> None:
    """Refuse joints between links that are not there, and links that do not make one tree."""
    children: set[str] = set()
    for joint in joints:
        for role in ('parent', 'child'):
            if getattr(joint, role) not in bodies:
                raise InvalidValueError(f'joint {joint.name}, {role}', getattr(joint, role),
                                        'one of the links')
        if joint.child in children:
            raise InvalidValueError(f'link {joint.child}', 'the child of two joints',
                                    'the child of one joint')
        children.add(joint.child)
    roots = [name for name in bodies if name not in children]
    if len(roots) != 1:
        raise InvalidValueError('links without a joint to a parent', roots,
                                'one link, the root')


def _joint(element: Element, notes: list[str]) -> UrdfJoint:
    """Return a joint."""
    name = _attribute(element, 'name', 'a joint')
    where = f'joint {name}'
    kind = _attribute(element, 'type', where)
    if kind not in _KINDS:
        raise InvalidValueError(f'{where}, type', kind, f'one of {", ".join(_KINDS)}')
    position, rotation = _origin(element, where, notes)
    parent, child = (_attribute(_child(element, tag, where), 'link', f'{where}, {tag}')
                     for tag in ('parent', 'child'))
    axis = element.find('axis')
    limit, dynamics, mimic = (element.find(tag) for tag in ('limit', 'dynamics', 'mimic'))
    lower, upper = -math.inf, math.inf
    if kind in ('revolute', 'prismatic'):
        if limit is None:
            raise InvalidValueError(f'{where}, limit', None, f'given for a {kind} joint')
        lower, upper = (_number(limit, key, where, 0.0) for key in ('lower', 'upper'))
    return UrdfJoint(
        name=name, kind=kind, parent=parent, child=child, position=position, rotation=rotation,
        axis=as_point((1.0, 0.0, 0.0) if axis is None
                      else _numbers(axis, 'xyz', where, '1 0 0')),
        lower=lower, upper=upper, effort=_positive(limit, 'effort', where, notes),
        velocity=_positive(limit, 'velocity', where, notes),
        damping=_number(dynamics, 'damping', where, 0.0),
        friction=_number(dynamics, 'friction', where, 0.0),
        mimics='' if mimic is None else _attribute(mimic, 'joint', f'{where}, mimic'))


def _positive(limit: Element | None, key: str, where: str, notes: list[str]) -> float:
    """Return a limit, infinite where there is none; many files say 0 for none."""
    value = _number(limit, key, where, math.inf)
    if value < 0:
        raise InvalidValueError(f'{where}, limit {key}', value, '>= 0')
    if not value:
        notes.append(f'{where}: limit {key} is 0 and was taken as none')
        return math.inf
    return value


def _body(element: Element, where: str, notes: list[str]) -> SpatialBody:
    """Return the body of a link, in its frame."""
    inertial = element.find('inertial')
    if inertial is None:
        return SpatialBody()
    position, rotation = _origin(inertial, f'{where}, inertial', notes)
    mass = _number(_child(inertial, 'mass', where), 'value', f'{where}, mass', None)
    entries = _child(inertial, 'inertia', where)
    xx, xy, xz, yy, yz, zz = (_number(entries, key, f'{where}, inertia', 0.0)
                              for key in ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz'))
    try:
        body = SpatialBody(mass=mass, inertia=((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    except InvalidValueError as error:
        raise type(error)(f'{where}, {error.field}', error.value, error.bound) from None
    if not body.is_nothing and not body.is_possible:
        notes.append(f'{where}: no body has its inertia, one principal moment of which is larger '
                     'than the sum of the others; it was taken as it is')
    return place_body(body, np.array(position), np.array(rotation))


def _origin(element: Element, where: str, notes: list[str]) -> tuple[Point, Matrix]:
    """Return position and rotation of an origin."""
    origin = element.find('origin')
    if origin is None:
        return (0.0, 0.0, 0.0), as_matrix(np.eye(3))
    angles = _numbers(origin, 'rpy', where, '0 0 0')
    turned = turn_rpy(*angles)
    snapped = np.round(turned) + 0.0
    away = np.abs(turned - snapped).max()
    if 0 < away < _SNAP:
        if away > _FINE:
            notes.append(f'{where}: rpy "{origin.get("rpy")}" was taken as right angles')
        turned = snapped
    return as_point(_numbers(origin, 'xyz', where, '0 0 0')), as_matrix(turned)


def _numbers(element: Element, key: str, where: str, default: str) -> Array:
    """Return three numbers of an attribute."""
    given = element.get(key) or default
    try:
        values = [float(part) for part in given.split()]
    except ValueError:
        values = []
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise InvalidValueError(f'{where}, {element.tag} {key}', given, 'three numbers')
    return np.array(values)


def _number(element: Element | None, key: str, where: str, default: float | None) -> float:
    """Return a number of an attribute; one without a default must be there."""
    given = None if element is None else element.get(key)
    if given is None:
        if default is None:
            raise InvalidValueError(f'{where} {key}', None, 'given')
        return default
    try:
        value = float(given)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidValueError(f'{where}, {key}', given, 'a finite number')
    return value


def _child(element: Element, tag: str, where: str) -> Element:
    """Return an element inside another one."""
    found = element.find(tag)
    if found is None:
        raise InvalidValueError(f'{where}, {tag}', None, 'given')
    return found


def _attribute(element: Element, key: str, where: str) -> str:
    """Return an attribute that must be there."""
    given = element.get(key)
    if not given:
        raise InvalidValueError(f'{where}, {key}', given, 'given')
    return given


def walk_up(urdf: Urdf, tip: str, base: str) -> Iterator[UrdfJoint]:
    """
    Yield the joints from a tip up to a base.

    Raises
    ------
    InvalidValueError
        If the base is not above the tip.

    """
    link = tip
    while link != base:
        joint = urdf.joint_to(link)
        if joint is None:
            raise InvalidValueError('base', base, f'a link above the tip {tip}')
        yield joint
        link = joint.parent
