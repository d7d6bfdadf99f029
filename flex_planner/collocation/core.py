"""
The compiled core: core.c built for a size of problem and a number of stages, kept on disk.

Without a C compiler there is none, and NumPy does the same, several times slower; so it does where
the environment says ``FLEX_PLANNER_CORE=numpy``.

"""

from __future__ import annotations

import ctypes
from functools import cache
import os
from pathlib import Path
from typing import NamedTuple

from flex_planner.base.compiled_library import build_library, content_key, find_library
from flex_planner.base.compiler import CompilerError
from flex_planner.base.library_cache import warn_once
from flex_planner.base.validation import Array
from flex_planner.collocation.gauss import ComplexArray, GaussRule
import numpy as np

CORE_VARIABLE = 'FLEX_PLANNER_CORE'
_SOURCE = Path(__file__).with_name('core.c')
# no -ffast-math: it makes the whole process round tiny numbers to zero
_OPTIONS = ('-O3', '-fno-math-errno', '-fno-trapping-math')


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
        number, address = ctypes.c_longlong, ctypes.c_void_p
        self.factorisation_size = functions.factorisation_size
        self.factorisation_size.argtypes = (number,)
        self.factorisation_size.restype = number
        self.factorise_system = functions.factorise_system
        self.factorise_system.argtypes = (address, number, *[address] * 8)
        self.correct = functions.correct
        self.correct.argtypes = (address, number, *[address] * 6)
        self.correct.restype = None


def load_core(sizes: CoreSizes) -> Core | None:
    """Return the core for a size of problem, None if NumPy is to do without."""
    if os.environ.get(CORE_VARIABLE) == 'numpy':
        return None
    return _load_core(sizes)


@cache
def _load_core(sizes: CoreSizes) -> Core | None:
    source = _SOURCE.read_text()
    key = content_key(source, *_OPTIONS, *sizes.definitions)
    core = find_library(key, lambda library, record: Core(library))
    if core is not None:
        return core
    try:
        return build_library(key, source, Core, record={},
                             options=(*_OPTIONS, *sizes.definitions))
    except CompilerError as error:
        warn_once(f'{error}: NumPy solves the equations of a motion, some three times slower')
    return None


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
