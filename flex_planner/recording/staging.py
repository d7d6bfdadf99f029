"""
Folders that appear whole or not at all.

Files are written into a hidden folder beside the target, forced to the disk, and the folder is
renamed. A killed process leaves at most the hidden folder behind, which may be deleted, or saved
as far as it is complete (see `recovery`).

"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import fcntl
import logging
import os
from pathlib import Path
import secrets
import shutil
from typing import BinaryIO

from flex_planner.base.errors import RecordingError

_logger = logging.getLogger(__name__)


@contextmanager
def staged_folder(target: Path) -> Iterator[Path]:
    """
    Provide a hidden folder that becomes the target when the block ends well.

    Parameters
    ----------
    target : Path
        The new folder; those above it are made if missing.

    Raises
    ------
    RecordingError
        If the target exists (it is never overwritten), or the system refuses.

    """
    with os_errors(target):
        stage = _make_stage(target)
    try:
        yield stage
        with os_errors(target):
            _commit(stage, target)
    except BaseException:
        shutil.rmtree(stage, ignore_errors=True)
        raise


@contextmanager
def output_file(path: Path, shown: Path) -> Iterator[BinaryIO]:
    """Open a new file, on the disk when the block ends well; errors name the path shown."""
    with os_errors(shown):
        stream = path.open('xb')
    try:
        with suppress(OSError):  # some network file systems have no locks
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)  # released with the process
        yield stream
        with os_errors(shown):
            stream.flush()
            os.fsync(stream.fileno())
    finally:
        # After an error the buffer may be full still, and the first error is the one to tell.
        with suppress(OSError):
            stream.close()


@contextmanager
def os_errors(path: Path) -> Iterator[None]:
    """Turn an error of the operating system into a RecordingError that names the path."""
    try:
        yield
    except OSError as error:
        raise RecordingError(f'cannot write {path}: {error.strerror or error}') from error


def _make_stage(target: Path) -> Path:
    """Make the hidden folder; unlike mkdtemp's its mode follows the umask."""
    _refuse_existing(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    stage = target.with_name(f'.{target.name}.{secrets.token_hex(8)}')
    stage.mkdir()
    return stage


def _commit(stage: Path, target: Path) -> None:
    """Give the finished folder its name."""
    _sync_folder(stage)
    # The rename itself refuses a folder with content and a file, but not an empty folder.
    _refuse_existing(target)
    stage.rename(target)
    try:
        _sync_folder(target.parent)
    except OSError as error:
        _logger.warning('%s is written, but not forced to the disk: %s', target, error)


def _refuse_existing(target: Path) -> None:
    """Raise if the target exists, also as a dangling link."""
    if os.path.lexists(target):
        raise RecordingError(f'{target} exists and is never overwritten: choose another name')


def _sync_folder(folder: Path) -> None:
    """Force the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
