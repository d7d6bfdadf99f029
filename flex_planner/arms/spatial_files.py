"""
Spatial arms in arm files: alone, or as an overlay of a URDF file that says what bends.

An overlay names links and joints of the URDF. What it says of them wins; nothing is counted twice
without a note.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import math
from pathlib import Path
from typing import Any

from flex_planner.arms.arm_fields import read_joint_values
from flex_planner.arms.beam_fields import is_beam, read_beam, read_body
from flex_planner.arms.element_files import read_elements
from flex_planner.arms.joint import COULOMB_SPEED, Motor
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import (
    as_matrix,
    as_point,
    join_bodies,
    place_body,
    point,
    SpatialBody,
)
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.arms.urdf import read_urdf, read_urdf_text, Urdf, UrdfJoint
from flex_planner.arms.urdf_chain import ChainLink, find_chain, UrdfChain, whole_body
from flex_planner.base.errors import InvalidSizeError, InvalidValueError
from flex_planner.base.sentences import count_of
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import number
from flex_planner.base.yaml_files import YamlSection
import numpy as np

SPATIAL = 'spatial'
ROBOT_DESCRIPTION = 'robot_description'
_GRAVITY = (0.0, 0.0, -9.81)
_AS = {'beam': 'a beam', 'elements': 'elements'}
# of masses that are compared
_ALIKE = 1e-3


def is_spatial(top: YamlSection) -> bool:
    """Return whether a file describes a spatial arm."""
    if top.has('urdf'):
        return True
    if not top.has('kind'):
        return False
    kind = top.take('kind')
    if kind not in (SPATIAL, 'planar'):
        raise InvalidValueError(top.name('kind'), kind, "'planar' or 'spatial'")
    return bool(kind == SPATIAL)


def read_spatial_arm(top: YamlSection, folder: Path, description: str = '') -> SpatialArm:
    """
    Return the arm of a file.

    Parameters
    ----------
    top : YamlSection
        The file, `is_spatial`.
    folder : pathlib.Path
        In which the path of a URDF file begins.
    description : str
        Text of a URDF file in place of the one that the file names, which need not name any.

    Raises
    ------
    InvalidValueError
        Naming the field by its path in the file.
    UrdfError
        If the URDF file is missing or wrong.

    """
    named = top.has('urdf')
    values = {**_common(top), **(_of_urdf(top, folder, description) if named or description
                                 else _alone(top, folder))}
    arm: SpatialArm = top.build(SpatialArm, **values)
    return arm


def _common(top: YamlSection) -> dict[str, Any]:
    """Return the fields that both forms have."""
    values: dict[str, Any] = {'source': top.text('source', ''),
                              'gravity': top.take('gravity', _GRAVITY)}
    if top.has('payload'):
        part = top.section('payload')
        inertia = part.take('inertia', 0.0)
        tensor = isinstance(inertia, list)
        values |= {'payload_com': part.take('center_of_mass', (0.0, 0.0, 0.0)),
                   'payload_tensor' if tensor else 'payload_inertia': inertia}
        part.finish()
    return values


def _alone(top: YamlSection, folder: Path) -> dict[str, Any]:
    """Return the fields of an arm without URDF: joints and links in their order."""
    places: list[Any] = []
    joints = [_read_joint(section, places) for section in top.sections('joints')]
    rotation: Any = (0.0, 0.0, 0.0)
    end: Any = (0.0, 0.0, 0.0)
    if top.has('tip'):
        tip = top.section('tip')
        end, rotation = (tip.take(key, (0.0, 0.0, 0.0)) for key in ('xyz', 'rpy'))
        tip.finish()
    ends = [*places[1:], point(top.name('tip.xyz'), end)]
    links = [_read_link(section, end, folder) for section, end in _paired(top, ends)]
    return {'name': top.text('name'), 'joints': tuple(joints), 'links': tuple(links),
            'base': places[0] if places else (0.0, 0.0, 0.0), 'tip_rotation': rotation}


def _paired(top: YamlSection, ends: list[Any]) -> Iterator[tuple[YamlSection, Any]]:
    """Yield each link with its end."""
    sections = list(top.sections('links'))
    if len(sections) != len(ends):
        raise InvalidSizeError(top.name('links'), count_of(len(sections), 'link'),
                               f'{len(ends)}, one per joint')
    return zip(sections, ends, strict=True)


def _read_joint(section: YamlSection, places: list[Any]) -> SpatialJoint:
    """Return a joint; where it is goes into a list."""
    places.append(point(section.name('xyz'), section.take('xyz', (0.0, 0.0, 0.0))))
    kind = section.take('type', 'revolute')
    if kind not in ('revolute', 'prismatic'):
        raise InvalidValueError(section.name('type'), kind, "'revolute' or 'prismatic'")
    joint: SpatialJoint = section.build(
        SpatialJoint, axis=section.take('axis', (0.0, 0.0, 1.0)),
        rotation=section.take('rpy', (0.0, 0.0, 0.0)), slides=kind == 'prismatic',
        **read_joint_values(section))
    return joint


def _read_link(section: YamlSection, end: Any, folder: Path) -> SpatialLink:
    """Return a link: a body, a beam or finite elements with what is at its ends."""
    parts: dict[str, Any] = {f'{name}body' if name else 'body': read_body(section.section(field))
                             for name, field in (('', 'inertial'), ('tip_', 'tip_body'))
                             if section.has(field)}
    if section.has('elements'):
        parts['elements'] = read_elements(section.section('elements'), end, folder)
    elif is_beam(section):
        length = math.hypot(*end)
        if not length:
            raise InvalidValueError(section.name('modes'), 'given',
                                    'left out where the next joint is at the same place')
        beam = read_beam(section, length, 0.0)
        return SpatialLink(end=end, beam=beam, **parts)
    link: SpatialLink = section.build(SpatialLink, end=end, **parts)
    return link


def _of_urdf(top: YamlSection, folder: Path, description: str) -> dict[str, Any]:
    """Return the fields of an arm from a URDF file and what the overlay says of it."""
    path = top.text('urdf', '')
    urdf = (read_urdf_text(description, ROBOT_DESCRIPTION) if description
            else read_urdf(path, folder))
    if top.has('kind'):
        is_spatial(top)
    locked = top.section('locked_joints', {})
    held = {name: number(locked.name(name), locked.take(name)) for name in locked.left()}
    try:
        base, tip = (top.text(key) if top.has(key) else None for key in ('base', 'tip'))
        chain = find_chain(urdf, base, tip, held)
    except InvalidValueError as error:
        raise type(error)(top.name(error.field), error.value, error.bound) from None
    return _Overlay(top, folder, urdf, chain).fields()


class _Overlay:
    """A chain of a URDF file with what an arm file says of its links and joints."""

    def __init__(self, top: YamlSection, folder: Path, urdf: Urdf, chain: UrdfChain) -> None:
        self._top, self._folder, self._urdf, self._chain = top, folder, urdf, chain
        self._notes = [*urdf.notes, *chain.notes]

    def fields(self) -> dict[str, Any]:
        """Return the fields of the arm."""
        names = [link.name for link in self._chain.links]
        joint_names = [link.joint.name for link in self._chain.links]
        links = self._sections('links', names)
        joints = self._sections('joints', joint_names)
        self._notes.append(f'joints in their order: {", ".join(joint_names)}')
        name = self._top.text('name') if self._top.has('name') else self._urdf.name or 'URDF'
        return {
            'name': name, 'base': self._chain.base, 'tip_rotation': self._chain.tip_rotation,
            'joints': tuple(self._joint(link, joints.get(link.joint.name))
                            for link in self._chain.links),
            'links': tuple(self._link(link, links.get(link.name)) for link in self._chain.links),
            'notes': tuple(self._notes), 'joint_names': tuple(joint_names),
            'frame_names': (self._chain.base_name, *names, self._chain.tip_name)}

    def _sections(self, field: str, names: list[str]) -> dict[str, YamlSection]:
        """Return what the file says of links or joints, by name."""
        section = self._top.section(field, {})
        found = {}
        for name in section.left():
            if name not in names:
                raise InvalidValueError(section.name(str(name)), 'given',
                                        f'{one_of(str(name), names)}')
            found[name] = section.section(name)
        return found

    def _joint(self, link: ChainLink, section: YamlSection | None) -> SpatialJoint:
        """Return a joint: of the URDF, and what the file says otherwise."""
        joint = link.joint
        values = _urdf_joint(joint)
        if section is not None:
            given = {key for key in ('lower_limit', 'upper_limit', 'motor', 'viscous_friction',
                                     'friction', 'elasticity') if section.has(key)}
            said = read_joint_values(section)
            section.finish()
            values |= {key: said[key] for key in said
                       if key in given or key.startswith('coulomb') and 'friction' in given}
            if 'friction' in given:
                values['viscous_friction'] = said['viscous_friction']
            if 'motor' in given:
                values['motor'] = _limited(said['motor'], joint)
        where = YamlSection(f'joint {joint.name} of the URDF' if section is None
                            else section.path, {})
        made: SpatialJoint = where.build(
            SpatialJoint, axis=joint.axis, rotation=link.rotation,
            slides=joint.kind == 'prismatic', **values)
        return made

    def _link(self, link: ChainLink, section: YamlSection | None) -> SpatialLink:
        """Return a link: rigid as the URDF has it, or bending as the file says."""
        if section is None:
            return SpatialLink(end=link.end, body=whole_body(link))
        if not any(link.end):
            raise InvalidValueError(section.path, 'a link that bends', 'left out: the next joint '
                                    'is where that of the link is, so there is nothing to bend')
        base, tip = (read_body(section.section(key)) if section.has(key) else SpatialBody()
                     for key in ('base_body', 'tip_body'))
        if section.has('elements'):
            elements = read_elements(section.section('elements'), link.end, self._folder)
            made: SpatialLink = section.build(SpatialLink, end=link.end, body=base,
                                              elements=elements, tip_body=tip)
        else:
            beam = self._beam(link, section, base.mass + tip.mass)
            made = SpatialLink(end=link.end, body=base, beam=beam, tip_body=tip)
        self._compare(link, made)
        return self._with_merged(link, made)

    @staticmethod
    def _beam(link: ChainLink, section: YamlSection, bodies: float) -> SpatialBeam:
        """Return a beam, by default with the mass that bodies at its ends leave of the link."""
        rest = link.body.mass - bodies
        given = any(section.has(key) for key in ('mass', 'linear_density', 'density'))
        if not given and not rest > 0:
            raise InvalidValueError(
                section.name('mass'), None, f'given: the URDF has {link.body.mass:g} kg for the '
                f'link, base_body and tip_body have {bodies:g} kg')
        return read_beam(section, math.hypot(*link.end), max(rest, 0.0))

    def _compare(self, link: ChainLink, made: SpatialLink) -> None:
        """Note what the file has instead of the link's <inertial>."""
        said, what = _inertial(made), 'elements' if made.elements else 'beam'
        if abs(said.mass - link.body.mass) > _ALIKE * max(said.mass, link.body.mass):
            self._notes.append(
                f'link {link.name}: {what}, base_body and tip_body have {said.mass:.4g} kg and '
                f'stand for the {link.body.mass:.4g} kg of its <inertial>')
        away = float(np.linalg.norm(np.subtract(said.center_of_mass, link.body.center_of_mass)))
        self._notes.append(
            f'link {link.name}: as {_AS[what]} its centre of mass is '
            f'{round(away, 6) * 1e3:.3g} mm from that of its <inertial>, and its principal '
            f'moments are {_moments(said)} kg m^2 instead of {_moments(link.body)}')

    def _with_merged(self, link: ChainLink, made: SpatialLink) -> SpatialLink:
        """Return a flexible link with what is fixed to it, at the end that is nearer."""
        for name, place, body in link.merged:
            if body.is_nothing:
                continue
            far = np.linalg.norm(np.subtract(place, link.end)) < np.linalg.norm(place)
            self._notes.append(f'link {name} is fixed to the {"end" if far else "base"} of the '
                               f'{"elements" if made.elements else "beam"} {link.name}')
            moved = place_body(body, -np.array(link.end) if far else np.zeros(3), np.eye(3))
            made = (replace(made, tip_body=join_bodies(made.tip_body, moved)) if far
                    else replace(made, body=join_bodies(made.body, moved)))
        return made


