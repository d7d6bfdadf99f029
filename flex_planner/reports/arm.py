"""Properties of an arm as text: masses, limits, frequencies and deflections."""

from __future__ import annotations

from collections.abc import Sequence
import math

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.arms.inverse_kinematics import workspace
from flex_planner.arms.joint_units import JointUnits, units_of
from flex_planner.arms.kinematics import tip_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.boundary_conditions import rest_at_end
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.bending import find_largest_bending
from flex_planner.planning.warnings import find_arm_warnings
from flex_planner.reports.mode_relevance import describe_relevance
from flex_planner.reports.spatial_arm import (
    describe_place,
    describe_spatial_links,
    say_posture,
    spatial_postures,
)
import numpy as np

_MOST_FREQUENCIES = 8
_ROUNDING = 1e-12


def describe_arm(model: ArmModel, postures: Sequence[Array], payload_mass: float) -> str:
    """
    Return an arm's properties as lines of text.

    Parameters
    ----------
    model : ArmModel
        n joints.
    postures : sequence of numpy.ndarray, shape (n,)
        Joint angles at which frequencies and static deflections are given [rad].
    payload_mass : float
        At the tip [kg].

    """
    arm = model.arm
    parameters = Parameters.of(arm, payload_mass=payload_mass)
    lines = [arm.name, *_source_lines(arm.source), '', *_parts(arm, payload_mass)]
    lines += [f'warning: {one.sentence}' for one in find_arm_warnings(arm)]
    for posture in postures:
        lines += ['', *_describe_posture(model, posture, parameters)]
    if arm.n_passive:
        lines += ['', *describe_relevance(model, postures[-1], parameters)]
    return '\n'.join(lines)


def standard_postures(arm: Arm) -> list[Array]:
    """Return the arm stretched, across gravity if it has weight, then its further joints bent."""
    if isinstance(arm, SpatialArm):
        return spatial_postures(arm)
    first = math.atan2(arm.gravity[1], arm.gravity[0]) if arm.gravity.any() else 0.0
    stretched, bent = np.zeros(arm.n_joints), np.full(arm.n_joints, math.pi / 2)
    stretched[0] = bent[0] = first
    level = stretched.copy()
    level[0] = first + math.pi / 2
    across = [level] if arm.gravity.any() else []
    return [stretched, *across, *([bent] if arm.n_joints > 1 else [])]


def _parts(arm: Arm, payload_mass: float) -> list[str]:
    """Return the arm as a whole, its links and its joints."""
    if isinstance(arm, SpatialArm):
        return [*describe_spatial_links(arm, payload_mass),
                *(f'joint {i}: {describe_place(joint)}{_describe_joint(joint)}'
                  for i, joint in enumerate(arm.joints, 1)),
                *(f'note: {note}' for note in arm.notes)]
    return [*_overview(arm, payload_mass), '',
            *(f'link {i}: {_describe_link(link)}' for i, link in enumerate(arm.links, 1)),
            *(f'joint {i}: {_describe_joint(joint)}' for i, joint in enumerate(arm.joints, 1))]


def _source_lines(source: str) -> list[str]:
    return [f'source: {" ".join(source.split())}'] if source else []


def _overview(arm: Arm, payload_mass: float) -> list[str]:
    """Return masses, reach and plane."""
    beams = arm.link_mass
    nodes = sum(node.mass for node in arm.nodes)
    housings = sum(joint.housing.mass for joint in arm.joints[1:])
    motors = f', housings {housings:.4g} kg' if housings else ''
    near, far = workspace(arm)
    gravity = float(np.linalg.norm(arm.gravity))
    plane = f'gravity {gravity:.4g} m/s^2 in the plane' if gravity else 'horizontal plane'
    along, across = arm.payload_com
    place = f' at ({along:.4g}, {across:.4g}) m from the tip' if along or across else ''
    count = len(arm.elastic_joints)
    twists = f'{count} twist{"s" if count > 1 else ""}, ' if count else ''
    return [f'mass: {beams + nodes + housings:.4g} kg (links {beams:.4g} kg, nodes {nodes:.4g} kg'
            f'{motors}), payload {payload_mass:.4g} kg{place}',
            f'reach: {near:.4g} to {far:.4g} m; {plane}',
            f'coordinates: {arm.n_joints} joints, {twists}{arm.n_modes} modal']


