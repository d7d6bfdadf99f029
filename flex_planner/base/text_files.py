"""Text files that appear whole or not at all."""

from __future__ import annotations

from pathlib import Path
import secrets


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
