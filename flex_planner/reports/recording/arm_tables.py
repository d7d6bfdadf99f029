"""The tables of an arm: its links, its joints as data sheets describe them, its masses."""

from __future__ import annotations

import math

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.reports.arm import damping_text, sections_text
from flex_planner.reports.recording.report_table import Cells, ReportTable
import numpy as np

_NOTHING = '–'


def arm_tables(arm: Arm) -> list[ReportTable]:
    """Return the arm's links, joints and masses; what no link or joint has takes no column."""
    return [_links(arm), _joints(arm), *_masses(arm)]


def _links(arm: Arm) -> ReportTable:
    """Return the links as beams or bodies."""
    columns = {
        'length [m]': [f'{link.length:g}' for link in arm.links],
        'linear density [kg/m]': [f'{link.linear_density:g}' for link in arm.links],
        'flexural rigidity E I [N m²]': [f'{link.flexural_rigidity:g}' for link in arm.links],
        'modes': [f'{link.modes} {link.mode_family}' if link.modes else 'rigid'
                  for link in arm.links],
        'damping ratio': [damping_text(link) for link in arm.links]}
    columns |= _told({
        'sections': [sections_text(link) if link.sections else '' for link in arm.links],
        'centre of mass [m]': [_center(link) for link in arm.links],
        'inertia about it [kg m²]': [_number(link.inertia) for link in arm.links]})
    return _table(f'Arm: {arm.name}', 'link', columns)


def _joints(arm: Arm) -> ReportTable:
    """Return motors, gears, friction, springs and limits."""
    joints = arm.joints
    columns = {
        'stall torque [N m]': [f'{joint.motor.stall_torque:g}' for joint in joints],
        'no-load speed [rad/s]': [f'{joint.motor.no_load_speed:g}' for joint in joints],
        'largest torque [N m]': [_cap(joint) for joint in joints],
        'largest speed [rad/s]': [f'{joint.motor.max_speed:g}' for joint in joints],
        'joint limits [deg]': [_angles(joint) for joint in joints],
        'viscous friction [N m s/rad]': [f'{joint.viscous_friction:g}' for joint in joints]}
    columns |= _told({
        'Coulomb friction [N m]': [_coulomb(joint) for joint in joints],
        'gear ratio': [f'{joint.motor.gear_ratio:g}' if joint.motor.gear_ratio != 1 else ''
                       for joint in joints],
        'rotor inertia at the joint [kg m²]': [
            _number(joint.motor.reflected_inertia) for joint in joints],
        'joint stiffness, damping [N m/rad, N m s/rad]': [
            f'{joint.elasticity.stiffness:g}, {joint.elasticity.damping:g}'
            if joint.elasticity else '' for joint in joints]})
    return _table('Joints', 'joint', columns)


def _masses(arm: Arm) -> list[ReportTable]:
    """Return what is lumped at joints and tip, and where the arm carries its payload."""
    rows = [(f'joint {i}', node) for i, node in enumerate(arm.nodes[:-1], 1)]
    rows += [('tip', arm.nodes[-1])]
    rows += [(f'housing of joint {i}', joint.housing) for i, joint in enumerate(arm.joints, 1)]
    cells = [(name, f'{node.mass:g} kg', f'{node.inertia:g} kg m²')
             for name, node in rows if node.mass or node.inertia]
    if arm.payload_com.any():
        along, across = arm.payload_com
        cells += [('centre of the payload', f'({along:g}, {across:g}) m', 'from the tip')]
    return [ReportTable(title='Masses at joints and tip', rows=tuple(cells))] if cells else []


def _table(title: str, first: str, columns: dict[str, list[str]]) -> ReportTable:
    """Return a table of numbered rows."""
    rows: list[Cells] = [(str(i), *cells) for i, cells in enumerate(
        zip(*columns.values(), strict=True), 1)]
    return ReportTable(title=title, columns=(first, *columns), rows=tuple(rows))


def _told(columns: dict[str, list[str]]) -> dict[str, list[str]]:
    """Return the columns in which something is said, the rest of them with dashes."""
    return {name: [cell or _NOTHING for cell in cells] for name, cells in columns.items()
            if any(cells)}


def _number(value: float | None) -> str:
    return f'{value:g}' if value else ''


def _center(link: Link) -> str:
    """Return where the centre of mass of a rigid link is, if it was given."""
    given = link.center_of_mass
    return '' if given is None else f'({given[0]:g}, {given[1]:g})'


def _cap(joint: Joint) -> str:
    """Return the largest torque at any speed."""
    cap = joint.motor.torque_cap
    return 'by its line alone' if math.isinf(cap) else f'{cap:g}'


def _coulomb(joint: Joint) -> str:
    """Return the friction that does not grow with the speed."""
    if not joint.coulomb_friction:
        return ''
    return f'{joint.coulomb_friction:g} above {joint.coulomb_speed:g} rad/s'


def _angles(joint: Joint) -> str:
    """Return the limits of a joint's angle, or a dash."""
    limits = joint.lower_limit, joint.upper_limit
    if not np.isfinite(limits).any():
        return _NOTHING
    return ' to '.join(f'{angle:.4g}' for angle in np.degrees(limits))
