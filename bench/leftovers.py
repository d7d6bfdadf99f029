"""What a node may leave behind: processes, and its shared memory."""

from __future__ import annotations

from collections.abc import Iterable
import os
from pathlib import Path


def relatives(variable: str) -> list[Path]:
    """
    Return the processes that have inherited a variable of the environment.

    Parameters
    ----------
    variable : str
        As in ``NAME=value``.

    Returns
    -------
    list of Path
        Their folders below ``/proc``; this process is not among them.

    """
    found = []
    for process in Path('/proc').glob('[0-9]*'):
        try:
            variables = (process / 'environ').read_bytes().split(b'\0')
        except OSError:
            continue  # it has ended, or is somebody else's
        if variable.encode() in variables and process.name != str(os.getpid()):
            found.append(process)
    return found


def shared_memory(processes: Iterable[Path]) -> list[Path]:
    """
    Return the segments of shared memory that Fast DDS has made for processes.

    Those of ports are not among them: all participants of a machine use them in turn.

    Parameters
    ----------
    processes : iterable of Path
        Folders below ``/proc``.

    """
    # whose segment it is holds the lock beside it
    locks = [os.readlink(file) for process in processes for file in (process / 'fd').iterdir()]
    return [Path(lock.removesuffix('_el')) for lock in locks
            if lock.startswith('/dev/shm/fastrtps_') and lock.endswith('_el')
            and '_port' not in lock]
