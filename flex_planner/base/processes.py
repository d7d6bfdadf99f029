"""Processors and memory of processes that compute side by side."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import ctypes
from multiprocessing import resource_tracker
import os
import signal

_LIBC = ctypes.CDLL(None)
_ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'), '1')


@contextmanager
def one_thread_each() -> Iterator[None]:
    """
    Let processes that are started meanwhile compute in one thread each.

    Their linear algebra would otherwise take all processors in each of them. The environment is
    as it was afterwards, whatever else was added to it.

    """
    before = dict(os.environ)
    os.environ.update(_ONE_THREAD)
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
        resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def return_memory() -> None:
    """
    Give freed memory back to the system.

    glibc keeps what lies between small blocks that are still in use, and a process that solves
    for hours grows by it.

    """
    trim = getattr(_LIBC, 'malloc_trim', None)
    if trim is not None:
        trim(0)
