"""The axes of a map with their units and bounds, and the tiles of its grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from types import MappingProxyType

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array, integer, number
from flex_planner.base.yaml_files import YamlSection
from flex_planner.optimal_control.task import MAX_DURATION, MAX_PAYLOAD
import numpy as np

Block = tuple[slice, ...]

MAX_AXES = 4
MAX_CELLS = 100_000_000
MAX_COORDINATE = 1e3
_TILE_CELLS, _LEAST_BLOCKS = 25, 4
_MAX_SCALE = 1e3
_MAX_LIMIT = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisKind:
    """
    What an axis changes.

    Attributes
    ----------
    title : str
        For people.
    unit : str
        Empty for a factor.
    above, at_least, at_most : float
        Open lower, closed lower and closed upper bound of its values.

    """

    title: str
    unit: str = ''
    above: float = -math.inf
    at_least: float = -math.inf
    at_most: float = math.inf


def _place(title: str) -> AxisKind:
    """Return a coordinate of the tip."""
    return AxisKind(title=title, unit='m', at_least=-MAX_COORDINATE, at_most=MAX_COORDINATE)


def _scale(title: str) -> AxisKind:
    """Return a factor."""
    return AxisKind(title=title, at_least=1 / _MAX_SCALE, at_most=_MAX_SCALE)


AXES: Mapping[str, AxisKind] = MappingProxyType({
    'goal_x': _place('x of the goal'),
    'goal_y': _place('y of the goal'),
    'goal_z': _place('z of the goal'),
    'start_x': _place('x of the start'),
    'start_y': _place('y of the start'),
    'start_z': _place('z of the start'),
    'duration': AxisKind(title='duration', unit='s', above=0, at_most=MAX_DURATION),
    'payload_mass': AxisKind(title='payload', unit='kg', at_least=0, at_most=MAX_PAYLOAD),
    'stiffness_scale': _scale('factor on the flexural rigidities'),
    'motor_scale': _scale('factor on the stall torques'),
    'velocity_weight': AxisKind(title='weight of the joint speeds', at_least=0, at_most=1e9),
    'payload_scale': AxisKind(title='carried payload over planned payload', at_least=0,
                              at_most=_MAX_SCALE),
    'limit_value': AxisKind(title='value of a limit on the way', at_least=-_MAX_LIMIT,
                            at_most=_MAX_LIMIT),
})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Axis:
    """
    One direction of a map.

    Parameters
    ----------
    name : str
        A key of `AXES`.
    values : array_like, shape (k,)
        Rising, within the bounds of `AXES`, in `unit`.

    Raises
    ------
    InvalidValueError
        Naming the axis, the value and its bound.

    """

    name: str
    values: Array

    def __post_init__(self) -> None:
        if self.name not in AXES:
            raise InvalidValueError('axes', self.name, one_of(self.name, AXES))
        object.__setattr__(self, 'values', _rising(f'axes.{self.name}', self.values))
        kind = AXES[self.name]
        # NaN is the least and the largest to numpy
        for place in (int(self.values.argmin()), int(self.values.argmax())):
            number(f'axes.{self.name}[{place}]', self.values[place], above=kind.above,
                   at_least=kind.at_least, at_most=kind.at_most, unit=kind.unit)

    @property
    def unit(self) -> str:
        """Return the unit of the values, empty for a factor."""
        return AXES[self.name].unit

    @property
    def title(self) -> str:
        """Return the axis in words."""
        return AXES[self.name].title


def _rising(field: str, values: object) -> Array:
    """Return a read-only copy of a list of rising numbers."""
    wanted = 'a list of rising numbers, or from, to and count'
    # numpy would take true for 1 and '1' for 1
    if not isinstance(values, np.ndarray) and (
            not isinstance(values, Sequence)
            or any(isinstance(entry, (bool, str, list, tuple, dict)) for entry in values)):
        raise InvalidValueError(field, values, wanted)
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(field, values, wanted) from None
    if array.ndim != 1 or not array.size:
        raise InvalidValueError(field, values, wanted)
    falls = np.flatnonzero(np.diff(array) <= 0)
    if falls.size:
        at = int(falls[0]) + 1
        raise InvalidValueError(f'{field}[{at}]', float(array[at]),
                                f'> {array[at - 1]:g}, the value before it')
    array.setflags(write=False)
    return array


def read_axes(section: YamlSection) -> tuple[Axis, ...]:
    """
    Return the axes of a study file, in its order.

    Raises
    ------
    InvalidValueError
        Naming the field, e.g. ``axes.goal_x.count``.

    """
    names = section.left()
    integer('number of axes', len(names), at_least=1, at_most=MAX_AXES)
    axes: list[Axis] = []
    for name in names:
        axes.append(_read_axis(section, name, math.prod(axis.values.size for axis in axes)))
    return tuple(axes)


def check_cells(cells: int) -> None:
    """Raise InvalidValueError if a map has too many cells."""
    if cells > MAX_CELLS:
        raise InvalidValueError('number of cells', cells, f'at most {MAX_CELLS}')


def _read_axis(section: YamlSection, name: str, cells: int) -> Axis:
    """Return an axis given as a list or as a range, after others with so many cells."""
    if name not in AXES:
        raise InvalidValueError(section.path, name, one_of(name, AXES))
    content = section.take(name)
    if not isinstance(content, Mapping):
        return Axis(name=name, values=content)
    part, kind = YamlSection(section.name(name), content), AXES[name]
    low = part.number('from', above=kind.above, at_least=kind.at_least, at_most=kind.at_most,
                      unit=kind.unit)
    high = part.number('to', above=low, at_most=kind.at_most, unit=kind.unit)
    count = integer(part.name('count'), part.take('count'), at_least=2, at_most=MAX_CELLS)
    part.finish()
    check_cells(cells * count)  # before they fill the memory
    return Axis(name=name, values=np.linspace(low, high, count, dtype=np.float64))


def tiles(shape: tuple[int, ...]) -> tuple[int, ...]:
    """
    Return a size of blocks: about 25 cells, and at least 4 blocks where there are 4 cells.

    They are as square as can be over the two longest axes and one cell along the others.

    """
    longest = sorted(range(len(shape)), key=lambda axis: -shape[axis])[:2]
    sides = [1] * len(shape)
    left = _TILE_CELLS
    for axis, power in zip(reversed(longest), (1 / len(longest), 1), strict=False):
        sides[axis] = _even_side(shape[axis], left**power)
        left = max(1, left // sides[axis])
    while _count(shape, sides) < min(_LEAST_BLOCKS, math.prod(shape)):
        widest = max(range(len(shape)), key=lambda axis: sides[axis])
        sides[widest] = -(-sides[widest] // 2)
    return tuple(sides)


def _even_side(length: int, side: float) -> int:
    """Return a side near to a wanted one that leaves no thin strip at the end."""
    return -(-length // max(1, round(length / side)))


def _count(shape: tuple[int, ...], sides: Sequence[int]) -> int:
    """Return the number of blocks."""
    return math.prod(-(-length // side) for length, side in zip(shape, sides, strict=True))