def _describe_link(link: Link) -> str:
    """Return a link's properties in one line."""
    text = f'{link.length:.4g} m, {link.mass:.4g} kg ({link.linear_density:.4g} kg/m), '
    parts = f', in sections: {sections_text(link)}' if link.sections else ''
    if not link.modes:
        along, across = (moment / link.mass for moment in link.first_moment)
        given = link.center_of_mass is not None or link.inertia is not None or link.sections
        body = (f', centre of mass at ({along:.4g}, {across:.4g}) m, inertia '
                f'{link.rotary_inertia:.4g} kg m^2 about the joint' if given else '')
        return f'{text}rigid{parts}{body}'
    damping = f', damping ratio {damping_text(link)}' if link.damping_ratios.any() else ''
    return (f'{text}EI {link.flexural_rigidity:.4g} N m^2, {link.modes} {link.mode_family} '
            f'mode{"s" if link.modes > 1 else ""}{damping}{parts}')


def damping_text(link: Link) -> str:
    """Return the damping ratio of a link, or those of its modes."""
    given = link.damping_ratio
    return ' and '.join(f'{ratio:g}' for ratio in (
        given if isinstance(given, tuple) else (given,))) or '0'


def sections_text(link: Link) -> str:
    """Return the pieces of a link from its joint outwards."""
    pieces = [f'{one.share * link.length:.4g} m '
              + ('rigid' if math.isinf(one.rigidity) else f'EI x {one.rigidity:.4g}')
              + ('' if one.density else ' without mass') for one in link.sections]
    return '; '.join(pieces)


def _describe_joint(joint: Joint) -> str:
    """Return a joint's motor, gear, friction and limits in one line."""
    units = units_of(joint)
    parts = [_torque_limits(joint.motor, units)]
    if math.isfinite(joint.motor.max_speed):
        parts.append(f'at most {joint.motor.max_speed:.4g} {units.speed}')
    if joint.motor.rotor_inertia:
        parts.append(f'rotor {joint.motor.rotor_inertia:.4g} kg m^2 behind a gear of '
                     f'{joint.motor.gear_ratio:.4g}: {joint.motor.reflected_inertia:.4g} '
                     f'{units.inertia} at the joint')
    if joint.elasticity is not None:
        parts.append(f'elastic, {joint.elasticity.stiffness:.4g} {units.stiffness}, '
                     f'{joint.elasticity.damping:.4g} {units.damping}')
    if joint.viscous_friction:
        parts.append(f'friction {joint.viscous_friction:.4g} {units.damping}')
    if joint.coulomb_friction:
        parts.append(f'Coulomb friction {joint.coulomb_friction:.4g} {units.torque} above '
                     f'{joint.coulomb_speed:.4g} {units.speed}')
    if joint.housing.mass or joint.housing.inertia:
        parts.append(f'housing {joint.housing.mass:.4g} kg, {joint.housing.inertia:.4g} kg m^2')
    if math.isfinite(joint.lower_limit) or math.isfinite(joint.upper_limit):
        low, high = (units.scale * limit for limit in (joint.lower_limit, joint.upper_limit))
        parts.append(f'{low:.4g} to {high:.4g} {units.position}')
    return ', '.join(parts)


def _torque_limits(motor: Motor, units: JointUnits) -> str:
    """Return the limits of a motor's torque in words."""
    if math.isinf(motor.standstill_torque):
        return 'no torque limit'
    if math.isinf(motor.no_load_speed):
        return f'+-{motor.standstill_torque:.4g} {units.torque} at any speed'
    cap = 'without another limit when braking' if math.isinf(motor.torque_cap) else (
        f'at most {motor.torque_cap:.4g} {units.torque}')
    return (f'+-{motor.stall_torque:.4g} {units.torque} at standstill, no-load speed '
            f'{motor.no_load_speed:.4g} {units.speed}, {cap}')


