"""The linear system of a Newton step in compiled code, see core.c."""

from __future__ import annotations

import ctypes
from typing import Any

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.core import (
    Core,
    CoreJunctions,
    CoreSizes,
    CoreWatch,
    load_core,
    pack_rule,
    STOP,
)
from flex_planner.collocation.gauss import GaussRule
from flex_planner.collocation.junctions import JunctionRows, NO_JUNCTIONS
from flex_planner.collocation.linear import (
    BAD_BOUNDARY_ROW,
    LinearSystem,
    NewtonSystem,
    resample_jacobians,
    Residual,
    SINGULAR_PROBLEM,
)
from flex_planner.collocation.problem import Indices, SINGULAR_STAGES, SingularSystemError
import numpy as np

# what functions of core.c return
FAILURES = {1: SINGULAR_STAGES, 2: BAD_BOUNDARY_ROW, 3: SINGULAR_PROBLEM}
Linearisation = tuple[Array, Array, Array, Array, Array, Indices]


# of core.c: who watches has stopped it
_STOPPED = 9


def factorise_system(rule: GaussRule, steps: Array, jacobians: Array, left: Array, right: Array,
                     scale: Array, explicit: Indices,
                     junctions: JunctionRows = NO_JUNCTIONS,
                     monitor: Monitor | None = None) -> LinearSystem:
    """
    Return the linearised collocation equations, factorised by the fastest means there are.

    The arguments are those of `NewtonSystem`, and so are the errors; a monitor may stop compiled
    code, by a StoppedError, also when it finds corrections.

    """
    core = load_core(CoreSizes(scale.size, left.shape[0], explicit.size, rule.stages,
                               int(jacobians.ndim == 4)), monitor)
    if core is None:
        return NewtonSystem(rule, steps, jacobians, left, right, scale, explicit, junctions)
    return CompiledSystem.factorise(core, rule, (steps, jacobians, left, right, scale, explicit),
                                    junctions, monitor)


class _Watch:
    """Asks a monitor from within core.c; what it raises is kept until that returns."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self._error: BaseException | None = None
        self._watch = CoreWatch(stop=STOP(self._stop))

    @property
    def address(self) -> int:
        """Return where core.c finds it."""
        return ctypes.addressof(self._watch)

    def _stop(self) -> int:
        try:
            self._monitor.check()
        except BaseException as error:
            self._error = error
            return _STOPPED
        return 0

    def stopped(self) -> BaseException:
        """Return what stopped core.c."""
        return self._error or AssertionError('core.c stopped without a reason')


class CompiledSystem:
    """
    A `NewtonSystem` in compiled code, which runs without the interpreter lock.

    Parameters
    ----------
    core : Core
        Compiled for these sizes.
    rule : GaussRule
        The method.
    parts : tuple
        The other arguments of `NewtonSystem` but the last.
    factors : numpy.ndarray
        Memory in which core.c has factorised it.
    junctions : JunctionRows
        The last argument of `NewtonSystem`.
    watch : _Watch, optional
        That it has been told of.

    """

    def __init__(self, core: Core, rule: GaussRule, parts: Linearisation, factors: Array,
                 junctions: JunctionRows = NO_JUNCTIONS, watch: _Watch | None = None) -> None:
        self._core, self._rule, self._parts, self._factors = core, rule, parts, factors
        self._junctions, self._watch = junctions, watch

    @classmethod
    def factorise(cls, core: Core, rule: GaussRule, parts: Linearisation,
                  junctions: JunctionRows = NO_JUNCTIONS,
                  monitor: Monitor | None = None) -> CompiledSystem:
        """
        Return the system, factorised.

        Raises
        ------
        SingularSystemError
            If a factor is singular or not finite.
        StoppedError
            If the monitor stopped it.

        """
        watch = None if monitor is None else _Watch(monitor)
        *numbers, explicit = parts
        factors = core.allocate(numbers[0].size)
        arrays: list[Any] = [pack_rule(rule), *map(_contiguous, numbers),
                             *split_indices(numbers[-1].size, explicit)]
        inner = CoreJunctions.of(junctions.intervals, junctions.rows)
        failure = core.factorise_system(factors.ctypes.data, numbers[0].size,
                                        *(array.ctypes.data for array in arrays),
                                        ctypes.byref(inner),
                                        None if watch is None else watch.address)
        if failure == _STOPPED and watch is not None:
            raise watch.stopped()
        if failure:
            raise SingularSystemError(FAILURES[failure])
        return cls(core, rule, parts, factors, junctions, watch)

    def with_rule(self, rule: GaussRule, monitor: Monitor | None = None) -> LinearSystem:
        """Return the system of another rule on the same mesh, see `NewtonSystem.with_rule`."""
        steps, jacobians, left, right, scale, explicit = self._parts
        return factorise_system(rule, steps, resample_jacobians(jacobians, self._rule, rule),
                                left, right, scale, explicit, self._junctions, monitor)

    def correction(self, residual: Residual) -> tuple[Array, Array]:
        """Return the correction of nodes (N + 1, m) and stage derivatives (N, s, m)."""
        count, size = self._parts[0].size, self._parts[4].size
        nodes, rates = np.empty((count + 1, size)), np.empty((count, self._rule.stages, size))
        given = [_contiguous(part) for part in (residual.stages, residual.steps, residual.left,
                                                residual.right)]
        stopped = self._core.correct(self._factors.ctypes.data, count,
                                     *(array.ctypes.data for array in (*given, nodes, rates)))
        if stopped and self._watch is not None:
            raise self._watch.stopped()
        return nodes, rates


def split_indices(size: int, explicit: Indices) -> tuple[Any, Any]:
    """Return the explicit and the implicit unknowns as core.c wants them."""
    implicit = np.ones(size, dtype=bool)
    implicit[explicit] = False
    return np.ascontiguousarray(explicit, dtype=np.intc), np.flatnonzero(implicit).astype(np.intc)


def _contiguous(values: Any) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)
