"""Links, joints, nodes and payload as arm files say them."""

from __future__ import annotations

import math
from typing import Any

from flex_planner.arms.joint import COULOMB_SPEED, Elasticity, Joint, Motor, Node
from flex_planner.arms.link import Link
from flex_planner.arms.quantities import check_quantity
from flex_planner.arms.section_fields import (
    join_pieces,
    Piece,
    read_piece,
    read_quantity,
    read_uniform,
)
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import number
from flex_planner.base.yaml_files import YamlSection

_UNLIMITED = 'unlimited'
_STIFF_PARTS = ('hub_radius', 'rigid_base', 'rigid_tip')


def read_link(section: YamlSection) -> Link:
    """Return a link: uniform, with a hub and rigid ends, or in sections."""
    modes = section.take('modes', 0)
    values = {**(_stepped(section, bool(modes)) if section.has('sections')
                 else _uniform(section, bool(modes))),
              'family_assumed': bool(modes) and not section.has('mode_family'),
              'modes': modes, 'mode_family': section.take('mode_family', 'pinned_pinned'),
              'damping_ratio': section.take('damping_ratio', 0.0)}
    if values['mode_family'] == 'clamped_mass':
        for name, kind in (('shape_mass', 'mass'), ('shape_inertia', 'inertia')):
            values[name] = read_quantity(section, name, kind, above=-math.inf)
    allowed = _allowable_moment(section)
    if allowed is not None:
        values['allowable_moment'] = allowed
    if section.has('center_of_mass'):
        given = section.take('center_of_mass')
        values['center_of_mass'] = given if isinstance(given, list) else (given, 0.0)
    if section.has('inertia'):
        values['inertia'] = section.take('inertia')
    link: Link = section.build(Link, **values)
    return link


def _allowable_moment(section: YamlSection) -> float | None:
    """Return the largest bending moment of a link, by itself or by the stress it causes."""
    if section.has('allowable_moment'):
        return number(section.name('allowable_moment'), section.take('allowable_moment'), above=0,
                      unit='N m')
    if not section.has('allowable_stress'):
        return None
    stress = number(section.name('allowable_stress'), section.take('allowable_stress'), above=0,
                    unit='Pa')
    modulus = number(section.name('section_modulus'), section.take('section_modulus', None),
                     above=0, unit='m^3')
    factor = number(section.name('safety_factor'), section.take('safety_factor', 1.0),
                    at_least=1)
    return stress * modulus / factor


def _uniform(section: YamlSection, bends: bool) -> dict[str, Any]:
    """Return the fields of a link of one section, if need be between stiff parts."""
    length = read_quantity(section, 'length')
    hub, base, tip = (check_quantity(section.name(name), section.take(name, 0.0), 'length',
                                     at_least=0) for name in _STIFF_PARTS)
    beam = length - hub
    if not beam - base - tip > 0:
        raise InvalidValueError(
            section.name('length'), length, 'longer than its stiff parts, which it contains: '
            f'{" + ".join(_STIFF_PARTS)} = {hub + base + tip:g} m')
    whole = read_uniform(section, beam, bends)
    if not hub + base + tip:
        return {'length': length, 'linear_density': whole.linear_density,
                'flexural_rigidity': whole.rigidity}
    pieces = [Piece(length=hub, linear_density=0.0, rigidity=math.inf),
              Piece(length=base, linear_density=whole.linear_density, rigidity=math.inf),
              Piece(length=beam - base - tip, linear_density=whole.linear_density,
                    rigidity=whole.rigidity),
              Piece(length=tip, linear_density=whole.linear_density, rigidity=math.inf)]
    # `length` as the file has it, not the rounded sum
    return {**join_pieces(section, [piece for piece in pieces if piece.length]), 'length': length}


def _stepped(section: YamlSection, bends: bool) -> dict[str, Any]:
    """Return the fields of a link in sections."""
    pieces = [read_piece(part, bends) for part in section.sections('sections')]
    if not pieces:
        raise InvalidValueError(section.name('sections'), [], 'at least one section')
    values = join_pieces(section, pieces)
    if section.has('length'):
        length = read_quantity(section, 'length')
        if abs(length - values['length']) > 1e-6 * length:
            raise InvalidValueError(section.name('length'), length,
                                    f'{values["length"]:g} m, the sum of its sections')
    return values


