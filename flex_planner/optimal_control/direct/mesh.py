"""Collocation methods on intervals of a unit of time, for the direct transcription."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from flex_planner.base.validation import Array
import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

SCHEMES = ('gauss', 'radau', 'hermite_simpson')
Indices = NDArray[np.intp]


class Columns(NamedTuple):
    """A sparse matrix by columns, as SciPy's ``csc_matrix`` keeps it."""

    shape: tuple[int, int]
    starts: Indices
    rows: Indices
    values: Array

    @classmethod
    def of(cls, matrix: Any) -> Columns:
        """Return a matrix of SciPy's in this form."""
        by_columns = matrix.tocsc()
        by_columns.sort_indices()
        return cls(matrix.shape, by_columns.indptr, by_columns.indices, by_columns.data)


class Transcription(NamedTuple):
    """What a programme has to know of a `Mesh`, in plain arrays."""

    weights: Array
    P: Columns
    Q: Columns


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """
    A collocation method on N intervals of a unit of time.

    The values are x at K points, then at those nodes that are no points. They satisfy
    ``P x = Q x'``, r rows per interval, of which the last leads to its right node; two more rows
    of P pick the first and the last node.

    Attributes
    ----------
    breaks : numpy.ndarray, shape (N + 1,)
        Ends of the intervals.
    points, weights : numpy.ndarray, shape (K,)
        Collocation times and the quadrature's weights.
    nodes : numpy.ndarray, shape (N + 1,)
        Which values they are.
    P, Q : scipy.sparse.csr_matrix
        Shapes (N r + 2, values) and (N r + 2, K).

    """

    breaks: Array
    points: Array
    weights: Array
    nodes: Indices
    P: Any
    Q: Any

    @classmethod
    def of(cls, scheme: str, degree: int, intervals: int, breaks: Array | None = None) -> Mesh:
        """
        Return one of `SCHEMES`; the degree counts the points per interval of the first two.

        On equal intervals, unless their ends from 0 to 1 are given.

        """
        if breaks is None:
            breaks = np.linspace(0, 1, intervals + 1, dtype=np.float64)
        c, steps = _collocation_points(scheme, degree), np.diff(breaks)
        index = np.arange(intervals)[:, None] * (c.size - (c[0] == 0)) + np.arange(c.size)
        targets, values, nodes = _values(index, c)
        integrals = _integrals(c, targets) * steps[:, None, None]
        weights = np.bincount(index.ravel(), integrals[:, -1].ravel()).astype(float)
        points = np.empty_like(weights)
        points[index] = breaks[:-1, None] + steps[:, None] * c
        rows = np.arange(values.size).reshape(values.shape)
        height, width = values.size + 2, max(points.size, int(nodes.max()) + 1)
        P = (_sparse((height, width), 1.0, rows, values)
             + _sparse((height, width), -1.0, rows, nodes[:-1, None])
             + _sparse((height, width), 1.0, values.size + np.arange(2), nodes[[0, -1]]))
        Q = _sparse((height, points.size), integrals, rows[:, :, None], index[:, None, :])
        return cls(breaks, points, weights, nodes, P, Q)

    def transcription(self) -> Transcription:
        """Return its equations and its quadrature."""
        return Transcription(self.weights, Columns.of(self.P), Columns.of(self.Q))

    def costates(self, multipliers: Array) -> tuple[Array, Array]:
        """Return psi at nodes and at points from multipliers of all rows (N r + 2, 2 n_t)."""
        of_intervals = multipliers[:-2].reshape(self.nodes.size - 1, -1, multipliers.shape[1])
        inner = -of_intervals[1:].sum(axis=1)
        if self.nodes[0] == 0:
            # the nodes are points of both their intervals: the mean of what both sides say, in
            # which the parts of f cancel but for O(h^4)
            inner = (inner - of_intervals[:-1, -1]) / 2
        at_nodes = np.vstack([-multipliers[-2], inner, multipliers[-1]])
        return at_nodes, -(self.Q.T @ multipliers) / self.weights[:, None]


def _collocation_points(scheme: str, degree: int) -> Array:
    """Return the points of an interval, from 0 to 1."""
    if scheme == 'hermite_simpson':
        return np.array([0.0, 0.5, 1.0])
    if scheme == 'gauss':
        gauss: Array = (legendre.leggauss(degree)[0] + 1) / 2
        return gauss
    inner = legendre.legroots([0.0] * (degree - 1) + [-1.0, 1.0])[:-1]
    return np.append((inner + 1) / 2, 1.0)


def _values(index: Indices, c: Array) -> tuple[Array, Indices, Indices]:
    """Return the ends of an interval's rows, their values (N, r), and the nodes (N + 1,)."""
    N, K = len(index), int(index[-1, -1]) + 1
    shared = int(c[0] == 0)
    first = 0 if shared else K
    if c[-1] == 1:
        return c[shared:], index[:, shared:], np.append(first, index[:, -1])
    nodes = K + np.arange(N + 1)
    return np.append(c, 1.0), np.hstack([index, nodes[1:, None]]), nodes


def _integrals(points: Array, targets: Array) -> Array:
    """Return the integrals of the Lagrange polynomials of points from 0 to each target."""
    lagrange = np.linalg.inv(legendre.legvander(2 * points - 1, points.size - 1))
    antiderivatives = legendre.legint(lagrange, lbnd=-1) / 2
    integrals: Array = legendre.legvander(2 * targets - 1, points.size) @ antiderivatives
    return integrals


def _sparse(shape: tuple[int, int], *triplets: Any) -> Any:
    """Return a sparse matrix from entries, rows and columns that are broadcast."""
    from scipy.sparse import csr_matrix

    entries, rows, columns = (part.ravel() for part in np.broadcast_arrays(*triplets))
    return csr_matrix((entries, (rows, columns)), shape)
