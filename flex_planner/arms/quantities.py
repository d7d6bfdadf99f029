"""
Ranges of the quantities that describe an arm.

They are far wider than arms are, and narrow enough that no product or quotient of them leaves the
numbers that a computer has: a slip in the unit or the exponent is named instead of computed with.

"""

from __future__ import annotations

from collections.abc import Mapping
import math
from types import MappingProxyType
from typing import NamedTuple

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import number


class Range(NamedTuple):
    """Least magnitude of a quantity that must not vanish, the largest, and the unit."""

    least: float
    most: float
    unit: str


QUANTITIES: Mapping[str, Range] = MappingProxyType({
    'length': Range(1e-5, 1e4, 'm'),
    'mass': Range(1e-12, 1e9, 'kg'),
    'inertia': Range(1e-18, 1e12, 'kg m^2'),
    'linear_density': Range(1e-9, 1e6, 'kg/m'),
    'density': Range(1e-3, 1e6, 'kg/m^3'),
    'flexural_rigidity': Range(1e-15, 1e15, 'N m^2'),
    'youngs_modulus': Range(1.0, 1e15, 'N/m^2'),
    'width': Range(1e-7, 1e3, 'm'),
    'thickness': Range(1e-7, 1e3, 'm'),
    'diameter': Range(1e-7, 1e3, 'm'),
    'second_moment_of_area': Range(1e-30, 1e6, 'm^4'),
    'torque': Range(1e-12, 1e9, 'N m'),
    'stiffness': Range(1e-12, 1e15, 'N m/rad'),
    'gear_ratio': Range(1e-6, 1e6, ''),
    'speed': Range(1e-6, 1e6, 'rad/s'),
    'viscous_friction': Range(1e-18, 1e9, 'N m s/rad'),
    'angle': Range(0.0, 1e6, 'rad'),
    'gravity': Range(0.0, 1e3, 'm/s^2'),
})


def check_quantity(field: str, value: object, kind: str, *, above: float = -math.inf,
                   at_least: float = -math.inf, infinite: bool = False, note: str = '') -> float:
    """
    Return a value as a float within the range of its kind, or infinity where that is allowed.

    Parameters
    ----------
    field, note : str
        For the message: its name, and what is said after the unit.
    value : object
        Any real number but a bool.
    kind : str
        A key of `QUANTITIES`.
    above, at_least, infinite
        As of `number`.

    Raises
    ------
    InvalidValueError
        Naming field, value and bound.

    """
    limits = QUANTITIES[kind]
    result = number(field, value, above=above, at_least=at_least, infinite=infinite,
                    unit=f'{limits.unit}{note}')
    # next to nothing is harmless where nothing is
    least = limits.least if above == 0 else 0.0
    if math.isfinite(result) and not least <= abs(result) <= limits.most:
        lowest = least if least or at_least == 0 else -limits.most
        raise InvalidValueError(field, result, f'a number in the range {lowest:g} to '
                                               f'{limits.most:g} {limits.unit}'.rstrip())
    return result
