"""
Shared libraries made of C source: built once, kept on disk, and found again by a key.

See `library_cache` for where they are kept.

"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
import hashlib
from pathlib import Path
import platform
from typing import Any, TypeVar

from flex_planner.base.compiler import compile_library, CompilerError, find_compiler, FLAGS
from flex_planner.base.library_cache import (
    build_folders,
    DamagedEntryError,
    keep_library,
    read_library,
    scratch_folder,
    warn_once,
)
from flex_planner.base.paths import PathError
from flex_planner.base.progress import Monitor

Loaded = TypeVar('Loaded')


def content_key(*parts: str | bytes) -> str:
    """Return a short digest of what a library is made of, for its name on disk."""
    digest = hashlib.sha256()
    own = (Path(__file__).read_bytes(), ' '.join(FLAGS), platform.system(), _processor())
    for part in (*parts, *own):
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, 'little') + data)
    return digest.hexdigest()[:24]


@cache
def _processor() -> str:
    """Return the kind of processor: a home folder may serve machines of several kinds."""
    try:
        lines = Path('/proc/cpuinfo').read_text().splitlines()
    except OSError:
        lines = []
    flags = next((line for line in lines if line.startswith(('flags', 'Features'))), '')
    return f'{platform.machine()} {flags}'


def find_library(key: str, load: Callable[[Path, dict[str, Any]], Loaded]) -> Loaded | None:
    """Return a library that is kept, see `read_library`; None if there is none, or a bad one."""
    try:
        return read_library(key, load)
    except DamagedEntryError as error:
        warn_once(f'compiled functions {key} are damaged ({error}) and are built again')
        return None


def build_library(key: str, source: str, load: Callable[[Path], Loaded], *,
                  record: Mapping[str, Any], options: tuple[str, ...] = (),
                  monitor: Monitor | None = None) -> Loaded:
    """
    Compile, load and keep a library: in a temporary folder if the cache folder is of no use.

    Parameters
    ----------
    key : str
        From :func:`content_key`; equal keys mean equal libraries.
    source : str
        C code.
    load : callable
        Loads the library.
    record : dict
        What is to be known of its functions when it is found again.
    options : tuple of str
        Of the compiler.
    monitor : Monitor, optional
        May stop the compiler.

    Raises
    ------
    CompilerError
        If it works in neither folder.
    StoppedError
        If the monitor stopped it.

    """
    compiler, reason = find_compiler(), ''
    for folder in build_folders():
        try:
            with scratch_folder(folder) as scratch:
                library = compile_library(compiler, source, Path(scratch), options, monitor)
                # loaded before it is kept: then nobody can remove it in between
                loaded = load(library)
                _keep(key, library, dict(record), reason)
                return loaded
        except CompilerError as error:
            reason = str(error)
        except OSError as error:
            reason = f'{folder}: {error.strerror or error}'
    raise CompilerError(reason)


@cache
def load_once(path: Path, options: tuple[str, ...], load: Callable[[Path], Loaded],
              otherwise: str) -> Loaded | None:
    """
    Return the library of a file of C code; it is kept in memory, also that there is none.

    Parameters
    ----------
    path : Path
        The file.
    options : tuple of str
        Of the compiler.
    load : callable
        Loads the library.
    otherwise : str
        What follows where there is no compiler, which is warned of; None is returned then.

    """
    source = path.read_text()
    key = content_key(source, *options)
    try:
        return find_library(key, lambda library, record: load(library)) or build_library(
            key, source, load, record={}, options=options)
    except CompilerError as error:
        warn_once(f'{error}: {otherwise}')
        return None


def _keep(key: str, library: Path, record: dict[str, Any], reason: str) -> None:
    """Keep a new library, unless there is a reason not to, and say so."""
    try:
        if not reason:
            keep_library(key, library, record)
            return
    except OSError as error:
        reason = f'{library.parents[1]}: {error.strerror or error}'
    except PathError as error:
        reason = str(error)
    warn_once(f'cannot keep compiled functions ({reason}): they are built again at the next start')
