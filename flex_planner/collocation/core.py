"""
The compiled core: core.c built for a size of problem and a number of stages, kept on disk.

Without a C compiler there is none, and NumPy does the same, several times slower; so it does where
the environment says ``FLEX_PLANNER_CORE=numpy``.

"""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from functools import cache
import os
from pathlib import Path
import platform
import re
from typing import Any, NamedTuple

from flex_planner.base.compiled_library import build_library, content_key, find_library
from flex_planner.base.compiler import CompilerError
from flex_planner.base.library_cache import warn_once
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.gauss import ComplexArray, GaussRule
from flex_planner.collocation.problem import CompiledRate
import numpy as np

CORE_VARIABLE = 'FLEX_PLANNER_CORE'
_SOURCE = Path(__file__).with_name('core.c')
# with vectors of 512 bits GCC 12 stores as if an array on the stack were aligned, and is not
_VECTORS = ('-mprefer-vector-width=256',) if platform.machine() in ('x86_64', 'AMD64') else ()
# no -ffast-math: it makes the whole process round tiny numbers to zero
_OPTIONS = ('-O2', '-fno-math-errno', '-fno-trapping-math', *_VECTORS)


_address, _number, _real = ctypes.c_void_p, ctypes.c_longlong, ctypes.c_double
# functions that core.c calls: the boundary rows, those of a junction, who may stop it, and who
# hears of an iteration
BOUNDARY_ROWS = ctypes.CFUNCTYPE(ctypes.c_int, *[_address] * 6)
JUNCTION_ROWS = ctypes.CFUNCTYPE(ctypes.c_int, _number, *[_address] * 3)
STOP = ctypes.CFUNCTYPE(ctypes.c_int)
REPORT = ctypes.CFUNCTYPE(None, _real)
MOST_INPUTS = 8


class CoreProblem(ctypes.Structure):
    """`struct problem` of core.c."""

    _fields_ = [('rate', _address), ('rate_jacobian', _address), ('ends', BOUNDARY_ROWS),
                ('junction', JUNCTION_ROWS), ('shared', _address * MOST_INPUTS)]


class CoreJunctions(ctypes.Structure):
    """`struct junctions` of core.c."""

    _fields_ = [('count', _number), ('intervals', _address), ('rows', _address)]

    @classmethod
    def of(cls, intervals: Any, rows: Array) -> CoreJunctions:
        """Return intervals (J,) and rows (J, m, 2 m), which must live as long."""
        return cls(count=intervals.size, intervals=intervals.ctypes.data, rows=rows.ctypes.data)


class CoreWatch(ctypes.Structure):
    """`struct watch` of core.c."""

    _fields_ = [('stop', STOP), ('asked', _real)]


class CoreNewton(ctypes.Structure):
    """`struct newton` of core.c."""

    _fields_ = [
        ('count', _number), ('most_iterations', _number), ('tolerance', _real), ('kept', _real),
        ('smallest_step', _real), ('rule', _address), ('steps', _address),
        ('least_scale', _address), ('explicit', _address), ('implicit', _address),
        ('problem', CoreProblem), ('stop', STOP), ('report', REPORT), ('nodes', _address),
        ('stages', _address), ('factorisation', _address), ('jacobians', _address),
        ('left_rows', _address), ('right_rows', _address), ('scale', _address),
        ('junctions', CoreJunctions), ('norm', _real), ('iterations', _number),
        ('factorised', _number), ('coarse', _number)]


class CoreSizes(NamedTuple):
    """
    What the core is compiled for.

    Attributes
    ----------
    size : int
        Unknowns, m.
    left : int
        Boundary rows at the first node, l.
    explicit : int
        Unknowns that need no factorisation.
    stages : int
        Of the Gauss rule, s.
    exact : int
        1 if every stage keeps its own Jacobian, 0 if their mean stands for them.

    """

    size: int
    left: int
    explicit: int
    stages: int
    exact: int

    @property
    def definitions(self) -> tuple[str, ...]:
        """Return the sizes as options of the compiler."""
        return tuple(f'-D{name.upper()}={value}' for name, value in self._asdict().items())


