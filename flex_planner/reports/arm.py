"""Properties of an arm as text: masses, limits, frequencies and deflections."""

from __future__ import annotations

from collections.abc import Sequence
import math

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.inverse_kinematics import workspace
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.planning.warnings import find_arm_warnings
import numpy as np

_MOST_FREQUENCIES = 8


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
    lines = [arm.name, *_source_lines(arm.source), '', *_overview(arm, payload_mass), '']
    lines += [f'link {i}: {_describe_link(link)}' for i, link in enumerate(arm.links, 1)]
    lines += [f'joint {i}: {_describe_joint(joint)}' for i, joint in enumerate(arm.joints, 1)]
    lines += [f'warning: {one.sentence}' for one in find_arm_warnings(arm)]
    for posture in postures:
        lines += ['', *_describe_posture(model, posture, parameters)]
    return '\n'.join(lines)


def standard_postures(arm: Arm) -> list[Array]:
    """Return the arm stretched, hanging if it has weight, and with further joints at 90 deg."""
    first = float(np.arctan2(arm.gravity[1], arm.gravity[0])) if arm.gravity.any() else 0.0
    stretched, bent = np.zeros(arm.n_joints), np.full(arm.n_joints, math.pi / 2)
    stretched[0] = bent[0] = first
    return [stretched, bent] if arm.n_joints > 1 else [stretched]


def _source_lines(source: str) -> list[str]:
    return [f'source: {" ".join(source.split())}'] if source else []


def _overview(arm: Arm, payload_mass: float) -> list[str]:
    """Return masses, reach and plane."""
    beams = sum(link.mass for link in arm.links)
    nodes = sum(node.mass for node in arm.nodes)
    near, far = workspace(arm)
    gravity = float(np.linalg.norm(arm.gravity))
    plane = f'gravity {gravity:.4g} m/s^2 in the plane' if gravity else 'horizontal plane'
    return [f'mass: {beams + nodes:.4g} kg (links {beams:.4g} kg, nodes {nodes:.4g} kg), '
            f'payload {payload_mass:.4g} kg',
            f'reach: {near:.4g} to {far:.4g} m; {plane}',
            f'coordinates: {arm.n_joints} joints, {arm.n_modes} modal']


def _describe_link(link: Link) -> str:
    """Return a link's properties in one line."""
    text = f'{link.length:.4g} m, {link.mass:.4g} kg ({link.linear_density:.4g} kg/m), '
    if not link.modes:
        return text + 'rigid'
    damping = f', damping ratio {damping_text(link)}' if link.damping_ratios.any() else ''
    return (f'{text}EI {link.flexural_rigidity:.4g} N m^2, {link.modes} {link.mode_family} '
            f'mode{"s" if link.modes > 1 else ""}{damping}')


def damping_text(link: Link) -> str:
    """Return the damping ratio of a link, or those of its modes."""
    given = link.damping_ratio
    return ' and '.join(f'{ratio:g}' for ratio in (
        given if isinstance(given, tuple) else (given,))) or '0'


def _describe_joint(joint: Joint) -> str:
    """Return a joint's limits in one line."""
    motor, parts = joint.motor, []
    if math.isinf(motor.stall_torque):
        parts.append('no torque limit')
    elif math.isinf(motor.no_load_speed):
        parts.append(f'+-{motor.stall_torque:.4g} N m at any speed')
    else:
        parts.append(f'+-{motor.stall_torque:.4g} N m at standstill, no-load speed '
                     f'{motor.no_load_speed:.4g} rad/s')
    if math.isfinite(motor.max_speed):
        parts.append(f'at most {motor.max_speed:.4g} rad/s')
    if joint.viscous_friction:
        parts.append(f'friction {joint.viscous_friction:.4g} N m s/rad')
    if math.isfinite(joint.lower_limit) or math.isfinite(joint.upper_limit):
        low, high = np.degrees([joint.lower_limit, joint.upper_limit])
        parts.append(f'{low:.4g} to {high:.4g} deg')
    return ', '.join(parts)


def _describe_posture(model: ArmModel, posture: Array, parameters: Parameters) -> list[str]:
    """Return frequencies, deflection and holding torque at a posture."""
    arm = model.arm
    degrees = ', '.join(f'{angle:.4g}' for angle in np.degrees(posture))
    rest, torque = equilibrium(model, posture, parameters)
    lines = [f'at joint angles ({degrees}) deg:']
    for label, locked in (('joints locked', True), ('joints free', False)):
        frequencies, _ = natural_modes(model, rest, parameters, locked=locked)
        lines.append(f'  natural frequencies, {label}: {_frequencies(frequencies)}')
    unbent = np.concatenate([posture, np.zeros(arm.n_modes)])
    sag = np.linalg.norm(tip_position(arm, rest) - tip_position(arm, unbent)) * 1e3
    holding = ', '.join(f'{value:.4g}' for value in torque)
    if arm.gravity.any():
        lines.append(f'  static deflection: tip {sag:.4g} mm, modes '
                     f'{", ".join(f"{q * 1e3:.3g}" for q in rest[arm.n_joints:]) or "-"} mm')
        lines.append(f'  holding torque: {holding} N m')
    return lines


def _frequencies(values: Array) -> str:
    """Return frequencies in Hz; NaN marks a direction in which the arm falls."""
    shown = [('unstable' if math.isnan(value) else f'{value / (2 * math.pi):.4g}')
             for value in values[:_MOST_FREQUENCIES]]
    more = ', ...' if values.size > _MOST_FREQUENCIES else ''
    return f'{", ".join(shown)}{more} Hz' if shown else 'none'
