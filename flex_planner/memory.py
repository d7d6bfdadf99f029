"""Memory that this process has and does not need."""

from __future__ import annotations

import ctypes

_LIBC = ctypes.CDLL(None)


def return_memory() -> None:
    """
    Give freed memory back to the system.

    glibc keeps what lies between small blocks that are still in use, and a process that solves
    for hours grows by it.

    """
    trim = getattr(_LIBC, 'malloc_trim', None)
    if trim is not None:
        trim(0)