def _describe_posture(model: ArmModel, posture: Array, parameters: Parameters) -> list[str]:
    """Return frequencies, deflection and holding torque at a posture."""
    arm = model.arm
    degrees = say_posture(arm, posture)
    rest, torque = equilibrium(model, posture, parameters)
    lines = [f'at joint angles {degrees}:']
    for label, locked in (('joints locked', True), ('joints free', False)):
        frequencies, _ = natural_modes(model, rest, parameters, locked=locked)
        lines.append(f'  natural frequencies, {label}: {_frequencies(frequencies)}')
    if arm.gravity.any():
        lines += [*_static_deflection(arm, posture, rest), *_holding(arm, torque),
                  *_largest_payload(model, posture)]
    return lines


def _static_deflection(arm: Arm, posture: Array, rest: Array) -> list[str]:
    """Return how gravity bends the arm."""
    unbent = np.concatenate([posture, np.zeros(arm.n_passive)])
    sag = float(np.linalg.norm(tip_position(arm, rest) - tip_position(arm, unbent)))
    bending = find_largest_bending(arm, rest[None])
    most = (f'; link {bending.link + 1} bends by {bending.share:.2%} of its length'
            if _shown(bending.share) else '')
    return [f'  static deflection: tip {_shown(sag) * 1e3:.4g} mm, {sag / arm.reach:.2%} of the '
            f'reach{most}', *_modal_displacements(arm, rest)]


def _modal_displacements(arm: Arm, rest: Array) -> list[str]:
    """Return what gravity displaces modes and twists by."""
    values = [f'{_shown(q) * 1e3:.3g}' for q in rest[arm.n_joints:]]
    twists, modes = values[:len(arm.elastic_joints)], values[len(arm.elastic_joints):]
    turning = any('twist' in name for name in arm.modal_names)
    unit = 'mm, mrad where they twist' if turning else 'mm'
    return [f'  {name} {", ".join(each)} {shown}' for name, each, shown in (
        ('modes', modes, unit), ('twists', twists, 'mrad')) if each]


def _holding(arm: Arm, torque: Array) -> list[str]:
    """Return the torque against gravity, as a share of what the motors have."""
    limits = [joint.motor.standstill_torque for joint in arm.joints]
    shares = (f' ({abs(value) / limit:.0%})' if math.isfinite(limit) else ''
              for value, limit in zip(torque, limits, strict=True))
    text = ', '.join(f'{_shown(value):.4g}{share}'
                     for value, share in zip(torque, shares, strict=True))
    lines = [f'  holding torque: {text} N m']
    lines += [f'  joint {i} cannot hold this: gravity takes {abs(value):.4g} N m of its '
              f'{limit:.4g} N m' for i, (value, limit) in enumerate(
                  zip(torque, limits, strict=True), 1) if abs(value) > limit]
    return lines


def _largest_payload(model: ArmModel, posture: Array) -> list[str]:
    """Return what the motors hold at a posture, if they hold the arm and it is known."""
    parameters = Parameters.of(model.arm)
    try:
        task = Task(arm=model.arm, start_positions=posture, goal_positions=posture, duration=1.0)
        if (np.abs(rest_at_end(model, task, 'goal', parameters)[1])
                > parameters.torque_limits.standstill).any():
            return []
        limit, joint = holding_limit(model, task, parameters)
    except FlexPlannerError:  # outside the limits of the joints
        return []
    return [f'  the motors hold up to {limit:.4g} kg, then joint {joint + 1} is too weak'
            ] if math.isfinite(limit) else []


def _shown(value: float) -> float:
    """Return a number without what is only rounding."""
    return 0.0 if abs(value) < _ROUNDING else value


def _frequencies(values: Array) -> str:
    """Return frequencies in Hz; NaN marks a direction in which the arm falls."""
    shown = [('unstable' if math.isnan(value) else f'{value / (2 * math.pi):.4g}')
             for value in values[:_MOST_FREQUENCIES]]
    more = ', ...' if values.size > _MOST_FREQUENCIES else ''
    return f'{", ".join(shown)}{more} Hz' if shown else 'none'
