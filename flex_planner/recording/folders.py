"""The files of a recording's folder, of ours or of rosbag2 and others."""

from __future__ import annotations

import logging
import os
from pathlib import Path, PurePosixPath
import re
from typing import Final

from flex_planner.base.errors import RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.recording.topics import parse_yaml

PART: Final = re.compile(r'(.+)_(\d+)\.mcap')
OTHER_KINDS: Final = {
    '.zstd': 'is compressed as a whole: unpack it with zstd -d first',
    '.db3': "is of rosbag2's other kind, SQLite: convert it with ros2 bag convert first",
    '.bag': 'is a bag of ROS 1: convert it with rosbags-convert first'}

_LOG = logging.getLogger(__name__)


def recording_files(path: Path | str, *, complete: bool = True) -> list[Path]:
    """
    Return the .mcap files of a recording in their order.

    Parameters
    ----------
    path : path
        The folder or a file.
    complete : bool
        Whether all files must be there that a metadata.yaml lists.

    Raises
    ------
    RecordingError
        If a folder has none, or some that are not the parts of one recording.

    """
    path = expand_path(path)
    if not path.is_dir():
        return [path]
    try:
        names = sorted(entry.name for entry in path.iterdir())
    except OSError as error:
        raise RecordingError(f'cannot read {path}: {error.strerror or error}') from error
    found = {name for name in names if name.endswith('.mcap')}
    listed = _listed_files(path / 'metadata.yaml')
    missing = [name for name in listed if name not in found]
    if complete and missing and found:
        raise RecordingError(f'{path} lacks {", ".join(missing)}, which its metadata.yaml lists')
    order = _in_order(found) or [name for name in listed if name in found]
    if not order:
        raise RecordingError(_say_kinds(path, names, len(found)))
    for name in sorted(found.difference(order)):
        _LOG.warning('%s is left out: %s does not list it', path / name, 'metadata.yaml')
    return [path / name for name in order]


def shown_path(path: Path | str) -> str:
    """Return a path as text that UTF-8 can hold, what is not of it replaced."""
    return os.fsencode(path).decode(errors='replace')


def _in_order(names: set[str]) -> list[str]:
    """Return the one file that there is, or the parts of one recording, or nothing."""
    if len(names) < 2:
        return list(names)
    parts = {name: PART.fullmatch(name) for name in names}
    order = sorted(names, key=lambda name: int(part[2]) if (part := parts[name]) else -1)
    first = parts[order[0]]
    expected = [f'{first[1]}_{i}.mcap' for i in range(len(order))] if first else []
    return order if order == expected else []


def _listed_files(file: Path) -> list[str]:
    """Return the names of the files that a metadata.yaml lists, none where it cannot be read."""
    try:
        content = parse_yaml(file.read_text(encoding='utf-8'))
    except FileNotFoundError:
        return []
    except (OSError, UnicodeDecodeError) as error:
        _LOG.warning('%s cannot be read, the files beside it are: %s', file, error)
        return []
    known = content.get('rosbag2_bagfile_information') if isinstance(content, dict) else None
    listed = known.get('relative_file_paths') if isinstance(known, dict) else None
    if not isinstance(listed, list):
        _LOG.warning('%s does not list the files beside it as rosbag2 does', file)
        return []
    # old rosbag2 put the folder in front
    names = [PurePosixPath(entry).name for entry in listed if isinstance(entry, str)]
    return [name for name in dict.fromkeys(names) if name]


def _say_kinds(path: Path, names: list[str], count: int) -> str:
    """Return in words why a folder is no recording."""
    for name in names:
        for suffix, hint in OTHER_KINDS.items():
            if not count and name.endswith(suffix):
                return f'{path} holds 0 .mcap files, but {name}, which {hint}'
    return (f'{path} holds {count} .mcap files, but must hold one, or the parts <name>_0.mcap, '
            '<name>_1.mcap and so on, or list them in its metadata.yaml')
