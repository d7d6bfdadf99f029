"""
Linear algebra of one Newton step: stages eliminated interval by interval, then one banded LU.

This is what core.c does in compiled code, several times faster: the reference that it is compared
with, and what is left where there is no compiler.

The transition matrices of the intervals are never multiplied together: the optimality
conditions grow and decay like e^100 along a motion, and only pivoting over all rows keeps that
stable.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.banded import BandedFactors
from flex_planner.collocation.exact_stages import ExactStages
from flex_planner.collocation.gauss import GaussRule
from flex_planner.collocation.junctions import JunctionRows, NO_JUNCTIONS
from flex_planner.collocation.mean_stages import MeanStages
from flex_planner.collocation.problem import Indices, SingularSystemError
import numpy as np

SINGULAR_PROBLEM = 'the linearised boundary-value problem is singular'
BAD_BOUNDARY_ROW = 'a boundary row is zero or not finite'


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """
    What is left of the collocation equations and the boundary rows.

    Attributes
    ----------
    stages : numpy.ndarray, shape (N, s, m)
        Stage derivative minus F at the stage.
    steps : numpy.ndarray, shape (N, m)
        Gap between an interval's end and the next node; at a junction, what does not hold.
    left, right : numpy.ndarray, shape (l,) and (m - l,)
        Boundary rows.

    """

    stages: Array
    steps: Array
    left: Array
    right: Array


class Stages(Protocol):
    """The stage equations of all intervals, factorised."""

    def transition(self) -> Array:
        """Return d z_1 / d z_0 of every interval, shape (N, m, m)."""

    def force(self, residual: Array) -> Any:
        """Return how a residual (N, s, m) moves the stages while the nodes stay."""

    def advance(self, forced: Any) -> Array:
        """Return what that adds to the end of each interval, shape (N, m)."""

    def correct(self, nodes: Array, forced: Any) -> Array:
        """Return the correction (N, s, m) of the stages, given that of the nodes (N, m)."""


class LinearSystem(Protocol):
    """The linearised collocation equations, factorised once for several right-hand sides."""

    def with_rule(self, rule: GaussRule, monitor: Monitor | None = None) -> LinearSystem:
        """
        Return the system of another rule on the same mesh; a monitor may stop it.

        Its factors are its own: on a step much longer than a layer one more stage turns the sign
        of the transition matrix.

        """

    def correction(self, residual: Residual) -> tuple[Array, Array]:
        """
        Return the Newton correction of nodes (N + 1, m) and stage derivatives (N, s, m).

        Parameters
        ----------
        residual : Residual
            At any point; the matrix stays the one factorised.

        """


class NewtonSystem:
    """
    A `LinearSystem` by NumPy and LAPACK.

    Parameters
    ----------
    rule : GaussRule
        The method, s stages.
    steps : numpy.ndarray, shape (N,)
        Interval lengths.
    jacobians : numpy.ndarray, shape (N, m, m) or (N, s, m, m)
        Mean of dF/dz over each interval; or dF/dz at every stage, for exact stage equations.
    left, right : numpy.ndarray, shape (l, m) and (m - l, m)
        Jacobians of the boundary rows.
    scale : numpy.ndarray, shape (m,)
        Magnitudes of the unknowns: rows and columns are scaled by them for the pivoting.
    explicit : numpy.ndarray of int
        See `BoundaryValueProblem.explicit`.
    junctions : JunctionRows
        What stands for the step of intervals of no length.

    Raises
    ------
    SingularSystemError
        If a factor is singular or not finite.

    """

    def __init__(self, rule: GaussRule, steps: Array, jacobians: Array, left: Array,
                 right: Array, scale: Array, explicit: Indices,
                 junctions: JunctionRows = NO_JUNCTIONS) -> None:
        self._rule, self._scale, self._left_rows = rule, scale, left.shape[0]
        self._junctions = junctions
        self._parts = steps, jacobians, left, right, scale, explicit
        self._stages: Stages = (
            ExactStages(rule, steps, jacobians) if jacobians.ndim == 4
            else MeanStages(rule, steps, jacobians, explicit))
        self._lower = left.shape[0] + scale.size - 1
        self._upper = 2 * scale.size - 1 - left.shape[0]
        self._row_scale = np.concatenate([_row_sizes(left * scale), _row_sizes(right * scale)])
        band = self._assemble(self._stages.transition(), left, right)
        self._factors = BandedFactors(band, self._lower, self._upper)
        if self._factors.singular:
            raise SingularSystemError(SINGULAR_PROBLEM)

    def with_rule(self, rule: GaussRule, monitor: Monitor | None = None) -> NewtonSystem:
        """Return the system of another rule on the same mesh."""
        if monitor is not None:
            monitor.check()
        steps, jacobians, left, right, scale, explicit = self._parts
        return NewtonSystem(rule, steps, resample_jacobians(jacobians, self._rule, rule), left,
                            right, scale, explicit, self._junctions)

    def _assemble(self, transition: Array, left: Array, right: Array) -> Array:
        """Return the banded matrix of the node equations: left rows, intervals, right rows."""
        count, size, _ = transition.shape
        top, scale = self._left_rows, self._scale
        # Fortran order, as LAPACK wants it: column by column of the matrix
        columns = np.zeros(((count + 1) * size, 2 * self._lower + self._upper + 1))
        diagonal = self._lower + self._upper
        inner = np.arange(size)
        blocks = (-transition * scale / scale[:, None]).swapaxes(1, 2)
        at, rows = self._junctions.intervals, self._junctions.rows
        if at.size:
            joined = (rows * np.tile(scale, 2) / scale[:, None]).swapaxes(1, 2)
            blocks[at] = joined[:, :size]
        per_node = columns.reshape(count + 1, size, -1)
        # entry (row, column) of the matrix stands at diagonal + row - column
        within = diagonal + top + inner - inner[:, None]
        per_node[:-1, inner[:, None], within] = blocks
        per_node[1:, inner, diagonal + top - size] = 1
        if at.size:
            per_node[at[:, None, None] + 1, inner[:, None], within - size] = joined[:, size:]
        per_node[0, inner[:, None], diagonal + np.arange(top) - inner[:, None]] = (
            left * scale / self._row_scale[:top, None]).T
        per_node[-1, inner[:, None], diagonal + np.arange(top, size) - inner[:, None]] = (
            right * scale / self._row_scale[top:, None]).T
        return columns.T

    def correction(self, residual: Residual) -> tuple[Array, Array]:
        """Return the Newton correction of nodes (N + 1, m) and stage derivatives (N, s, m)."""
        top, stages = self._left_rows, self._stages
        forced = stages.force(residual.stages)
        # end of the interval as the stages would have it, given the nodes
        gaps = -residual.steps - stages.advance(forced)
        rhs = np.concatenate([-residual.left / self._row_scale[:top],
                              (gaps / self._scale).ravel(),
                              -residual.right / self._row_scale[top:]])
        nodes = self._factors.solve(rhs).reshape(-1, self._scale.size) * self._scale
        return nodes, stages.correct(nodes[:-1], forced)


def resample_jacobians(jacobians: Array, before: GaussRule, rule: GaussRule) -> Array:
    """Return Jacobians for the stages of another rule; a mean (N, m, m) serves any."""
    if jacobians.ndim == 3:
        return jacobians
    count, stages, *shape = jacobians.shape
    flat = before.basis_rate(rule.nodes) @ jacobians.reshape(count, stages, -1)
    resampled: Array = flat.reshape(count, rule.stages, *shape)
    return resampled


def _row_sizes(rows: Array) -> Array:
    """Return the largest entry of each row, to scale it by."""
    sizes: Array = np.abs(rows).max(axis=1, initial=0.0)
    if not np.isfinite(sizes).all() or (sizes == 0).any():
        raise SingularSystemError(BAD_BOUNDARY_ROW)
    return sizes
