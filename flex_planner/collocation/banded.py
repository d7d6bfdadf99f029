"""
LU factors of banded matrices, computed without holding Python's interpreter lock.

SciPy's own wrappers of the same LAPACK routines keep the lock while they run, tens of
milliseconds on long meshes, and every other thread of the process stands still for so long.

"""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from functools import cache

from flex_planner.base.validation import Array
import numpy as np


@cache
def _routine(name: str, arguments: int) -> Callable[..., None]:
    """Return a LAPACK routine that SciPy exports; all its arguments are pointers."""
    from scipy.linalg import cython_lapack  # longer to import than all of flex_planner

    capsule = cython_lapack.__pyx_capi__[name]
    api = ctypes.pythonapi
    api.PyCapsule_GetName.restype = ctypes.c_char_p
    api.PyCapsule_GetName.argtypes = [ctypes.py_object]
    api.PyCapsule_GetPointer.restype = ctypes.c_void_p
    api.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    address = api.PyCapsule_GetPointer(capsule, api.PyCapsule_GetName(capsule))
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arguments)(address)


class BandedFactors:
    """
    The LU factors of a banded matrix of size n with partial pivoting.

    Parameters
    ----------
    band : numpy.ndarray, shape (2 lower + upper + 1, n), Fortran order
        Entry (i, j) stands in row lower + upper + i - j; overwritten.
    lower, upper : int
        Diagonals below and above the main one.

    Attributes
    ----------
    singular : bool
        Whether a pivot is zero or an entry is not finite; then there is no solution.

    """

    def __init__(self, band: Array, lower: int, upper: int) -> None:
        if not band.flags.f_contiguous or band.dtype != np.float64:
            raise TypeError('the band must be float64 in Fortran order')
        self._factors = band
        self._pivots = np.empty(band.shape[1], dtype=np.int32)
        self._sizes = [ctypes.c_int(k) for k in (band.shape[1], lower, upper, band.shape[0])]
        info = ctypes.c_int()
        n, kl, ku, rows = (ctypes.addressof(size) for size in self._sizes)
        _routine('dgbtrf', 8)(
            n, n, kl, ku, band.ctypes.data, rows, self._pivots.ctypes.data,
            ctypes.addressof(info))
        self.singular = bool(info.value) or not np.isfinite(band).all()

    def solve(self, rhs: Array) -> Array:
        """Return x of A x = rhs, both of shape (n,)."""
        solution = np.array(rhs, dtype=np.float64)
        n, kl, ku, rows = (ctypes.addressof(size) for size in self._sizes)
        if solution.shape != (self._sizes[0].value,):
            raise ValueError(f'the right-hand side has shape {solution.shape}')
        one, info = ctypes.c_int(1), ctypes.c_int()
        transposed = ctypes.c_char(b'N')
        _routine('dgbtrs', 11)(
            ctypes.addressof(transposed), n, kl, ku, ctypes.addressof(one),
            self._factors.ctypes.data, rows, self._pivots.ctypes.data, solution.ctypes.data, n,
            ctypes.addressof(info))
        return solution
