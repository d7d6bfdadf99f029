"""
A map on disk: a Zarr store that xarray opens, written block by block.

Chunks are the blocks, and the codes of a block are written last: a block counts as complete once
all its codes are there, whatever ended the program.

"""

from __future__ import annotations

from collections.abc import Sequence
import fcntl
import itertools
import os
from pathlib import Path
import shutil
import tempfile
from types import TracebackType
from typing import Any, NoReturn, TYPE_CHECKING

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.paths import expand_path
from flex_planner.maps.axes import Block
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.store_layout import BESIDE, differences, metadata, MOTIONS, write_empty
import numpy as np
from numpy.typing import NDArray
import xarray as xr
import zarr

if TYPE_CHECKING:
    from flex_planner.maps.study import Study


class MapStoreError(FlexPlannerError):
    """A store is no map, belongs to another study, or is in use."""


class MapStore:
    """
    The store of one study, locked against other writers until it is closed.

    Parameters
    ----------
    path : Path
        Of an existing store.

    Raises
    ------
    MapStoreError
        If it is no map, or another process writes it.

    """

    def __init__(self, path: Path) -> None:
        self.path = path = expand_path(path)
        self._group = open_group(path, 'r+')
        self._key: str = self._group.attrs['quantity']
        self._lock = _lock_store(path)
        self.codes = _readable_codes(self._group['code'])

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
            store = cls(path)
            if not reset:
                return store.check(study)
            try:
                shutil.rmtree(path)
            except OSError as error:
                _raise_named(error, path, 'it cannot be removed')
            finally:
                store.close()
        return cls.create(path, study)

    def check(self, study: Study) -> MapStore:
        """
        Return the store itself, if it is that of a study and of this version.

        Raises
        ------
        MapStoreError
            Naming what differs.

        """
        found = differences(self._group.attrs.asdict(), metadata(study))
        if not found and self.codes.shape != study.shape:
            found = [f'shape: {study.shape}, there {self.codes.shape}']
        if found:
            self.close()
            raise MapStoreError(f'{self.path} holds the map of another study or version ('
                                f'{"; ".join(found)}); choose another --output, or start '
                                'anew with --reset')
        return self

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
        try:
            self._write_motions(block, ordered, shape)
            for name in (self._key, *BESIDE):
                target = self._group[name]
                values = np.empty(len(ordered), dtype=target.dtype)
                values[:] = [getattr(result, 'value' if name == self._key else name)
                             for result in ordered]
                target[block] = values.reshape(shape)
        except OSError as error:
            _raise_named(error, self.path, 'finished blocks are kept')
        self.codes[block] = values.reshape(shape)

    def _write_motions(self, block: Block, ordered: Sequence[CellResult],
                       shape: tuple[int, ...]) -> None:
        """Write what other motions may start from."""
        if MOTIONS not in self._group:
            return
        kept = self._group[MOTIONS]
        signatures = np.full((len(ordered), kept['signature'].shape[-1]), np.nan)
        motions = np.empty(len(ordered), dtype=object)
        for k, result in enumerate(ordered):
            motion = result.motion
            motions[k] = np.zeros(0, np.float32) if motion is None else motion.pack()
            if motion is not None:
                signatures[k] = motion.signature
        kept['signature'][block] = signatures.reshape(*shape, -1)
        kept['motion'][block] = motions.reshape(shape)

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
    Return a map as a dataset, its values read when they are used.

    Raises
    ------
    MapStoreError
        If there is none.

    """
    path = expand_path(path)
    open_group(path, 'r')
    opened: xr.Dataset = xr.open_zarr(str(path), chunks=None)
    return opened


def open_group(path: Path, mode: str) -> Any:
    """
    Return the Zarr group of a map.

    Raises
    ------
    MapStoreError
        If there is none.

    """
    path = expand_path(path)
    if not path.exists():
        raise MapStoreError(f'there is no map {path}')
    try:
        group = zarr.open_group(str(path), mode=mode)
        if {'quantity', 'study', 'flex_planner_version'} <= set(group.attrs) and 'code' in group:
            return group
    except (ValueError, KeyError, FileNotFoundError, NotADirectoryError):
        pass  # what zarr says of a folder that is none of its own
    raise MapStoreError(f'{path} exists, but is not a map')


def cells(block: Block) -> list[tuple[int, ...]]:
    """Return the indices of a block in the order of the grid."""
    return list(itertools.product(*(range(part.start, part.stop) for part in block)))


def _lock_store(path: Path) -> int:
    """Return a descriptor that keeps other writers out while it is open."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise MapStoreError(f'{path} is being written by another process') from None
    except OSError:  # a file system without locks
        pass
    return descriptor


def _readable_codes(stored: Any) -> NDArray[np.int8]:
    """Return the codes; those of a damaged block as pending, so that it is computed again."""
    try:
        return np.asarray(stored[:])
    except (ValueError, RuntimeError):
        codes = np.zeros(stored.shape, dtype=np.int8)
    starts = (range(0, size, step) for size, step in zip(stored.shape, stored.chunks, strict=True))
    for corner in itertools.product(*starts):
        place = tuple(slice(start, start + step)
                      for start, step in zip(corner, stored.chunks, strict=True))
        try:
            codes[place] = stored[place]
        except (ValueError, RuntimeError):
            continue
    return codes


def _raise_named(error: Exception, path: Path, consequence: str) -> NoReturn:
    """Raise OSError that names the store."""
    cause = error.__cause__ if isinstance(error, KeyError) else error
    number, text = (cause.errno, cause.strerror) if isinstance(cause, OSError) else (None, None)
    raise OSError(number or 0, f'{text or error}; {consequence}', str(path)) from error
