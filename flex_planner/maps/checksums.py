"""Checksums of blocks of a map, over values rather than files: a copy by xarray keeps them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
import zlib

import numpy as np
from numpy.typing import NDArray


def checksum(columns: Iterable[NDArray[Any]]) -> int:
    """Return the CRC-32 of arrays of numbers, texts or bytes, their order included."""
    total = 0
    for column in columns:
        total = zlib.crc32(_plain(column), total)
    return total


def _plain(column: NDArray[Any]) -> bytes:
    """Return the values of an array as bytes that are the same on every machine."""
    if column.dtype.kind in 'iu':
        return column.astype('<i8').tobytes()
    if column.dtype.kind == 'f':
        values = column.astype('<f8')
        values[np.isnan(values)] = np.nan  # there are many kinds of it
        return values.tobytes()
    entries = [as_bytes(entry) for entry in column.ravel()]
    return b''.join(len(entry).to_bytes(8, 'little') + entry for entry in entries)


def as_bytes(entry: object) -> bytes:
    """Return a text or bytes as bytes; none where nothing was written."""
    return entry if isinstance(entry, bytes) else str(entry or '').encode()
