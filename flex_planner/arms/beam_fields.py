"""Beams in space and bodies as arm files say them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import math
from typing import Any

from flex_planner.arms.quantities import check_quantity
from flex_planner.arms.section_fields import read_quantity
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import SpatialBody
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import number
from flex_planner.base.yaml_files import YamlSection

# where none is given: that of steel and aluminium, about
POISSONS_RATIO = 0.3
_PLANES = ('across', 'across2')


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossSection:
    """
    A cross section.

    Attributes
    ----------
    area : float
        [m^2].
    seconds : tuple of float
        Second moments for bending in the first and the second plane [m^4].
    torsion : float
        Torsion constant [m^4].

    """

    area: float
    seconds: tuple[float, float]
    torsion: float


def read_body(section: YamlSection) -> SpatialBody:
    """Return a rigid body."""
    body: SpatialBody = section.build(
        SpatialBody, mass=section.take('mass'),
        center_of_mass=section.take('center_of_mass', (0.0, 0.0, 0.0)),
        inertia=section.take('inertia', (0.0, 0.0, 0.0)))
    return body


def read_beam(section: YamlSection, length: float, mass: float) -> SpatialBeam:
    """
    Return a beam of a length [m].

    Parameters
    ----------
    section : YamlSection
        Of the link.
    length : float
        From its joint to its end.
    mass : float
        Of the beam where the file gives none [kg]; 0 where it must.

    """
    modes, twists = _modes(section)
    shape, modulus = _section(section), _modulus(section)
    density = _density(section, length, mass, shape)
    values: dict[str, Any] = {
        'linear_density': density, 'modes': modes, 'twist_modes': twists,
        'flexural_rigidity': _rigidities(section, modes, shape, modulus),
        'damping_ratio': section.take('damping_ratio', 0.0),
        'foreshortening': section.flag('foreshortening', False),
        'mode_family': section.take('mode_family', 'clamped_mass' if section.has('shape_mass')
                                    else 'clamped_free')}
    for name in ('shape_mass', 'shape_inertia', 'shape_twist_inertia'):
        values[name] = section.take(name, 0.0)
    if section.has('across'):
        values['across'] = section.take('across')
    values['torsional_rigidity'] = _torsion(section, twists, shape, modulus)
    values['polar_inertia'] = section.take('polar_inertia') if section.has('polar_inertia') else (
        0.0 if shape is None else density * sum(shape.seconds) / shape.area)
    beam: SpatialBeam = section.build(SpatialBeam, **values)
    return beam


def is_beam(section: YamlSection) -> bool:
    """Return whether a link is described as a beam."""
    return section.has('modes') or section.has('section') or section.has('flexural_rigidity')


def _modes(section: YamlSection) -> tuple[tuple[int, int], int]:
    """Return how many modes of bending in each plane, and of twisting, a file asks for."""
    part = section.section('modes', {})
    counts = [part.take(name, 0) for name in (*_PLANES, 'twist')]
    part.finish()
    return (counts[0], counts[1]), counts[2]


def _density(section: YamlSection, length: float, mass: float,
             shape: CrossSection | None) -> float:
    """Return the mass per length."""
    given = [name for name in ('linear_density', 'mass', 'density') if section.has(name)]
    if len(given) > 1 or not (given or mass):
        raise InvalidValueError(section.name('linear_density or mass or density'),
                                ' and '.join(given) or None, 'given, exactly one of them')
    if not given:
        return mass / length
    value = read_quantity(section, given[0])
    if given[0] == 'density' and shape is None:
        raise InvalidValueError(section.name('section'), None, 'given with density')
    area = 0.0 if shape is None else shape.area
    return {'linear_density': value, 'mass': value / length, 'density': value * area}[given[0]]


def _modulus(section: YamlSection) -> float:
    """Return Young's modulus, NaN if it is not given [N/m^2]."""
    return (read_quantity(section, 'youngs_modulus') if section.has('youngs_modulus')
            else math.nan)


