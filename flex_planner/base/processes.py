"""Processors and memory of processes that compute side by side."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import ctypes
from multiprocessing import resource_tracker
import os
import signal
import threading
from types import FrameType

from flex_planner.base.errors import InvalidValueError

_LIBC = ctypes.CDLL(None)
ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'), '1')
# tells how many other processes may compute for this one
PROCESSES = 'FLEX_PLANNER_PROCESSES'
# multiprocessing's tracker removes what processes that were ended by force have left, and would
# tell it to the user, who can do nothing about it
_SILENT_TRACKER = {'PYTHONWARNINGS': 'ignore::UserWarning:multiprocessing.resource_tracker'}
# more are not started unasked: each takes 60 MB
_MOST = 4


def helper_processes() -> int:
    """
    Return how many other processes may compute for this one.

    ``$FLEX_PLANNER_PROCESSES``, else one for each processor that this process may use, four at
    most. With 0 all is computed in this process.

    Raises
    ------
    InvalidValueError
        If the variable is no such number.

    """
    given = os.environ.get(PROCESSES, '')
    if not given:
        return min(len(os.sched_getaffinity(0)), _MOST)
    if not (given.isascii() and given.isdigit()):
        raise InvalidValueError(PROCESSES, given, 'an integer >= 0')
    return int(given)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """
    Let processes that are started meanwhile compute in one thread each.

    Their linear algebra would otherwise take all processors in each of them. The environment is
    as it was afterwards, whatever else was added to it.

    """
    with _environment(ONE_THREAD):
        yield


@contextmanager
def without_helpers() -> Iterator[None]:
    """Let no other processes compute for this one, unless the environment says how many."""
    with _environment({PROCESSES: os.environ.get(PROCESSES) or '0'}):
        yield


@contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
    """Change the environment for a while."""
    before = dict(os.environ)
    os.environ.update(changes)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


@contextmanager
def deaf_to_interrupts(*, pool: bool = False) -> Iterator[None]:
    """
    Let processes that are started meanwhile, and their own, never get Ctrl-C.

    A terminal sends it to all of them, also to those that have not begun to listen, but it is for
    the first one alone, which ends the others. It gets it when the block ends.

    Parameters
    ----------
    pool : bool
        Whether multiprocessing starts them.

    """
    if pool:  # its tracker would unblock Ctrl-C for this thread as it starts
        with _environment(_SILENT_TRACKER):
            resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def held_interrupts() -> Iterator[list[BaseException]]:
    """
    Keep what Ctrl-C raises meanwhile until afterwards, and provide it in a list.

    For calls into libraries that call Python back: they would drop it.

    """
    raised: list[BaseException] = []
    handler = signal.getsignal(signal.SIGINT)

    def hold(number: int, frame: FrameType | None) -> None:
        try:
            if callable(handler):
                handler(number, frame)
        except BaseException as error:
            raised.append(error)

    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield raised
        return
    signal.signal(signal.SIGINT, hold)
    try:
        yield raised
    finally:
        signal.signal(signal.SIGINT, handler)
    if raised:
        raise raised[0]


def return_memory() -> None:
    """
    Give freed memory back to the system.

    glibc keeps what lies between small blocks that are still in use, and a process that solves
    for hours grows by it.

    """
    trim = getattr(_LIBC, 'malloc_trim', None)
    if trim is not None:
        trim(0)