class Core:
    """
    The functions of a compiled core; all arrays are handed over by their addresses.

    Parameters
    ----------
    library : Path
        To be loaded.

    """

    def __init__(self, library: Path) -> None:
        functions = ctypes.CDLL(str(library))
        self.factorisation_size = functions.factorisation_size
        self.factorisation_size.argtypes = (_number,)
        self.factorisation_size.restype = _number
        self.factorise_system = functions.factorise_system
        self.factorise_system.argtypes = (
            _address, _number, *[_address] * 8, ctypes.POINTER(CoreJunctions), _address)
        self.correct = functions.correct
        self.correct.argtypes = (_address, _number, *[_address] * 6)
        self.evaluate = functions.evaluate
        self.evaluate.argtypes = (ctypes.POINTER(CoreProblem), _number, *[_address] * 8)
        self.solve_newton = functions.solve_newton
        self.solve_newton.argtypes = (ctypes.POINTER(CoreNewton),)

    def allocate(self, intervals: int) -> Any:
        """Return memory for a factorisation; it was often used before, and need not be cleared."""
        return np.empty(self.factorisation_size(intervals), dtype=np.uint8)


# cores by their sizes; None where there is no compiler
LOADED: dict[CoreSizes, Core | None] = {}


def load_core(sizes: CoreSizes, monitor: Monitor | None = None) -> Core | None:
    """
    Return the core for a size of problem, None if NumPy is to do without.

    A monitor may stop its compilation, by a StoppedError.

    """
    if os.environ.get(CORE_VARIABLE) == 'numpy':
        return None
    if sizes not in LOADED:
        LOADED[sizes] = _load_core(sizes, monitor)
    return LOADED[sizes]


def prepare_core(size: int, left: int, explicit: int, stages: int) -> None:
    """Compile what solving a problem takes, unless it is kept: its rule and that of estimates."""
    for count in (stages, stages + 1):
        load_core(CoreSizes(size, left, explicit, count, 0))


def read_source() -> str:
    """Return core.c with its parts in the place of their includes: one text, and one key of it."""
    return re.sub(r'#include "(.*)"', lambda part: (_SOURCE.parent / part[1]).read_text(),
                  _SOURCE.read_text())


def _load_core(sizes: CoreSizes, monitor: Monitor | None) -> Core | None:
    """Return the core from the disk, or built and kept."""
    source = read_source()
    key = content_key(source, *_OPTIONS, *sizes.definitions)
    core = find_library(key, lambda library, record: Core(library))
    if core is not None:
        return core
    if monitor is not None:
        monitor.announce(f'compiling the solver for {sizes.size} unknowns')
    try:
        return build_library(key, source, Core, record={},
                             options=(*_OPTIONS, *sizes.definitions), monitor=monitor)
    except CompilerError as error:
        warn_once(f'{error}: NumPy solves the equations of a motion, some three times slower')
    return None


def core_problem(rate: CompiledRate, ends: Callable[..., int] | None = None,
                 junction: Callable[..., int] | None = None) -> CoreProblem:
    """Return a problem as core.c knows it."""
    shared = [array.ctypes.data for array in rate.shared]
    addresses = (ctypes.c_void_p * MOST_INPUTS)(*shared)
    rows = BOUNDARY_ROWS(ends) if ends else BOUNDARY_ROWS()
    inner = JUNCTION_ROWS(junction) if junction else JUNCTION_ROWS()
    return CoreProblem(rate=rate.rate, rate_jacobian=rate.rate_jacobian, ends=rows,
                       junction=inner, shared=addresses)


@cache
def pack_rule(rule: GaussRule) -> Array:
    """Return the numbers of a rule as `struct rule` of core.c has them."""
    spectrum = rule.spectrum
    # a sum of complex products has the real part of one factor times the conjugate of the other
    return np.concatenate([
        _lanes(spectrum.eigenvalues),
        _lanes((rule.weights @ spectrum.vectors) * spectrum.inverse.sum(axis=1)),
        _lanes(spectrum.inverse.T),
        _lanes(spectrum.inverse.sum(axis=1)),
        _lanes((rule.weights @ spectrum.vectors).conj()),
        _lanes(spectrum.vectors.conj()),
        rule.matrix.ravel(),
        rule.weights])


def _lanes(values: ComplexArray) -> Array:
    """Return rows of complex numbers (..., r) as their real parts, then their imaginary parts."""
    lanes: Array = np.concatenate([values.real, values.imag], axis=-1).ravel()
    return lanes.astype(np.float64)
