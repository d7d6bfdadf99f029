"""The table of a spatial arm's links: bodies, and beams in their planes."""

from __future__ import annotations

from collections.abc import Iterable

from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_body import SpatialBody
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.reports.recording.report_table import (
    numbered_table,
    ReportTable,
    told_columns,
)
from flex_planner.reports.spatial_arm import say_moments
import numpy as np

# of the modes: first plane, second plane, twisting
_KINDS = ('across', 'across2', 'twist')


def spatial_links(arm: SpatialArm) -> ReportTable:
    """Return where links end, what they weigh and how they bend."""
    links = arm.links
    columns = {'end [m]': [_vector(link.end) for link in links],
               'mass [kg]': [f'{link.mass:.4g}' for link in links],
               'modes': [_modes(link) for link in links]}
    columns |= told_columns({
        'E I in both planes [N m²]': [_rigidity(link) for link in links],
        'G J [N m²]': [f'{link.beam.torsional_rigidity:g}'
                       if link.beam is not None and link.beam.twist_modes else ''
                       for link in links],
        'damping ratio': [f'{link.damping_ratios[0]:g}' if link.modes else '' for link in links],
        'body at its joint': [_body(link.body) for link in links],
        'body at its end': [_body(link.tip_body) for link in links],
        'payload': [''] * (len(links) - 1) + [_payload(arm)]})
    return numbered_table(f'Arm: {arm.name}', 'link', columns)


def _modes(link: SpatialLink) -> str:
    """Return how many modes of which kind."""
    if link.elements is not None:
        return f'{link.modes} of finite elements'
    if link.beam is None or not link.modes:
        return 'rigid'
    counts = (*link.beam.modes, link.beam.twist_modes)
    named = ', '.join(f'{count} {kind}' for kind, count in zip(_KINDS, counts, strict=True)
                      if count)
    return f'{named}, {link.beam.mode_family}'


def _rigidity(link: SpatialLink) -> str:
    """Return the rigidities of the planes in which a link bends."""
    if link.beam is None:
        return ''
    return ', '.join(f'{rigidity:g}' for rigidity, count in zip(
        link.beam.flexural_rigidity, link.beam.modes, strict=True) if count)


def _body(body: SpatialBody) -> str:
    """Return mass, centre of mass and principal moments of a body."""
    if body.is_nothing:
        return ''
    return (f'{body.mass:g} kg at {_vector(body.center_of_mass)} m, '
            f'{say_moments(body.inertia)} kg m²')


def _payload(arm: SpatialArm) -> str:
    """Return where the arm carries its payload, and its inertia if that is a tensor."""
    place = f'centre at {_vector(arm.payload_com)} m from the tip'
    moments = f'principal moments {say_moments(arm.payload_tensor)} kg m²'
    return ', '.join(text for text, is_there in (
        (place, arm.payload_com.any()), (moments, np.any(arm.payload_tensor))) if is_there)


def _vector(values: Iterable[float]) -> str:
    """Return three numbers in parentheses, without the sign of a zero."""
    return f'({", ".join(f"{value + 0.0:.4g}" for value in values)})'
