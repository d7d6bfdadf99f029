"""The tables of an arm: its links, its joints as data sheets describe them, its masses."""

from __future__ import annotations

import math

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.joint_units import label_joints, units_of
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.reports.arm import damping_text, sections_text
from flex_planner.reports.recording.report_table import (
    NOTHING,
    numbered_table,
    ReportTable,
    told_columns,
)
from flex_planner.reports.recording.spatial_tables import spatial_links
from flex_planner.reports.spatial_arm import describe_place
import numpy as np


def arm_tables(arm: Arm) -> list[ReportTable]:
    """Return the arm's links, joints and masses; what no link or joint has takes no column."""
    if isinstance(arm, SpatialArm):
        return [spatial_links(arm), _joints(arm)]
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
    columns |= told_columns({
        'sections': [sections_text(link) if link.sections else '' for link in arm.links],
        'centre of mass [m]': [_center(link) for link in arm.links],
        'inertia about it [kg m²]': [_number(link.inertia) for link in arm.links]})
    return numbered_table(f'Arm: {arm.name}', 'link', columns)


def _joints(arm: Arm) -> ReportTable:
    """Return motors, gears, friction, springs and limits."""
    joints = arm.joints

    def unit(turning: str, sliding: str) -> str:
        """Return the unit of a column, with that of joints that slide where there are any."""
        return f'[{label_joints(arm, turning, sliding)}]'

    columns = {'moves': [describe_place(joint).rstrip(', ') for joint in joints
                         if isinstance(joint, SpatialJoint)]} if arm.dimension == 3 else {}
    columns |= {
        f'stall torque {unit("N m", "N")}': [f'{joint.motor.stall_torque:g}' for joint in joints],
        f'no-load speed {unit("rad/s", "m/s")}': [
            f'{joint.motor.no_load_speed:g}' for joint in joints],
        f'largest torque {unit("N m", "N")}': [_cap(joint) for joint in joints],
        f'largest speed {unit("rad/s", "m/s")}': [
            f'{joint.motor.max_speed:g}' for joint in joints],
        f'joint limits {unit("deg", "m")}': [_angles(joint) for joint in joints],
        f'viscous friction {unit("N m s/rad", "N s/m")}': [
            f'{joint.viscous_friction:g}' for joint in joints]}
    columns |= told_columns({
        f'Coulomb friction {unit("N m", "N")}': [_coulomb(joint) for joint in joints],
        'gear ratio': [f'{joint.motor.gear_ratio:g}' if joint.motor.gear_ratio != 1 else ''
                       for joint in joints],
        f'rotor inertia at the joint {unit("kg m²", "kg")}': [
            _number(joint.motor.reflected_inertia) for joint in joints],
        f'joint stiffness, damping {unit("N m/rad, N m s/rad", "N/m, N s/m")}': [
            f'{joint.elasticity.stiffness:g}, {joint.elasticity.damping:g}'
            if joint.elasticity else '' for joint in joints]})
    return numbered_table('Joints', 'joint', columns)


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
    return f'{joint.coulomb_friction:g} above {joint.coulomb_speed:g} {units_of(joint).speed}'


def _angles(joint: Joint) -> str:
    """Return the limits of a joint's angle, or a dash."""
    limits = joint.lower_limit, joint.upper_limit
    if not np.isfinite(limits).any():
        return NOTHING
    return ' to '.join(f'{angle:.4g}' for angle in units_of(joint).scale * np.array(limits))
