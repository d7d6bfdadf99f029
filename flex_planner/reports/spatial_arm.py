"""Links and joints of a spatial arm as text."""

from __future__ import annotations

import math

from flex_planner.arms.arm import Arm
from flex_planner.arms.element_modes import ElementModes
from flex_planner.arms.joint_units import units_of
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_body import Matrix, SpatialBody
from flex_planner.arms.spatial_joint import slides, SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.validation import Array
import numpy as np

_BENT = math.pi / 4


def spatial_postures(arm: SpatialArm) -> list[Array]:
    """Return the arm with its joints at zero, and with all but the first turned by 45 degrees."""
    lower, upper = arm.angle_limits()
    bent = np.array([0.0 if i == 0 or slides(joint) else _BENT
                     for i, joint in enumerate(arm.joints)])
    return [np.clip(posture, lower, upper) for posture in (np.zeros(arm.n_joints), bent)]


def say_posture(arm: Arm, posture: Array) -> str:
    """Return joint positions in parentheses with their unit."""
    units = [units_of(joint) for joint in arm.joints]
    values = ', '.join(f'{unit.scale * value:.4g}'
                       for unit, value in zip(units, posture, strict=True))
    return f'({values}) {", ".join(dict.fromkeys(unit.position for unit in units))}'


def describe_spatial_links(arm: SpatialArm, payload_mass: float) -> list[str]:
    """Return masses, reach, coordinates and gravity of an arm, then a line per link."""
    mass = sum(link.mass for link in arm.links)
    place = f' at {_say(arm.payload_com)} m from the tip' if arm.payload_com.any() else ''
    if np.any(arm.payload_tensor):
        place += f', principal moments {say_moments(arm.payload_tensor)} kg m^2'
    count = len(arm.elastic_joints)
    twists = f'{count} twist{"s" if count > 1 else ""}, ' if count else ''
    lines = [f'mass: {mass:.4g} kg, payload {payload_mass:.4g} kg{place}',
             f'reach: at most {arm.reach:.4g} m from the first joint, slides aside, which is at '
             f'{_say(arm.base)} m; gravity {_say(arm.gravity)} m/s^2',
             f'coordinates: {arm.n_joints} joints, {twists}{arm.n_modes} modal', '']
    return [*lines, *(f'link {i}: {_describe_link(link)}' for i, link in enumerate(arm.links, 1))]


def describe_place(joint: SpatialJoint) -> str:
    """Return what a joint does about which axis."""
    return f'{"slides along" if joint.slides else "turns about"} {_say(joint.axis)}, '


def _describe_link(link: SpatialLink) -> str:
    """Return a link's properties in one line."""
    text = f'to {_say(link.end)} m, {link.mass:.4g} kg'
    if link.elements is not None:
        return text + _describe_elements(link.elements) + _describe_ends(link)
    if link.beam is None:
        return f'{text}, rigid{_describe_body(link.body)}'
    if not link.modes:
        return f'{text}, rigid beam of {link.beam.linear_density:.4g} kg/m'
    beam, (_, across, across2) = link.beam, link.axes().T
    parts = [f'{count} mode{"s" if count > 1 else ""} across along {_say(axis)} with EI '
             f'{rigidity:.4g} N m^2' for count, axis, rigidity in zip(
                 beam.modes, (across, across2), beam.flexural_rigidity, strict=True) if count]
    if beam.twist_modes:
        parts.append(f'{beam.twist_modes} of twisting with GJ {beam.torsional_rigidity:.4g} N m^2')
    damping = f', damping ratio {beam.damping_ratio:g}' if beam.damping_ratio else ''
    shortened = ', shortened by bending' if beam.foreshortening else ''
    return (f'{text}, beam of {beam.linear_density:.4g} kg/m, {beam.mode_family}: '
            f'{", ".join(parts)}{damping}{shortened}' + _describe_ends(link))


def _describe_elements(elements: ElementModes) -> str:
    """Return what a link of finite elements is."""
    modes = f'{elements.count} mode{"s" if elements.count > 1 else ""}'
    damping = f', damping ratio {elements.damping_ratio:g}' if elements.damping_ratio else ''
    factor = f', stiffness multiplied by {elements.factor:g}' if elements.factor != 1 else ''
    return f', {modes} of finite elements of {elements.body.mass:.4g} kg{factor}{damping}'


def _describe_ends(link: SpatialLink) -> str:
    """Return what a link that bends carries at its ends."""
    return ''.join(f', {body.mass:.4g} kg at its {name}' for name, body in (
        ('base', link.body), ('end', link.tip_body)) if body.mass)


def _describe_body(body: SpatialBody) -> str:
    """Return where a body's centre of mass is, and its principal moments."""
    if body.is_nothing:
        return ', without mass'
    return (f', centre of mass at {_say(body.center_of_mass)} m, principal moments '
            f'{say_moments(body.inertia)} kg m^2')


def say_moments(inertia: Matrix) -> str:
    """Return principal moments in words."""
    return ', '.join(f'{max(moment, 0.0):.3g}'
                     for moment in np.linalg.eigvalsh(np.array(inertia)))


def _say(values: object) -> str:
    """Return numbers in parentheses."""
    numbers = (0.0 if abs(value) < 1e-12 else float(value) for value in np.asarray(values))
    return f'({", ".join(f"{value:.4g}" for value in numbers)})'
