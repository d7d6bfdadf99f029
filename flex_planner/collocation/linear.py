"""
Linear algebra of one Newton step: stages eliminated interval by interval, then one banded LU.

The transition matrices of the intervals are never multiplied together: the optimality
conditions grow and decay like e^100 along a motion, and only pivoting over all rows keeps that
stable.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.collocation.gauss import GaussRule
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

Array = NDArray[np.float64]


class SingularSystemError(ArithmeticError):
    """The linearised problem has no unique solution."""


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """
    What is left of the collocation equations and the boundary rows.

    Attributes
    ----------
    stages : numpy.ndarray, shape (N, s, m)
        Stage derivative minus F at the stage.
    steps : numpy.ndarray, shape (N, m)
        Gap between an interval's end and the next node.
    left, right : numpy.ndarray, shape (l,) and (m - l,)
        Boundary rows.

    """

    stages: Array
    steps: Array
    left: Array
    right: Array


class NewtonSystem:
    """
    The linearised collocation equations, factorised once for several right-hand sides.

    Parameters
    ----------
    rule : GaussRule
        The method, s stages.
    steps : numpy.ndarray, shape (N,)
        Interval lengths.
    jacobians : numpy.ndarray, shape (N, s, m, m)
        dF/dz at the stages.
    left, right : numpy.ndarray, shape (l, m) and (m - l, m)
        Jacobians of the boundary rows.
    scale : numpy.ndarray, shape (m,)
        Magnitudes of the unknowns: rows and columns are scaled by them for the pivoting.

    Raises
    ------
    SingularSystemError
        If a factor is singular or not finite.

    """

    def __init__(self, rule: GaussRule, steps: Array, jacobians: Array, left: Array,
                 right: Array, scale: Array) -> None:
        self._rule, self._steps, self._jacobians = rule, steps, jacobians
        self._scale = scale
        count, stages, size, _ = jacobians.shape
        self._inverse = _stage_inverse(rule, steps, jacobians)
        weights = steps[:, None] * rule.weights  # (N, s)
        rows = self._inverse.reshape(count, stages, size, stages * size)
        self._advance = np.einsum('ks,ksmj->kmj', weights, rows)
        transition = self._advance @ jacobians.reshape(count, stages * size, size)
        transition += np.eye(size)
        self._factorise(transition, left, right)

    def _factorise(self, transition: Array, left: Array, right: Array) -> None:
        """Assemble the banded matrix of the node equations and factorise it."""
        count, size, _ = transition.shape
        self._left_rows = top = left.shape[0]
        self._lower, self._upper = top + size - 1, 2 * size - 1 - top
        order = (count + 1) * size
        band = np.zeros((2 * self._lower + self._upper + 1, order))
        scale = self._scale
        blocks = -transition * scale / scale[:, None]
        shift = np.arange(count) * size

        def put(rows: NDArray[np.intp], columns: NDArray[np.intp], values: Array) -> None:
            band[self._lower + self._upper + rows - columns, columns] = values

        inner = np.arange(size)
        rows = (top + shift)[:, None, None] + inner[:, None]
        put(rows, shift[:, None, None] + inner, blocks)
        put((top + shift)[:, None] + inner, (size + shift)[:, None] + inner, np.array(1.0))
        self._row_scale = np.concatenate([_row_sizes(left * scale), _row_sizes(right * scale)])
        put(np.arange(top)[:, None], inner, left * scale / self._row_scale[:top, None])
        put((top + count * size + np.arange(size - top))[:, None], count * size + inner,
            right * scale / self._row_scale[top:, None])
        self._factors, self._pivots, info = lapack.dgbtrf(
            band, self._lower, self._upper, overwrite_ab=True)
        if info or not np.isfinite(self._factors).all():
            raise SingularSystemError('the linearised boundary-value problem is singular')

    def correction(self, residual: Residual) -> tuple[Array, Array]:
        """
        Return the Newton correction of nodes (N + 1, m) and stage derivatives (N, s, m).

        Parameters
        ----------
        residual : Residual
            At any point; the matrix stays the one factorised.

        """
        count, stages, size = residual.stages.shape
        flat = residual.stages.reshape(count, stages * size, 1)
        # end of the interval as the stages would have it, given the nodes
        gaps = -residual.steps - (self._advance @ flat)[..., 0]
        top = self._left_rows
        rhs = np.concatenate([-residual.left / self._row_scale[:top],
                              (gaps / self._scale).ravel(),
                              -residual.right / self._row_scale[top:]])
        solution, info = lapack.dgbtrs(self._factors, self._lower, self._upper, rhs,
                                       self._pivots)
        if info:
            raise SingularSystemError('the linearised boundary-value problem is singular')
        nodes = solution.reshape(count + 1, size) * self._scale
        forcing = (self._jacobians @ nodes[:-1, None, :, None])[..., 0] - residual.stages
        change = self._inverse @ forcing.reshape(count, stages * size, 1)
        return nodes, change.reshape(count, stages, size)


def _row_sizes(rows: Array) -> Array:
    """Return the largest entry of each row, to scale it by."""
    sizes: Array = np.abs(rows).max(axis=1, initial=0.0)
    if not np.isfinite(sizes).all() or (sizes == 0).any():
        raise SingularSystemError('a boundary row is zero or not finite')
    return sizes


def _stage_inverse(rule: GaussRule, steps: Array, jacobians: Array) -> Array:
    """Return the inverses of ``I - h A (x) dF/dz`` of all intervals, (N, s m, s m)."""
    count, stages, size, _ = jacobians.shape
    weights = steps[:, None, None] * rule.matrix  # (N, s, s)
    system = -np.einsum('kij,kiab->kiajb', weights, jacobians)
    system = system.reshape(count, stages * size, stages * size)
    diagonal = np.arange(stages * size)
    system[:, diagonal, diagonal] += 1
    try:
        inverse: Array = np.linalg.inv(system)
    except np.linalg.LinAlgError:
        raise SingularSystemError('the stage equations of an interval are singular') from None
    return inverse
