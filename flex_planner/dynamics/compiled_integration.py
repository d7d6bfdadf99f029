"""The loop of `integrate` in compiled code, see integration.c."""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from functools import cache
from pathlib import Path
from typing import Any

from flex_planner.base.compiled_library import build_library, content_key, find_library
from flex_planner.base.compiler import CompilerError
from flex_planner.base.library_cache import warn_once
from flex_planner.base.validation import Array
import numpy as np

_SOURCE = Path(__file__).with_name('integration.c')
_OPTIONS = ('-O2', '-fno-math-errno')
_STOPPED, _NO_MEMORY = -1, -2
_address, _number, _real = ctypes.c_void_p, ctypes.c_longlong, ctypes.c_double
_TORQUES = ctypes.CFUNCTYPE(_address, _number, _number)


class _Integration(ctypes.Structure):
    """`struct integration` of integration.c."""

    _fields_ = [('step', _address), ('torques', _TORQUES), ('intervals', _number),
                ('size', _number), ('breaks', _address), ('physical', _address), ('rtol', _real),
                ('atol', _real), ('safety', _real), ('largest_growth', _real),
                ('states', _address)]


def cross_intervals(step: int, torques: Callable[[int, int], Array | None], breaks: Array,
                    physical: Array, states: Array, **settings: float) -> bool:
    """
    Fill in the states at the breaks of a torque; False if there is no compiler.

    Parameters
    ----------
    step : int
        Address of the compiled ``runge_kutta_step``.
    torques : callable
        Interval and number of steps to torques at their stages; None if these are too many, or
        an error, ends it.
    breaks : numpy.ndarray, shape (N + 1,)
        Times [s].
    physical : numpy.ndarray
        `PhysicalParameters.physical`.
    states : numpy.ndarray, shape (N + 1, 2 n_t)
        The first is given; those not reached stay.
    **settings : float
        ``rtol``, ``atol``, ``safety`` and ``largest_growth``.

    """
    library = _load()
    if library is None:
        return False
    kept: list[Any] = []

    def find_torques(interval: int, count: int) -> int | None:
        try:
            values = torques(interval, count)
            kept[:] = [None if values is None else np.ascontiguousarray(values)]
        except BaseException as error:
            kept[:] = [error]
        # what is kept lives while integration.c reads it
        return kept[0].ctypes.data if isinstance(kept[0], np.ndarray) else None

    arrays = [np.ascontiguousarray(values, dtype=np.float64) for values in (breaks, physical)]
    job = _Integration(
        step=step, torques=_TORQUES(find_torques), intervals=len(states) - 1,
        size=states.shape[1], breaks=arrays[0].ctypes.data, physical=arrays[1].ctypes.data,
        states=states.ctypes.data, **settings)
    outcome = library.integrate(ctypes.byref(job))
    if outcome == _NO_MEMORY:
        raise MemoryError('no memory to integrate a motion')
    if outcome == _STOPPED and kept[0] is not None:
        raise kept[0]
    return True


@cache
def _load() -> Any:
    """Return the library, None without a compiler."""
    source = _SOURCE.read_text()
    key = content_key(source, *_OPTIONS)
    try:
        return find_library(key, lambda library, record: _open(library)) or build_library(
            key, source, _open, record={}, options=_OPTIONS)
    except CompilerError as error:
        warn_once(f'{error}: a plan is certified several times slower')
        return None


def _open(library: Path) -> ctypes.CDLL:
    functions = ctypes.CDLL(str(library))
    functions.integrate.restype = _number
    functions.integrate.argtypes = (ctypes.POINTER(_Integration),)
    return functions
