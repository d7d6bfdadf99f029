"""
A map on disk: a Zarr store that xarray opens, written block by block.

Chunks are the blocks, and the checksums of a block are written last: it counts as complete only if
they fit, whatever ended the program, or happened to the files since.

"""

from __future__ import annotations

from collections.abc import Sequence
import fcntl
import itertools
import os
from pathlib import Path
import tempfile
from types import TracebackType
from typing import Any, NoReturn, TYPE_CHECKING

from flex_planner.base.paths import expand_path
from flex_planner.maps.axes import Block
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.checksums import checksum
from flex_planner.maps.store_layout import (
    BESIDE,
    differences,
    metadata,
    MOTIONS,
    SUMS,
    write_empty,
)
from flex_planner.maps.stored_map import MapStoreError, open_group, StoredMap
import numpy as np
from numpy.typing import NDArray
import xarray as xr

if TYPE_CHECKING:
    from flex_planner.maps.study import Study


class MapStore:
    """
    The store of one study, locked against other writers until it is closed.

    Parameters
    ----------
    path : Path
        Of an existing store.

    Attributes
    ----------
    path : Path
        As given.
    codes : numpy.ndarray
        A `CellCode` for each cell; those of damaged blocks are pending.
    damaged : int
        How many blocks were written, and are not whole.

    Raises
    ------
    MapStoreError
        If it is no map, is damaged beyond its blocks, or another process writes it.

    """

    def __init__(self, path: Path) -> None:
        self.path = path = expand_path(path)
        self._lock = _lock_store(path)
        try:
            self._stored = StoredMap(path, 'r+')
            self.codes = self._stored.whole_codes()
            self.damaged = self._stored.count_written() - sum(
                self.is_complete(block) for block in self._stored.blocks())
        except BaseException:
            self.close()
            raise
        self._group, self._key = self._stored.group, self._stored.key

    @classmethod
    def create(cls, path: Path, study: Study) -> MapStore:
        """
        Return a new store, in which no cell is computed.

        Raises
        ------
        OSError
            If it cannot be written.

        """
        path = expand_path(path)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # complete or not there at all
            with tempfile.TemporaryDirectory(dir=path.parent, prefix=f'.{path.name}-') as scratch:
                write_empty(Path(scratch, 'new'), study)
                os.rename(Path(scratch, 'new'), path)
        except (OSError, KeyError) as error:  # zarr makes a KeyError of some
            _raise_named(error, path, 'the map is not created')
        return cls(path)

    @classmethod
    def of(cls, path: Path, study: Study, *, reset: bool = False) -> MapStore:
        """
        Return the store of a study: the existing one, or a new one.

        Parameters
        ----------
        path : Path
            Of the store.
        study : Study
            What it is for.
        reset : bool
            Whether to remove an existing map, of any study.

        Raises
        ------
        MapStoreError
            If the path holds something else.
        OSError
            If it cannot be written.

        """
        path = expand_path(path)
        if os.path.lexists(path):
            if not reset:
                return cls(path).check(study)
            _remove_map(path)
        return cls.create(path, study)

    def check(self, study: Study) -> MapStore:
        """
        Return the store itself, if it is that of a study and of this version.

        Raises
        ------
        MapStoreError
            Naming what differs.

        """
        found = differences(dict(self._group.attrs), metadata(study))
        for name, own, there in (('shape', study.shape, self.codes.shape),
                                 ('block', study.block_shape, self._stored.block_shape),
                                 ('keep_motions', study.keeps_motions,
                                  self._stored.keeps_motions)):
            if not found and own != there:
                found = [f'{name}: {own}, there {there}']
        if found:
            self.close()
            raise MapStoreError(f'{self.path} holds the map of another study or version ('
                                f'{"; ".join(found)}); choose another --output, or start '
                                'anew with --reset')
        self._restore_axes(study)
        return self

    def _restore_axes(self, study: Study) -> None:
        """Write the values of the axes again if they are damaged."""
        try:
            self._stored.coordinates()
        except MapStoreError:
            for axis in study.axes:
                self._group[axis.name][...] = axis.values
            self._group.attrs['axes_checksum'] = checksum(axis.values for axis in study.axes)

    def is_complete(self, block: Block) -> bool:
        """Return whether every cell of a block is done."""
        return bool((self.codes[block] != CellCode.PENDING).all())

    def write(self, block: Block, results: Sequence[CellResult]) -> None:
        """
        Write a block.

        Raises
        ------
        ValueError
            If the results are not those of its cells.
        OSError
            If it cannot be written; other blocks stay as they are.

        """
        if sorted(result.index for result in results) != cells(block):
            raise ValueError(f'{len(results)} results are not those of the block {block}')
        shape = tuple(part.stop - part.start for part in block)
        ordered = sorted(results, key=lambda result: result.index)
        columns = {name: _column(ordered, 'value' if name == self._key else name, shape,
                                 self._group[name].dtype) for name in (self._key, *BESIDE)}
        try:
            sum_of_motions = self._write_motions(block, ordered, shape)
            for name, values in columns.items():
                self._group[name][block] = values
            place = self._stored.place(block)
            self._group[SUMS][place] = [checksum(columns.values()), sum_of_motions]
        except (OSError, KeyError) as error:
            _raise_named(error, self.path, 'finished blocks are kept')
        self.codes[block] = columns['code']

    def _write_motions(self, block: Block, ordered: Sequence[CellResult],
                       shape: tuple[int, ...]) -> int:
        """Write what other motions may start from; return the checksum."""
        if MOTIONS not in self._group:
            return 0
        kept = self._group[MOTIONS]
        signatures = np.full((len(ordered), kept['signature'].shape[-1]), np.nan)
        motions = np.empty(len(ordered), dtype=object)
        for k, result in enumerate(ordered):
            motion = result.motion
            motions[k] = b'' if motion is None else motion.pack()
            if motion is not None:
                signatures[k] = motion.signature
        kept['signature'][block] = signatures.reshape(*shape, -1)
        kept['motion'][block] = motions.reshape(shape)
        return checksum((signatures, motions))

    def dataset(self) -> xr.Dataset:
        """Return the present contents, opened; read them before the next block is written."""
        return open_map(self.path)

    def close(self) -> None:
        """Let others write."""
        if self._lock >= 0:
            os.close(self._lock)
        self._lock = -1

    def __enter__(self) -> MapStore:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


