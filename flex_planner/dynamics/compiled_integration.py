"""The loop of `integrate` in compiled code, see integration.c."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Protocol

from flex_planner.base.compiled_library import load_once
from flex_planner.base.validation import Array
import numpy as np

_SOURCE = Path(__file__).with_name('integration.c')
_OPTIONS = ('-O2', '-fno-math-errno')
_NO_MEMORY = -2
_address, _number, _real = ctypes.c_void_p, ctypes.c_longlong, ctypes.c_double
_TORQUES = ctypes.CFUNCTYPE(_address, _number, _number)
_STOP = ctypes.CFUNCTYPE(ctypes.c_int)


class _Integration(ctypes.Structure):
    """`struct integration` of integration.c."""

    _fields_ = [('step', _address), ('torques', _TORQUES), ('stop', _STOP),
                ('tables', _address), ('tabled', _number), ('width', _number),
                ('intervals', _number), ('size', _number), ('breaks', _address),
                ('physical', _address), ('rtol', _real), ('atol', _real), ('safety', _real),
                ('largest_growth', _real), ('states', _address)]


class StageTorques(Protocol):
    """The torques at the stages of equal steps that cross an interval."""

    @property
    def most_tabled(self) -> int:
        """Return up to how many steps the torques of all intervals stand in one table."""

    def check(self) -> None:
        """Raise an error to stop the integration; called before every try."""

    def at(self, interval: int, count: int) -> Array | None:
        """Return those of an interval, contiguous, shape (count, 12 n); None for too many."""


def cross_intervals(step: int, torques: StageTorques, breaks: Array, physical: Array,
                    states: Array, **settings: float) -> bool:
    """
    Fill in the states at the breaks of a torque; False if there is no compiler.

    Parameters
    ----------
    step : int
        Address of the compiled ``runge_kutta_step``.
    torques : StageTorques
        Too many steps, or an error, end it.
    breaks : numpy.ndarray, shape (N + 1,)
        Times [s].
    physical : numpy.ndarray
        `PhysicalParameters.physical`.
    states : numpy.ndarray, shape (N + 1, 2 n_t)
        The first is given; those not reached stay.
    **settings : float
        ``width``, entries of torques at the stages of a step, 12 n; ``rtol``, ``atol``,
        ``safety`` and ``largest_growth``.

    """
    library = _load()
    if library is None:
        return False
    calls = _Calls(torques)
    tables = (_address * (torques.most_tabled + 1))()
    arrays = [np.ascontiguousarray(values, dtype=np.float64) for values in (breaks, physical)]
    job = _Integration(
        step=step, torques=_TORQUES(calls.find), stop=_STOP(calls.stop),
        tables=ctypes.addressof(tables), tabled=torques.most_tabled, intervals=len(states) - 1,
        size=states.shape[1], breaks=arrays[0].ctypes.data, physical=arrays[1].ctypes.data,
        states=states.ctypes.data, **settings)
    outcome = library.integrate(ctypes.byref(job))
    if outcome == _NO_MEMORY:
        raise MemoryError('no memory to integrate a motion')
    if calls.error is not None:
        raise calls.error
    return True


class _Calls:
    """What integration.c calls of Python. An error is kept until it returns."""

    def __init__(self, torques: StageTorques) -> None:
        self._torques = torques
        self._kept: Array | None = None
        self.error: BaseException | None = None

    def find(self, interval: int, count: int) -> int | None:
        """Return the address of torques, which live while integration.c reads them."""
        try:
            self._kept = self._torques.at(interval, count)
        except BaseException as error:
            self.error = error
            return None
        return None if self._kept is None else self._kept.ctypes.data

    def stop(self) -> int:
        """Return whether to stop."""
        try:
            self._torques.check()
        except BaseException as error:
            self.error = error
            return 1
        return 0


def _load() -> ctypes.CDLL | None:
    """Return the library, None without a compiler."""
    return load_once(_SOURCE, _OPTIONS, _open, 'a plan is certified several times slower')


def _open(library: Path) -> ctypes.CDLL:
    functions = ctypes.CDLL(str(library))
    functions.integrate.restype = _number
    functions.integrate.argtypes = (ctypes.POINTER(_Integration),)
    return functions