def _urdf_joint(joint: UrdfJoint) -> dict[str, Any]:
    """Return the fields of a joint as a URDF has them."""
    return {'viscous_friction': joint.damping, 'coulomb_friction': joint.friction,
            'coulomb_speed': COULOMB_SPEED, 'lower_limit': joint.lower,
            'upper_limit': joint.upper, 'motor': _limited(Motor(), joint)}


def _limited(motor: Motor, joint: UrdfJoint) -> Motor:
    """
    Return a motor with the limits of a URDF where it has none.

    They hold at any speed: a limit of the velocity is no no-load speed.

    """
    torque, speed = motor.max_torque, motor.max_speed
    if torque is None and math.isinf(motor.stall_torque):
        torque = joint.effort
    return replace(motor, max_torque=torque,
                   max_speed=joint.velocity if math.isinf(speed) else speed)


def _inertial(link: SpatialLink) -> SpatialBody:
    """Return a link as one rigid body in its frame, unbent."""
    rod, turn = link.flexible_body(), link.axes()
    center = turn @ (rod.first_moment / rod.mass)
    about = turn @ rod.inertia @ turn.T
    away = float(center @ center) * np.eye(3) - np.outer(center, center)
    own = about - rod.mass * away
    bends = SpatialBody(mass=rod.mass, center_of_mass=as_point(center),
                        inertia=as_matrix((own + own.T) / 2))
    end = place_body(link.tip_body, np.array(link.end), np.eye(3))
    return join_bodies(bends, link.body, end)


def _moments(body: SpatialBody) -> str:
    """Return principal moments in words."""
    return ', '.join(f'{max(moment, 0.0):.3g}'
                     for moment in np.linalg.eigvalsh(np.array(body.inertia)))
