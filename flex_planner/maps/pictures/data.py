"""The contents of a map for its pictures, read from its store."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import itertools
import math

from flex_planner.base.validation import Array
from flex_planner.maps.cell_results import CellCode
import numpy as np
from numpy.typing import NDArray
import xarray as xr

_MILLI = 1e3
_LISTED = 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapAxis:
    """
    An axis of a map.

    Attributes
    ----------
    name, title, unit : str
        In the store; in words; empty for a factor.
    values : numpy.ndarray, shape (k,)
        Of its cells.

    """

    name: str
    title: str
    unit: str
    values: Array

    @property
    def label(self) -> str:
        """Return the title with the unit."""
        return f'{self.title} [{self.unit}]' if self.unit else self.title

    def at(self, *places: int) -> str:
        """Return some of its values in words, such as ``duration 1, 2 s``."""
        numbers = [f'{self.values[place]:.4g}' for place in places]
        if len(numbers) > _LISTED:
            numbers[_LISTED // 2:-1] = ['...']
        return f'{self.title} {", ".join(numbers)} {self.unit}'.rstrip()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapData:
    """
    A map as its pictures need it, of d axes.

    Attributes
    ----------
    name, key, quantity, unit : str
        Of the study; of the quantity in the store; in words; of `values`.
    axes : tuple of MapAxis
        d of them.
    values : numpy.ndarray
        Of the quantity, an axis each; NaN unless solved.
    codes : numpy.ndarray
        A `CellCode` each, of the same shape.
    kinds : mapping of int to str
        What the codes mean, in a few words.

    """

    name: str
    key: str
    quantity: str
    unit: str
    axes: tuple[MapAxis, ...]
    values: Array
    codes: NDArray[np.int8]
    kinds: Mapping[int, str]

    @classmethod
    def of(cls, dataset: xr.Dataset) -> MapData:
        """Return a map from its opened store."""
        key = str(dataset.attrs['quantity'])
        code, value = dataset['code'], dataset[key]
        axes = tuple(_axis(dataset, str(name)) for name in code.dims)
        # before the values, which may be written at this moment: codes come last
        codes = np.asarray(code.values, dtype=np.int8)
        unit = str(value.attrs.get('units', ''))
        factor, shown = (_MILLI, 'mm') if unit == 'm' else (1.0, unit)
        values = np.where(codes == CellCode.SOLVED, value.values * factor, np.nan)
        return cls(
            name=str(dataset.attrs.get('title', '')), key=key, unit=_pretty(shown), axes=axes,
            quantity=str(value.attrs.get('long_name', key.replace('_', ' '))), values=values,
            codes=codes, kinds=_kinds(code))

    @property
    def progress(self) -> str:
        """Return the progress of a map that is not finished, otherwise an empty text."""
        done, total = int((self.codes != CellCode.PENDING).sum()), self.codes.size
        if done == total:
            return ''
        # never 100%, which would say that it is finished
        percent = math.floor(100 * done / total)
        return f'not finished: {done} of {total} cells, {percent}%'

    @property
    def label(self) -> str:
        """Return the quantity in words with its unit."""
        return f'{self.quantity} [{self.unit}]' if self.unit else self.quantity

    def places(self, *names: str) -> tuple[int, ...]:
        """Return the numbers of axes; nothing for those that it has not."""
        found = {axis.name: place for place, axis in enumerate(self.axes)}
        return tuple(found[name] for name in names if name in found)

    def varied_axes(self) -> list[int]:
        """Return the numbers of the axes with more than one value."""
        return [place for place, axis in enumerate(self.axes) if axis.values.size > 1]

    def cut(self, keep: Sequence[int],
            fixed: Mapping[int, int]) -> tuple[Array, NDArray[np.int8]]:
        """Return values and codes along some axes, in that order, all others fixed."""
        index = tuple(fixed.get(place, slice(None)) for place in range(len(self.axes)))
        order = [sorted(keep).index(place) for place in keep]
        return self.values[index].transpose(order), self.codes[index].transpose(order)

    def at(self, fixed: Mapping[int, int]) -> str:
        """Return fixed values in words."""
        return ', '.join(self.axes[place].at(k) for place, k in fixed.items())

    def best(self, values: Array) -> int:
        """Return the place of the best of some values, flat and not all NaN."""
        pick = np.nanargmax if self.key.startswith('max') else np.nanargmin
        return int(pick(values))


def combinations(data: MapData, others: list[int],
                 most: int) -> tuple[list[dict[int, int]], list[str]]:
    """
    Return the combinations of values of some axes, and what was left out to keep them few.

    Parameters
    ----------
    data : MapData
        The map.
    others : list of int
        Numbers of the axes.
    most : int
        Combinations at most, evenly chosen.

    """
    counts = {place: data.axes[place].values.size for place in others}
    while math.prod(counts.values()) > most:
        counts[max(counts, key=lambda place: counts[place])] -= 1
    chosen = {place: spread(data.axes[place].values.size, count)
              for place, count in counts.items()}
    omitted = [data.axes[place].at(*(k for k in range(data.axes[place].values.size)
                                     if k not in chosen[place]))
               for place in others if len(chosen[place]) < data.axes[place].values.size]
    combined = [dict(zip(others, values, strict=True))
                for values in itertools.product(*chosen.values())]
    return combined, omitted


def spread(size: int, count: int) -> list[int]:
    """Return evenly spread places, both ends included."""
    return sorted(set(np.linspace(0, size - 1, min(count, size)).round().astype(int).tolist()))


def _axis(dataset: xr.Dataset, name: str) -> MapAxis:
    """Return an axis of the store."""
    coordinate = dataset[name]
    unit = str(coordinate.attrs.get('units', ''))
    return MapAxis(name=name, unit=_pretty('' if unit == '1' else unit),
                   title=str(coordinate.attrs.get('long_name', name.replace('_', ' '))),
                   values=np.asarray(coordinate.values, dtype=float))


def _kinds(code: xr.DataArray) -> dict[int, str]:
    """Return the meanings of the codes."""
    own = {int(kind): kind.name.lower() for kind in CellCode}
    names = str(code.attrs.get('flag_meanings', '')).split()
    stored = dict(zip(np.atleast_1d(code.attrs.get('flag_values', [])).tolist(), names,
                      strict=False))
    return {int(number): name.replace('_', ' ').lower()
            for number, name in {**own, **stored}.items()}


def _pretty(unit: str) -> str:
    """Return a unit with raised numbers."""
    return unit.replace('^2', '²').replace('^3', '³')