def _rigidities(section: YamlSection, modes: tuple[int, int], shape: CrossSection | None,
                modulus: float) -> tuple[float, float]:
    """Return E I in both planes."""
    if section.has('flexural_rigidity'):
        given = section.take('flexural_rigidity')
        pair = given if isinstance(given, list) else [given, given]
        if len(pair) != 2:
            raise InvalidValueError(section.name('flexural_rigidity'), given,
                                    'one number, or two, one per plane')
        first, second = (check_quantity(section.name(f'flexural_rigidity[{i}]'), one,
                                        'flexural_rigidity', above=0)
                         for i, one in enumerate(pair))
        return first, second
    if not any(modes):
        return math.inf, math.inf
    if shape is None or math.isnan(modulus):
        raise InvalidValueError(
            section.name('flexural_rigidity, or section and youngs_modulus'), None,
            'given for a link that bends')
    return modulus * shape.seconds[0], modulus * shape.seconds[1]


def _torsion(section: YamlSection, twists: int, shape: CrossSection | None,
             modulus: float) -> float:
    """Return G J_t; infinite where nothing twists."""
    ratio = number(section.name('poissons_ratio'),
                   section.take('poissons_ratio', POISSONS_RATIO), above=-1, at_most=0.5)
    shear = modulus / (2 * (1 + ratio))
    if section.has('shear_modulus'):
        shear = check_quantity(section.name('shear_modulus'), section.take('shear_modulus'),
                               'youngs_modulus', above=0)
    if section.has('torsional_rigidity'):
        return check_quantity(section.name('torsional_rigidity'),
                              section.take('torsional_rigidity'), 'flexural_rigidity', above=0)
    if not twists:
        return math.inf
    if shape is None or math.isnan(shear):
        raise InvalidValueError(
            section.name('torsional_rigidity, or section and youngs_modulus'), None,
            'given for a link that twists')
    return shear * shape.torsion


def _section(section: YamlSection) -> CrossSection | None:
    """Return the cross section, if it is given."""
    if not section.has('section'):
        return None
    part = section.section('section')
    shape = next((one for one in _SHAPES if part.has(one)), 'width')
    found = _SHAPES[shape](part)
    part.finish()
    return found


def _rectangle(part: YamlSection) -> CrossSection:
    """Return a rectangle, which bends across its thickness in the first plane."""
    width, thickness = read_quantity(part, 'width'), read_quantity(part, 'thickness')
    long, short = max(width, thickness), min(width, thickness)
    slim = short / long
    # Saint-Venant's series to better than 0.5 %
    torsion = long * short**3 * (1 / 3 - 0.21 * slim * (1 - slim**4 / 12))
    return CrossSection(area=width * thickness, torsion=torsion,
                        seconds=(width * thickness**3 / 12, thickness * width**3 / 12))


def _round(outer: float, inner: float) -> CrossSection:
    """Return a rod or a tube of two diameters."""
    second = math.pi * (outer**4 - inner**4) / 64
    return CrossSection(area=math.pi * (outer**2 - inner**2) / 4, seconds=(second, second),
                        torsion=2 * second)


def _rod(part: YamlSection) -> CrossSection:
    return _round(read_quantity(part, 'diameter'), 0.0)


def _tube(part: YamlSection) -> CrossSection:
    outer = read_quantity(part, 'outer_diameter', 'diameter')
    wall = read_quantity(part, 'wall', 'thickness')
    if wall > outer / 2:
        raise InvalidValueError(part.name('wall'), wall, f'at most {outer / 2:g} m, half of '
                                'outer_diameter')
    return _round(outer, outer - 2 * wall)


_SHAPES: Mapping[str, Callable[[YamlSection], CrossSection]] = {
    'width': _rectangle, 'outer_diameter': _tube, 'diameter': _rod}
