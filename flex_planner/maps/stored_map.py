"""
What a store of a map holds, read with distrust: disks fill up, copies break off, files get lost.

A block counts if the checksums that were written after it fit to all that is read of it. What does
not fit is not computed yet. A store that lacks a whole array, or whose metadata are damaged, is
refused in one sentence.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.paths import expand_path
from flex_planner.base.validation import Array
from flex_planner.maps.axes import Block
from flex_planner.maps.checksums import as_bytes, checksum
from flex_planner.maps.store_layout import BESIDE, LAYOUT, MOTIONS, SIGNATURES, SUMS, TEXTS
from flex_planner.maps.zarr_groups import DIMENSIONS, open_folder
import numpy as np
from numpy.typing import NDArray

# the entries of a block's sums
OF_NUMBERS, OF_MOTIONS = 0, 1
_NO_SUM = -1
_KEPT = {'quantity', 'study', 'arm', 'flex_planner_version'}
_ADVICE = 'restore it from a copy, or compute the map anew with --reset'


class MapStoreError(FlexPlannerError):
    """A store is no map, is damaged, belongs to another study, or is in use."""


class StoredMap:
    """
    An opened store.

    Parameters
    ----------
    path : Path
        Of the store.
    mode : str
        ``'r'``, or ``'r+'`` to write, too.

    Attributes
    ----------
    group : zarr.Group
        For what is not checked.
    key : str
        Of the quantity.
    axes : tuple of str
        Names of the dimensions.
    shape, block_shape : tuple of int
        Of the grid, and of its blocks.

    Raises
    ------
    MapStoreError
        If there is no map, its layout is that of another version, or it is damaged so that
        nothing of it can be used.

    """

    def __init__(self, path: Path, mode: str = 'r') -> None:
        self.path = path = expand_path(path)
        self.group = open_group(path, mode)
        self.key = str(self.group.attrs['quantity'])
        layout = self.group.attrs.get('layout')
        if layout != LAYOUT:
            raise MapStoreError(
                f'the map {path} was written by another version of flex_planner (layout '
                f'{layout or 1} of the store, this one has {LAYOUT}): xarray reads its numbers; '
                'to go on with it, or to draw it, compute it anew with --reset')
        code = self._array('code')
        self.shape, self.block_shape = tuple(code.shape), tuple(code.chunks)
        self.axes = tuple(str(name) for name in code.attrs[DIMENSIONS])
        self._check_arrays()

    @property
    def keeps_motions(self) -> bool:
        """Return whether there is room for motions."""
        return (self.path / MOTIONS).exists()

    def blocks(self) -> list[Block]:
        """Return the blocks of the grid in its order."""
        sides = [[slice(first, min(first + side, size)) for first in range(0, size, side)]
                 for size, side in zip(self.shape, self.block_shape, strict=True)]
        return list(product(*sides))

    def place(self, block: Block) -> tuple[int, ...]:
        """Return the index of a block among blocks."""
        return tuple(part.start // side
                     for part, side in zip(block, self.block_shape, strict=True))

    def names(self) -> tuple[str, ...]:
        """Return the variables of a cell, its code last."""
        return (self.key, *BESIDE)

    def coordinates(self) -> dict[str, Array]:
        """
        Return the values of the axes.

        Raises
        ------
        MapStoreError
            If they are damaged.

        """
        found = {}
        for name in self.axes:
            values = _read(self.group[name], (slice(None),))
            if values is None or not np.isfinite(values).all():
                raise MapStoreError(_damaged(self.path, f'the axis {name} cannot be read'))
            found[name] = values
        if checksum(found.values()) != self.group.attrs.get('axes_checksum'):
            raise MapStoreError(_damaged(self.path, 'the values of its axes are not those that '
                                                    'were written'))
        return found

    def read(self) -> dict[str, NDArray[Any]]:
        """Return the variables of all cells; where a block is not whole, those of none."""
        found = {name: self._empty(name) for name in self.names()}
        for block, values in self._whole_blocks():
            for name in found:
                found[name][block] = values[name]
        return found

    def whole_codes(self) -> NDArray[np.int8]:
        """Return the codes of blocks of which all is whole, motions too; others are pending."""
        codes = np.zeros(self.shape, dtype=np.int8)
        motions = self.group[MOTIONS] if self.keeps_motions else None
        for block, values in self._whole_blocks():
            if motions is None or self.motions_of(block) is not None:
                codes[block] = values['code']
        return codes

    def count_written(self) -> int:
        """Return the number of blocks that something was written of."""
        sums, codes = _source(self.group[SUMS]), _source(self.group['code'])
        written = 0
        for block in self.blocks():
            code, own = _read(codes, block), self._sums(sums, block)
            written += bool(code is None or own is None or (own != _NO_SUM).any() or code.any())
        return written

    def signatures(self) -> Array:
        """Return the signatures of all motions; NaN where they cannot be read."""
        stored = self.group[MOTIONS]['signature']
        found, source = np.full(stored.shape, np.nan), _source(stored)
        for block in self.blocks():
            values = _read(source, block)
            if values is not None:
                found[block] = values
        return found

    def motions_of(self, block: Block) -> tuple[Array, NDArray[np.object_]] | None:
        """Return signatures and packed motions of a block, None if they are not whole."""
        group = self.group[MOTIONS]
        signatures, motions = (_read(group[name], block) for name in ('signature', 'motion'))
        own = self._sums(self.group[SUMS], block)
        if signatures is None or motions is None or own is None:
            return None
        motions = _of_bytes(motions)
        if checksum((signatures, motions)) != own[OF_MOTIONS]:
            return None
        return signatures, motions

    def _whole_blocks(self) -> Iterator[tuple[Block, dict[str, NDArray[Any]]]]:
        """Yield the blocks whose numbers are whole, with them."""
        columns = {name: _source(self.group[name]) for name in self.names()}
        sums = _source(self.group[SUMS])
        for block in self.blocks():
            own = self._sums(sums, block)
            if own is None or own[OF_NUMBERS] == _NO_SUM:
                continue
            values = {name: _read(column, block) for name, column in columns.items()}
            known = {name: value for name, value in values.items() if value is not None}
            if len(known) == len(values) and checksum(known.values()) == own[OF_NUMBERS]:
                yield block, known

    def _sums(self, sums: Any, block: Block) -> NDArray[Any] | None:
        """Return the checksums of a block, None if they cannot be read."""
        return _read(sums, self.place(block))

    def _empty(self, name: str) -> NDArray[Any]:
        """Return what stands for cells that are not computed."""
        if name in TEXTS:
            return np.full(self.shape, '', dtype=object)
        kind, filler, _ = BESIDE.get(name, (float, np.nan, {}))
        return np.full(self.shape, filler, dtype=kind)

    def _check_arrays(self) -> None:
        """Refuse a store that lacks an array, or has one of another kind."""
        if len(self.axes) != len(self.shape):
            raise MapStoreError(_damaged(self.path, 'the names of its axes are missing'))
        for name in self.names():
            wanted = None if name in TEXTS else np.dtype(BESIDE.get(name, (float,))[0])
            self._check(name, self.shape, self.block_shape, wanted)
        for name, size in zip(self.axes, self.shape, strict=True):
            self._check(name, (size,), None, np.dtype(float))
        counts = tuple(-(-size // side)
                       for size, side in zip(self.shape, self.block_shape, strict=True))
        self._check(SUMS, (*counts, 2), None, np.dtype(np.int64))
        if self.keeps_motions:
            self._check(f'{MOTIONS}/motion', self.shape, self.block_shape, None)
            shape = (*self.shape, len(self._fields_of_signatures()))
            self._check(f'{MOTIONS}/signature', shape, None, np.dtype(float))

    def _check(self, name: str, shape: tuple[int, ...], chunks: tuple[int, ...] | None,
               dtype: np.dtype[Any] | None) -> None:
        """Refuse an array that is missing, or not what was made."""
        array = self._array(name)
        if (tuple(array.shape) != shape or (chunks and tuple(array.chunks) != chunks)
                or (dtype is not None and array.dtype != dtype)):
            raise MapStoreError(_damaged(self.path, f'the metadata of its array {name} are not '
                                                    'those that were written'))

    def _array(self, name: str) -> Any:
        """Return an array of the store."""
        try:
            array = self.group[name]
            if hasattr(array, 'chunks') and DIMENSIONS in dict(array.attrs):
                return array
        except Exception:  # zarr raises whatever the parser of its metadata does
            pass
        there = (self.path / name).exists()
        raise MapStoreError(_damaged(self.path, f'the metadata of its array {name} cannot be read'
                                     if there else f'its array {name} is missing'))

    def _fields_of_signatures(self) -> list[str]:
        """Return the quantities that signatures of motions consist of."""
        try:
            fields = self.group[MOTIONS].attrs[SIGNATURES]
        except Exception:  # as above
            fields = None
        if not isinstance(fields, list):
            raise MapStoreError(_damaged(self.path, 'it does not say what it keeps of motions'))
        return fields


def open_group(path: Path, mode: str) -> Any:
    """
    Return the Zarr group of a map, of any layout.

    Raises
    ------
    MapStoreError
        If there is none.

    """
    if not path.exists():
        raise MapStoreError(f'there is no map {path}')
    try:
        group = open_folder(path, mode)
        missing = _KEPT - set(group.attrs)
    except Exception:  # zarr says all sorts of things of what is none of its own
        missing = _KEPT
    if missing:
        raise MapStoreError(f'{path} exists, but is not a map, or its metadata are lost: choose '
                            'another place, or remove it yourself')
    return group


def _damaged(path: Path, what: str) -> str:
    """Return the sentence of a store that cannot be used."""
    return f'the map {path} is damaged, {what}: {_ADVICE}'


def _source(stored: Any) -> Any:
    """Return all of an array at once; if that fails, the array, to be read block by block."""
    values = _read(stored, (slice(None),))
    return stored if values is None else values


def _read(source: Any, block: Sequence[int | slice]) -> NDArray[Any] | None:
    """Return a part of an array, None if it cannot be read."""
    try:
        values = np.asarray(source[tuple(block)])
    except Exception:  # each codec has its own for bytes that it did not write
        return None
    return values if values.dtype.kind in 'iuf' else np.asarray(values, dtype=object)


def _of_bytes(motions: NDArray[Any]) -> NDArray[np.object_]:
    """Return packed motions, nothing where none was written."""
    found = np.empty(motions.shape, dtype=object)
    for index, entry in np.ndenumerate(motions):
        found[index] = as_bytes(entry)
    return found
