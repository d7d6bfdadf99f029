"""
Where compiled functions are kept between processes: a folder of bounded size.

An entry is the file KEY.json, which names a library beside it and its checksum. Any process may
remove any entry at any time: what is loaded stays in memory, and what is missing is built again.
Beyond the bound the least recently used entries are removed first.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
import hashlib
import json
import logging
import os
from pathlib import Path
import re
import shutil
import tempfile
import time
from typing import Any, NamedTuple, TypeVar

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.number_texts import NumberTextError, read_number
from flex_planner.base.paths import folder_from_environment, PathError

SIZE_VARIABLE = 'FLEX_PLANNER_CACHE_SIZE'
_DEFAULT_SIZE, _MAX_SIZE = 500.0, 1e6  # [MB]
_MB = 1e6
_KEY = '[0-9a-f]{24}'
_ENTRY, _LIBRARY = re.compile(rf'({_KEY})\.json'), re.compile(rf'({_KEY})-[0-9a-f]{{16}}\.so')
_BUILD = 'build-'
_ABANDONED = 3600.0  # [s], after which what no entry names was left by a process that was killed

_LOG = logging.getLogger(__name__)
Loaded = TypeVar('Loaded')


class DamagedEntryError(FlexPlannerError):
    """What is kept under a key is no library as it was written."""


class Entry(NamedTuple):
    """The files of a key, their size, and the time of their last use [s]."""

    key: str
    files: tuple[Path, ...]
    size: int
    used: float


def cache_folder() -> Path:
    """
    Return the folder of compiled functions: ``$XDG_CACHE_HOME/flex_planner``.

    Raises
    ------
    PathError
        If there is no home folder.

    """
    return folder_from_environment('XDG_CACHE_HOME', '~/.cache') / 'flex_planner'


def largest_size() -> float:
    """Return the bound on the size of the folder [bytes], by default 500 MB."""
    text = os.environ.get(SIZE_VARIABLE, '').strip()
    with suppress(NumberTextError):
        if 1 <= (size := read_number(text) if text else _DEFAULT_SIZE) <= _MAX_SIZE:
            return size * _MB
    warn_once(f'{SIZE_VARIABLE} is {text!r}, but must be a number from 1 to {_MAX_SIZE:g} MB: '
              f'{_DEFAULT_SIZE:g} MB are used')
    return _DEFAULT_SIZE * _MB


@cache
def warn_once(text: str) -> None:
    """Log a warning, the same one not again: an arm has several libraries."""
    _LOG.warning('%s', text)


def read_library(key: str, load: Callable[[Path, dict[str, Any]], Loaded]) -> Loaded | None:
    """
    Return a library that is kept, None if there is none.

    Parameters
    ----------
    key : str
        Of the entry.
    load : callable
        Loads a file that has the checksum of its entry, with what the entry says of its functions;
        may raise OSError, KeyError, TypeError, ValueError and AttributeError.

    Raises
    ------
    DamagedEntryError
        If files are there but cannot be used.

    """
    try:
        entry = cache_folder() / f'{key}.json'
    except PathError:
        return None
    library = entry
    try:
        if not entry.is_file():
            entry.stat()  # raises if there is nothing
            raise ValueError('no file')
        record = json.loads(entry.read_bytes())
        library = entry.parent / Path(record['library']).name
        # a damaged library would end the process when loaded, so it is read first
        if digest(library) != record['sha256']:
            raise ValueError('wrong checksum')
        loaded = load(library, record['functions'])
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        if not library.exists():  # another process has just removed it
            return None
        raise DamagedEntryError(str(error)) from None
    with suppress(OSError):
        os.utime(entry)
    return loaded


def build_folders() -> Iterator[Path]:
    """Yield folders in which libraries may be built: the cache folder, then a temporary one."""
    with suppress(PathError):
        yield cache_folder()
    yield Path(tempfile.gettempdir())


def scratch_folder(parent: Path) -> tempfile.TemporaryDirectory[str]:
    """Return a folder that is there within a with block; OSError if it cannot be made."""
    parent.mkdir(parents=True, exist_ok=True)
    return tempfile.TemporaryDirectory(dir=parent, prefix=_BUILD, ignore_cleanup_errors=True)


def keep_library(key: str, library: Path, functions: dict[str, Any]) -> None:
    """
    Move a new library from a scratch folder into the cache folder, and remove what is too much.

    Raises
    ------
    OSError, PathError
        If it cannot be written, or there is no home folder.

    """
    folder, checksum = cache_folder(), digest(library)
    # named by its content: two processes that build at once never mix their files
    target = folder / f'{key}-{checksum[:16]}.so'
    os.replace(library, target)
    record = {'library': target.name, 'sha256': checksum, 'functions': functions}
    draft = library.with_name('entry.json')
    draft.write_text(json.dumps(record))
    os.replace(draft, folder / f'{key}.json')
    remove_surplus(folder, largest_size(), key)


def remove_surplus(folder: Path, most: float, kept: str = '') -> None:
    """Remove the entries that were not used for longest, until the others are small enough."""
    entries = sorted(find_entries(folder), key=lambda entry: entry.used)
    size = sum(entry.size for entry in entries)
    for entry in entries:
        if size <= most:
            break
        if entry.key != kept:
            _remove(entry)
            size -= entry.size
    for path in _abandoned(folder, entries):
        _remove_path(path)


def clear_cache() -> tuple[int, int]:
    """
    Remove all entries; return how many there were and their size in bytes.

    Files that are none of the cache's stay, and so does what is being built.

    """
    folder = cache_folder()
    entries = list(find_entries(folder))
    for entry in entries:
        _remove(entry)
    for path in _abandoned(folder, []):
        _remove_path(path)
    return len(entries), sum(entry.size for entry in entries)


def find_entries(folder: Path) -> Iterator[Entry]:
    """Yield the entries of a folder, and libraries whose entry was replaced as their own."""
    for key, files in _files_by_key(folder).items():
        stats = [status for path in files if (status := _status(path))]
        if stats:
            yield Entry(key, tuple(files), sum(status.st_size for status in stats),
                        max(status.st_mtime for status in stats))


def digest(path: Path) -> str:
    """Return the checksum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _files_by_key(folder: Path) -> dict[str, list[Path]]:
    """Return the files of each key, the one that names the library first."""
    found: dict[str, list[Path]] = {}
    with suppress(OSError):
        for name in sorted(os.listdir(folder), key=lambda name: not name.endswith('.json')):
            match = _ENTRY.fullmatch(name) or _LIBRARY.fullmatch(name)
            if match:
                found.setdefault(match[1], []).append(folder / name)
    return found


def _status(path: Path) -> os.stat_result | None:
    """Return what is known of a file, None if there is none any more."""
    with suppress(OSError):
        return path.lstat()
    return None


def _remove(entry: Entry) -> None:
    """Remove the files of an entry: what names the library before the library."""
    for path in entry.files:
        _remove_path(path)


def _remove_path(path: Path) -> None:
    """Remove a file or folder; what cannot be removed stays."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()


def _abandoned(folder: Path, entries: list[Entry]) -> Iterator[Path]:
    """Yield folders of builds, and libraries without an entry, that are old."""
    builds = list(folder.glob(f'{_BUILD}*'))
    alone = [entry.files[0] for entry in entries if entry.files[0].suffix == '.so']
    for path in builds + alone:
        status = _status(path)
        if status and time.time() - status.st_mtime > _ABANDONED:
            yield path