def open_map(path: Path) -> xr.Dataset:
    """
    Return a map as a dataset in memory; cells of damaged blocks are as if they were pending.

    Raises
    ------
    MapStoreError
        If there is none, or it is damaged beyond its blocks.

    """
    stored = StoredMap(expand_path(path))
    coordinates, group = stored.coordinates(), stored.group
    variables = {name: (stored.axes, _decoded(name, values), _attributes(group[name]))
                 for name, values in stored.read().items()}
    return xr.Dataset(variables, {name: (name, values, _attributes(group[name]))
                                  for name, values in coordinates.items()}, dict(group.attrs))


def _decoded(name: str, values: NDArray[Any]) -> NDArray[Any]:
    """Return values with NaN for none, but whole numbers for codes: pending is one of them."""
    filler = BESIDE[name][1] if name in BESIDE else None
    if name == 'code' or filler is None or values.dtype.kind != 'i':
        return values
    return np.where(values == filler, np.nan, values)


def _attributes(array: Any) -> dict[str, Any]:
    """Return what an array says of itself to people."""
    return {name: value for name, value in dict(array.attrs).items() if not name.startswith('_')}


def _column(ordered: Sequence[CellResult], name: str, shape: tuple[int, ...],
            dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return one field of results."""
    values = np.empty(len(ordered), dtype=dtype if dtype.kind in 'if' else object)
    values[:] = [getattr(result, name) for result in ordered]
    return values.reshape(shape)


def cells(block: Block) -> list[tuple[int, ...]]:
    """Return the indices of a block in the order of the grid."""
    return list(itertools.product(*(range(part.start, part.stop) for part in block)))


def _lock_store(path: Path) -> int:
    """Return a descriptor that keeps other writers out while it is open."""
    open_group(path, 'r')
    descriptor = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise MapStoreError(f'{path} is being written by another process') from None
    except OSError:  # a file system without locks
        pass
    return descriptor


def _remove_map(path: Path) -> None:
    """Remove a map that nobody writes, whatever state it is in: all of it, or nothing."""
    lock = _lock_store(path)  # nothing but a map is removed
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f'.{path.name}-') as scratch:
            os.rename(path, Path(scratch, 'old'))
    except OSError as error:
        _raise_named(error, path, 'it cannot be removed')
    finally:
        if lock >= 0:
            os.close(lock)


def _raise_named(error: Exception, path: Path, consequence: str) -> NoReturn:
    """Raise OSError that names the store."""
    cause = error.__cause__ if isinstance(error, KeyError) else error
    number, text = (cause.errno, cause.strerror) if isinstance(cause, OSError) else (None, None)
    raise OSError(number or 0, f'{text or error}; {consequence}', str(path)) from error
