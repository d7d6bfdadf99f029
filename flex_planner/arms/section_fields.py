"""Cross sections and pieces of links in arm files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import math
from typing import Any

from flex_planner.arms.link import BeamSection
from flex_planner.arms.quantities import check_quantity
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.yaml_files import YamlSection


def read_quantity(section: YamlSection, key: str, kind: str = '', above: float = 0.0) -> float:
    """Return a quantity within its range."""
    return check_quantity(section.name(key), section.take(key), kind or key, above=above)


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """
    A piece of a link in physical quantities.

    Attributes
    ----------
    length : float
        [m].
    linear_density : float
        [kg/m].
    rigidity : float
        E I [N m^2]; infinite for a rigid piece.

    """

    length: float
    linear_density: float
    rigidity: float


def read_piece(section: YamlSection, bends: bool) -> Piece:
    """Return a piece of `length`; one that bends needs a rigidity unless it says ``rigid``."""
    length = read_quantity(section, 'length')
    piece = read_uniform(section, length, bends, rigid=section.flag('rigid', False))
    section.finish()
    return piece


def read_uniform(section: YamlSection, length: float, bends: bool, *,
                 rigid: bool = False) -> Piece:
    """Return a piece, or the uniform part of a link, of a length that was read before."""
    area, second_moment = _cross_section(section)
    density = _one_of(section, {
        'linear_density': lambda value: value, 'mass': lambda value: value / length,
        'density': lambda value: value * area}, {'mass': 'length', 'density': 'section'})
    rigidity = math.inf
    given = section.has('flexural_rigidity') or section.has('youngs_modulus')
    if not rigid and (bends or given):
        rigidity = _one_of(section, {
            'flexural_rigidity': lambda value: value,
            'youngs_modulus': lambda value: value * second_moment},
            {'youngs_modulus': 'second moment of area'})
    return Piece(length=length, linear_density=density, rigidity=rigidity)


def join_pieces(section: YamlSection, pieces: list[Piece]) -> dict[str, Any]:
    """
    Return the fields of `Link` that pieces make.

    The rigidity of the link is that of its softest piece.

    """
    length = sum(piece.length for piece in pieces)
    mass = sum(piece.length * piece.linear_density for piece in pieces)
    softest = min(piece.rigidity for piece in pieces)
    if not mass:
        raise InvalidValueError(section.name('sections'), 'no mass', 'at least one with mass')
    return {'length': length, 'linear_density': mass / length, 'flexural_rigidity': softest,
            'sections': tuple(
                BeamSection(share=piece.length / length,
                            density=piece.linear_density * length / mass,
                            rigidity=_ratio(piece.rigidity, softest)) for piece in pieces)}


def _ratio(rigidity: float, softest: float) -> float:
    """Return the rigidity of a piece in units of the softest."""
    return 1.0 if rigidity == softest else rigidity / softest


def _cross_section(section: YamlSection) -> tuple[float, float]:
    """Return area [m^2] and second moment [m^4] of the section; NaN where they are not given."""
    if section.has('section'):
        part = section.section('section')
        shape = next((one for one in _SHAPES if part.has(one)), 'width')
        values = _SHAPES[shape](part)
        part.finish()
        return values
    if section.has('second_moment_of_area'):
        return math.nan, read_quantity(section, 'second_moment_of_area')
    return math.nan, math.nan


def _rectangle(part: YamlSection) -> tuple[float, float]:
    width, thickness = read_quantity(part, 'width'), read_quantity(part, 'thickness')
    return width * thickness, width * thickness**3 / 12


def _rod(part: YamlSection) -> tuple[float, float]:
    diameter = read_quantity(part, 'diameter')
    return math.pi * diameter**2 / 4, math.pi * diameter**4 / 64


def _tube(part: YamlSection) -> tuple[float, float]:
    outer = read_quantity(part, 'outer_diameter', 'diameter')
    wall = read_quantity(part, 'wall', 'thickness')
    if wall > outer / 2:
        raise InvalidValueError(part.name('wall'), wall, f'at most {outer / 2:g} m, half of '
                                'outer_diameter')
    inner = outer - 2 * wall
    return math.pi * (outer**2 - inner**2) / 4, math.pi * (outer**4 - inner**4) / 64


_SHAPES: Mapping[str, Callable[[YamlSection], tuple[float, float]]] = {
    'width': _rectangle, 'outer_diameter': _tube, 'diameter': _rod}


def _one_of(section: YamlSection, conversions: Mapping[str, Callable[[float], float]],
            others: Mapping[str, str]) -> float:
    """
    Return a quantity that a file may give by several fields, but must give by one.

    It is the first of `conversions`; `others` are what it is computed from besides the given.

    """
    given = [name for name in conversions if section.has(name)]
    if len(given) != 1:
        raise InvalidValueError(section.name(' or '.join(conversions)),
                                ' and '.join(given) or None, 'given, exactly one of them'
                                f'{"" if given else section.misspelt(*conversions)}')
    result = conversions[given[0]](read_quantity(section, given[0]))
    if math.isnan(result):
        needs = 'section' if given[0] == 'density' else 'section or second_moment_of_area'
        raise InvalidValueError(section.name(needs), None, f'given with {given[0]}')
    kind = next(iter(conversions))
    name = f'{kind} (of {given[0]} and {others[given[0]]})' if given[0] in others else kind
    return check_quantity(section.name(name), result, kind, above=0)
