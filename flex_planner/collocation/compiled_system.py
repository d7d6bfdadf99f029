"""The linear system of a Newton step in compiled code, see core.c."""

from __future__ import annotations

from typing import Any

from flex_planner.base.validation import Array
from flex_planner.collocation.core import Core, CoreSizes, load_core, pack_rule
from flex_planner.collocation.gauss import GaussRule
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

# what `factorise_system` of core.c returns
_FAILURES = {1: SINGULAR_STAGES, 2: BAD_BOUNDARY_ROW, 3: SINGULAR_PROBLEM}


def factorise_system(rule: GaussRule, steps: Array, jacobians: Array, left: Array, right: Array,
                     scale: Array, explicit: Indices) -> LinearSystem:
    """
    Return the linearised collocation equations, factorised by the fastest means there are.

    The arguments are those of `NewtonSystem`, and so are the errors.

    """
    sizes = CoreSizes(scale.size, left.shape[0], explicit.size, rule.stages,
                      int(jacobians.ndim == 4))
    core = load_core(sizes)
    if core is None:
        return NewtonSystem(rule, steps, jacobians, left, right, scale, explicit)
    return CompiledSystem(core, rule, steps, jacobians, left, right, scale, explicit)


class CompiledSystem:
    """
    A `NewtonSystem` in compiled code, which runs without the interpreter lock.

    Parameters
    ----------
    core : Core
        Compiled for these sizes.
    rule, steps, jacobians, left, right, scale, explicit
        Those of `NewtonSystem`.

    Raises
    ------
    SingularSystemError
        If a factor is singular or not finite.

    """

    def __init__(self, core: Core, rule: GaussRule, steps: Array, jacobians: Array, left: Array,
                 right: Array, scale: Array, explicit: Indices) -> None:
        self._core, self._rule = core, rule
        self._parts = steps, jacobians, left, right, scale, explicit
        self._shape = steps.size, rule.stages, scale.size
        # memory that has been used before: fresh pages cost as much as the arithmetic
        self._factors = np.empty(core.factorisation_size(steps.size), dtype=np.uint8)
        indices = (explicit, np.setdiff1d(np.arange(scale.size), explicit))
        numbers = map(_contiguous, (steps, jacobians, left, right, scale))
        arrays: list[Any] = [
            pack_rule(rule), *numbers,
            *(np.ascontiguousarray(part, dtype=np.intc) for part in indices)]
        failure = core.factorise_system(self._factors.ctypes.data, steps.size,
                                        *(array.ctypes.data for array in arrays))
        if failure:
            raise SingularSystemError(_FAILURES[failure])

    def with_rule(self, rule: GaussRule) -> LinearSystem:
        """Return the system of another rule on the same mesh, see `NewtonSystem.with_rule`."""
        steps, jacobians, left, right, scale, explicit = self._parts
        return factorise_system(rule, steps, resample_jacobians(jacobians, self._rule, rule),
                                left, right, scale, explicit)

    def correction(self, residual: Residual) -> tuple[Array, Array]:
        """Return the correction of nodes (N + 1, m) and stage derivatives (N, s, m)."""
        count, stages, size = self._shape
        nodes, rates = np.empty((count + 1, size)), np.empty((count, stages, size))
        given = [_contiguous(part) for part in (residual.stages, residual.steps, residual.left,
                                                residual.right)]
        self._core.correct(self._factors.ctypes.data, count,
                           *(array.ctypes.data for array in (*given, nodes, rates)))
        return nodes, rates


def _contiguous(values: Any) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)
