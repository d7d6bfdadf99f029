"""
Zarr groups on disk by either generation of the zarr library, 2 or 3.

Both write and read format 2 of the files, so that a map made with one opens with the other.

"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numcodecs
import zarr

_IS_NEW = not zarr.__version__.startswith('2.')
# a summary of all metadata may be older than what it sums up
_OPTIONS: dict[str, Any] = {'zarr_format': 2, 'use_consolidated': False} if _IS_NEW else {}
DIMENSIONS = '_ARRAY_DIMENSIONS'  # where xarray looks for them


def open_folder(path: Path, mode: str) -> Any:
    """Return the group that a folder holds; whatever zarr raises if it holds none."""
    return zarr.open_group(str(path), mode=mode, **_OPTIONS)


def add_array(group: Any, name: str, dimensions: list[str], *, shape: tuple[int, ...],
              chunks: tuple[int, ...], dtype: str, fill: float) -> None:
    """Make an array of numbers, of which nothing is written yet."""
    create = group.create_array if _IS_NEW else group.create_dataset
    made = create(name, shape=shape, chunks=chunks, dtype=dtype, fill_value=fill)
    made.attrs[DIMENSIONS] = dimensions


def add_bytes(group: Any, name: str, dimensions: list[str], *, shape: tuple[int, ...],
              chunks: tuple[int, ...]) -> None:
    """Make an array of bytes of any length, compressed well."""
    if _IS_NEW:
        from zarr.dtype import VariableLengthBytes

        made = group.create_array(
            name, shape=shape, chunks=chunks, dtype=VariableLengthBytes(),
            fill_value=b'', compressors=numcodecs.Blosc('zstd', 5, 0))
    else:
        made = group.create_dataset(
            name, shape=shape, chunks=chunks, dtype=object, object_codec=numcodecs.VLenBytes(),
            fill_value=None, compressor=numcodecs.Blosc('zstd', 5, 0))
    made.attrs[DIMENSIONS] = dimensions


def summarize(path: Path) -> None:
    """Write the summary of all metadata, from which others open the folder faster."""
    zarr.consolidate_metadata(str(path))
