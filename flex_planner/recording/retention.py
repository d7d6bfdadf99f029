"""
Removal of the oldest recordings of a folder, so that they do not fill the disk.

Only finished recordings are removed that look like those of one writer: a folder with a name that
it gives, and nothing in it but the files that it writes. Whoever renames a recording, or puts a
file into it, keeps it.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
import os
from pathlib import Path
import re
import secrets
import shutil


@dataclass(frozen=True, slots=True, kw_only=True)
class OldRecording:
    """
    A recording that may be removed.

    Attributes
    ----------
    path : Path
        Its folder.
    age : tuple of str
        What its name says of the time when it was made; sorts by that.
    size : int
        Of its files [bytes].

    """

    path: Path
    age: tuple[str, ...]
    size: int


def find_recordings(folder: Path, name: re.Pattern[str]) -> list[OldRecording]:
    """
    Return the finished recordings of a writer, the oldest first.

    Parameters
    ----------
    folder : Path
        Where they lie.
    name : re.Pattern
        Of their names; its groups sort by time.

    Raises
    ------
    OSError
        If the folder cannot be read.

    """
    found = []
    with os.scandir(folder) as entries:
        for entry in entries:
            match = name.fullmatch(entry.name)
            if match is None or not entry.is_dir(follow_symlinks=False):
                continue
            size = _own_size(Path(entry.path))
            if size is not None:
                found.append(OldRecording(path=Path(entry.path), age=match.groups(), size=size))
    return sorted(found, key=lambda recording: recording.age)


def remove_oldest(recordings: Iterable[OldRecording], kept: Path, *, most: int = 0,
                  most_bytes: int = 0) -> list[OldRecording]:
    """
    Remove the oldest recordings until the others are within bounds.

    Parameters
    ----------
    recordings : iterable of OldRecording
        The oldest first.
    kept : Path
        The newest, which stays in any case.
    most, most_bytes : int
        Recordings that may stay, and their size; 0: any.

    Returns
    -------
    list of OldRecording
        What was removed.

    Raises
    ------
    OSError
        If one cannot be removed; it then stays whole, and so do those after it.

    """
    left = list(recordings)
    count, size = len(left), sum(recording.size for recording in left)
    removed = []
    for recording in left:
        if not (most and count > most) and not (most_bytes and size > most_bytes):
            break
        if recording.path.name == kept.name:
            continue
        _remove(recording.path)
        removed.append(recording)
        count, size = count - 1, size - recording.size
    return removed


def _own_size(path: Path) -> int | None:
    """Return the size of a recording, None if it is not finished or holds what is not its own."""
    size, finished = 0, False
    try:
        with os.scandir(path) as entries:
            for entry in entries:
                own = re.fullmatch(rf'{re.escape(path.name)}_\d+\.mcap', entry.name)
                if not (own or entry.name == 'metadata.yaml'):
                    return None
                if not entry.is_file(follow_symlinks=False):
                    return None
                finished |= entry.name == 'metadata.yaml'
                size += entry.stat().st_size
    except OSError:  # another process removes it just now, or it is not ours to read
        return None
    return size if finished else None


def _remove(path: Path) -> None:
    """Remove a folder at once: no reader sees a part of it."""
    hidden = path.with_name(f'.{path.name}.{secrets.token_hex(8)}')
    try:
        path.rename(hidden)
    except FileNotFoundError:  # by another process
        return
    try:
        shutil.rmtree(hidden)
    except OSError:
        if (hidden / 'metadata.yaml').exists():
            hidden.rename(path)
        raise
