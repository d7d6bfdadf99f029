"""
Text files.

They are read as they come: through pipes, from editors of other systems, too large, or no text.
They are written whole or not at all.

"""

from __future__ import annotations

import codecs
from pathlib import Path
import secrets
import sys

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.paths import STANDARD_INPUT

MAX_BYTES = 1_000_000
# the longer marks first: that of UTF-32 begins like that of UTF-16
_MARKS = ((codecs.BOM_UTF8, 'utf-8-sig'), (codecs.BOM_UTF32_LE, 'utf-32'),
          (codecs.BOM_UTF32_BE, 'utf-32'), (codecs.BOM_UTF16_LE, 'utf-16'),
          (codecs.BOM_UTF16_BE, 'utf-16'))


class TextFileError(FlexPlannerError):
    """A file cannot be read as text; the message names it and says why."""


def read_text(path: Path) -> str:
    """
    Return the text of a file, of a pipe, or for the path ``-`` of the standard input.

    Raises
    ------
    TextFileError
        If it cannot be read, is empty, has more than a million bytes, or is no Unicode text.

    """
    try:
        data = _read_bytes(path)
        if len(data) > MAX_BYTES:
            raise OSError(f'it is larger than {MAX_BYTES} bytes')
        text = _decode(data)
    except OSError as error:
        raise TextFileError(f'{say_file(path)}: cannot be read: {error.strerror or error}') \
            from None
    if not text.strip():
        raise TextFileError(f'{say_file(path)}: cannot be read: it is empty')
    return text


def write_text(path: Path, text: str) -> None:
    """
    Write a text as UTF-8, in place of an older file only when it is complete.

    Halves of characters, which names of files may hold, are written as escapes.

    Raises
    ------
    OSError
        If it cannot be written.

    """
    # not the whole name, which may be as long as names can be
    draft = path.with_name(f'.{secrets.token_hex(8)}.partial')
    try:
        draft.write_text(text, encoding='utf-8', errors='backslashreplace')
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def say_file(path: Path) -> str:
    """Return the name of a file for messages."""
    return 'the standard input' if str(path) == STANDARD_INPUT else str(path)


def _read_bytes(path: Path) -> bytes:
    """Return at most one byte more than is allowed: a device may go on for ever."""
    if str(path) == STANDARD_INPUT:
        if sys.stdin is None or sys.stdin.closed:
            raise OSError('it is closed')
        return sys.stdin.buffer.read(MAX_BYTES + 1)
    if path.is_dir():
        raise OSError('it is a folder')
    with path.open('rb') as file:
        return file.read(MAX_BYTES + 1)


def _decode(data: bytes) -> str:
    """Return the text of a file that may begin with a byte order mark."""
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), 'utf-8')
    if 0 in data[:2] and data[:2] != b'\0\0':  # UTF-16 without a mark
        encoding = 'utf-16-be' if data[0] == 0 else 'utf-16-le'
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise OSError(f'it is no text in {encoding.upper()} (byte {error.start + 1} of '
                      f'{len(data)}); save it as UTF-8') from None