def read_joint(section: YamlSection) -> Joint:
    """Return a joint with its motor."""
    values = read_joint_values(section)
    if section.has('housing'):
        values['housing'] = read_node(section.section('housing'))
    joint: Joint = section.build(Joint, **values)
    return joint


def read_joint_values(section: YamlSection) -> dict[str, Any]:
    """Return the fields of a joint of any kind: motor, friction, elasticity, limits."""
    values: dict[str, Any] = {**_friction(section)}
    if section.has('motor'):
        values['motor'] = _motor(section.section('motor'))
    if section.has('elasticity'):
        part = section.section('elasticity')
        values['elasticity'] = part.build(Elasticity, stiffness=part.take('stiffness'),
                                          damping=part.take('damping', 0.0))
    return {**values, 'lower_limit': section.take('lower_limit', -math.inf),
            'upper_limit': section.take('upper_limit', math.inf)}


def _friction(section: YamlSection) -> dict[str, Any]:
    """Return the friction of a joint, given in one way or the other."""
    if not section.has('friction'):
        return {'viscous_friction': section.take('viscous_friction', 0.0)}
    if section.has('viscous_friction'):
        raise InvalidValueError(section.name('viscous_friction'), section.take('viscous_friction'),
                                'left out where friction is given: friction.viscous')
    part = section.section('friction')
    values = {
        'viscous_friction': check_quantity(part.name('viscous'), part.take('viscous', 0.0),
                                           'viscous_friction', at_least=0),
        'coulomb_friction': check_quantity(part.name('coulomb'), part.take('coulomb', 0.0),
                                           'torque', at_least=0),
        'coulomb_speed': check_quantity(part.name('coulomb_speed'),
                                        part.take('coulomb_speed', COULOMB_SPEED), 'speed',
                                        above=0)}
    part.finish()
    return values


def _motor(section: YamlSection) -> Motor:
    """
    Return a motor, whose torques and speeds a file gives at the joint or ``at: motor``.

    A gear lets its efficiency's share of the torque through, in all quadrants: braking, losses
    would help, but how much is uncertain.

    """
    ratio = check_quantity(section.name('gear_ratio'), section.take('gear_ratio', 1.0),
                           'gear_ratio', above=0)
    efficiency = number(section.name('gear_efficiency'), section.take('gear_efficiency', 1.0),
                        above=0, at_most=1)
    at = section.take('at', 'joint')
    if at not in ('joint', 'motor'):
        raise InvalidValueError(section.name('at'), at, "'joint' or 'motor': where torques and "
                                'speeds of the motor are given')
    gear = ratio if at == 'motor' else 1.0
    needed = not any(section.has(name) for name in ('max_speed', 'max_torque', 'rotor_inertia'))
    values: dict[str, Any] = {'gear_ratio': ratio}
    if needed or section.has('stall_torque'):
        values['stall_torque'] = efficiency * gear * _limit(section, 'stall_torque', 'torque')
    if section.has('max_torque'):
        values['max_torque'] = efficiency * gear * _limit(section, 'max_torque', 'torque')
    for name in ('no_load_speed', 'max_speed'):
        if section.has(name):
            values[name] = _limit(section, name, 'speed') / gear
    if section.has('rotor_inertia'):
        values['rotor_inertia'] = section.take('rotor_inertia')
    motor: Motor = section.build(Motor, **values)
    return motor


def _limit(section: YamlSection, key: str, kind: str) -> float:
    """Return a limit, which may be infinite or, in words, unlimited."""
    given = section.take(key)
    if given == _UNLIMITED:
        return math.inf
    if isinstance(given, str):
        raise InvalidValueError(section.name(key), given, f'a number or {_UNLIMITED}')
    return check_quantity(section.name(key), given, kind, above=0, infinite=True)


def read_node(section: YamlSection) -> Node:
    """Return a lumped mass."""
    node: Node = section.build(Node, mass=section.take('mass', 0.0),
                               inertia=section.take('inertia', 0.0))
    return node


def read_payload(section: YamlSection) -> dict[str, Any]:
    """Return where the payload's centre of mass is and what inertia it has."""
    values = {'payload_com': section.take('center_of_mass', (0.0, 0.0)),
              'payload_inertia': check_quantity(section.name('inertia'),
                                                section.take('inertia', 0.0), 'inertia',
                                                at_least=0)}
    section.finish()
    return values
