"""
Gauss-Legendre collocation: nodes, Butcher matrix and the polynomial inside an interval.

Everything is built from Legendre polynomials on the interval, which stay well-conditioned at
any order; powers of the time would lose a digit with every stage.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from flex_planner.base.validation import Array
import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]
LongArray = NDArray[np.longdouble]
ComplexLongArray = NDArray[np.clongdouble]

FEWEST_STAGES, MOST_STAGES = 2, 12


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """
    Eigenvectors of a Butcher matrix, one of each conjugate pair: ``A = Re(V Lambda V^-1)``.

    Attributes
    ----------
    eigenvalues : numpy.ndarray, shape (r,)
        Those with an imaginary part >= 0, r = ceil(s / 2).
    vectors : numpy.ndarray, shape (s, r)
        Columns of V, doubled where they stand for a pair.
    inverse : numpy.ndarray, shape (r, s)
        Rows of V^-1.

    """

    eigenvalues: ComplexArray
    vectors: ComplexArray
    inverse: ComplexArray


@dataclass(frozen=True, slots=True, eq=False)
class GaussRule:
    """
    The s-stage Gauss method on ``[0, 1]``, of order 2 s at the mesh nodes.

    Attributes
    ----------
    nodes, weights : numpy.ndarray, shape (s,)
        c_i and b_i.
    matrix : numpy.ndarray, shape (s, s)
        a_ij: integral of the j-th Lagrange polynomial from 0 to c_i.
    transform : numpy.ndarray, shape (s, s)
        Values at the nodes to coefficients of the Legendre polynomials on [0, 1].
    spectrum : Spectrum
        Of `matrix`.

    """

    nodes: Array
    weights: Array
    matrix: Array
    transform: Array
    spectrum: Spectrum

    @staticmethod
    @cache
    def of(stages: int) -> GaussRule:
        """Return the rule with a number of stages, from 2 to 12."""
        if not FEWEST_STAGES <= stages <= MOST_STAGES:
            raise ValueError(f'stages is {stages}, but must be from {FEWEST_STAGES} to '
                             f'{MOST_STAGES}')
        points, weights = legendre.leggauss(stages)
        nodes, degrees = (points + 1) / 2, np.arange(stages)
        # Gauss quadrature is exact for the products of Legendre polynomials that this needs
        transform = ((2 * degrees + 1)[:, None] * legendre.legvander(points, stages - 1).T
                     * weights / 2)
        matrix = _integrate_polynomials(points, stages) @ transform
        return GaussRule(nodes, weights / 2, matrix, transform, _spectrum(points, weights))

    def __reduce__(self) -> tuple[Callable[[int], GaussRule], tuple[int]]:
        """Pickle as the number of stages: there is one rule for each."""
        return GaussRule.of, (self.stages,)

    def reconstruction_arguments(self) -> tuple[int]:
        """Return the arguments of `reconstruct`."""
        return (self.stages,)

    @staticmethod
    def reconstruct(stages: int) -> GaussRule:
        """Return the rule with a number of stages."""
        return GaussRule.of(stages)

    @property
    def stages(self) -> int:
        """Return the number of stages, s."""
        return int(self.nodes.size)

    def basis(self, theta: Array) -> Array:
        """Return the integrals of the Lagrange polynomials up to theta, shape (k, s)."""
        basis: Array = _integrate_polynomials(2 * theta - 1, self.stages) @ self.transform
        return basis

    def basis_rate(self, theta: Array) -> Array:
        """Return the Lagrange polynomials at theta, shape (k, s)."""
        rate: Array = _legendre_polynomials(2 * theta - 1, self.stages - 1).T @ self.transform
        return rate


def differentiation_matrix(points: Array) -> Array:
    """
    Return the matrix from values of a polynomial at points to its derivatives there.

    Parameters
    ----------
    points : numpy.ndarray, shape (k,)
        Distinct, from 0 to 1.

    """
    at = 2 * points - 1  # where Chebyshev polynomials are well apart
    values = chebyshev.chebvander(at, at.size - 1)
    slopes = np.stack([chebyshev.chebval(at, chebyshev.chebder(row))
                       for row in np.eye(at.size)])
    matrix: Array = np.array(2 * np.linalg.solve(values.T, slopes).T, dtype=np.float64)
    return matrix


def _integrate_polynomials(x: Array, count: int) -> Array:
    """Return the integrals up to theta = (1 + x) / 2 of the first Legendre polynomials in x."""
    values = _legendre_polynomials(x, count)
    integrals, k = np.empty((count, x.size)), np.arange(1, count)
    integrals[0] = (1 + x) / 2
    integrals[1:] = (values[2:] - values[:-2]) / (2 * (2 * k + 1))[:, None]
    return np.ascontiguousarray(integrals.T)


def _legendre_polynomials(x: Array, degree: int) -> Array:
    """Return what NumPy's legvander has as columns, in rows: in half the time where x is short."""
    values = np.empty((degree + 1, x.size), dtype=x.dtype)
    values[0], values[1] = 1, x
    for k in range(2, degree + 1):
        values[k] = (values[k - 1] * x * (2 * k - 1) - values[k - 2] * (k - 1)) / k
    return values


def _spectrum(points: Array, weights: Array) -> Spectrum:
    """
    Return the eigenvectors that a real system needs.

    In normalised Legendre polynomials the Butcher matrix is tridiagonal, X = 1/2 in the corner
    and +-1 / (2 sqrt(4 k^2 - 1)) beside the diagonal (Hairer and Wanner, Solving ODEs II, IV.5).
    X with the signs of every other row and column changed is X transposed: so a row of V^-1 is
    its column of V with these signs, divided by their product, and nothing is inverted.

    """
    count = points.size
    beside = 1 / (2 * np.sqrt(4 * np.arange(1, count, dtype=np.longdouble)**2 - 1))
    X = (np.diag(beside, -1) - np.diag(beside, 1)).astype(np.longdouble)
    X[0, 0] = 0.5
    eigenvalues, vectors = _refine_eigenvectors(X)
    signed = vectors * (-1.0)**np.arange(count)[:, None]
    rows = (signed / (signed * vectors).sum(axis=0)).T
    vectors = vectors * np.where(eigenvalues.imag > 0, 2, 1)
    rows = rows @ (2 * np.eye(count) - (vectors @ rows).real)  # an error of 1e-8 is squared
    polynomials = legendre.legvander(points, count - 1) * np.sqrt(2 * np.arange(count) + 1)
    return Spectrum(*(part.astype(np.complex128) for part in (
        eigenvalues, polynomials @ vectors, rows @ (polynomials.T * weights / 2))))


def _refine_eigenvectors(X: LongArray) -> tuple[ComplexLongArray, ComplexLongArray]:
    """
    Return eigenvalues, one of each pair, and eigenvectors whose first component is 1.

    The eigenvectors lie so close to one another that what LAPACK makes of them loses a digit with
    every stage: Newton's method with residuals in long double wins these back.

    """
    eigenvalues, vectors = np.linalg.eig(X.astype(np.float64))
    kept = eigenvalues.imag > -1e-9 * np.abs(eigenvalues)
    values, chosen = eigenvalues[kept], vectors[:, kept]
    real = np.abs(values.imag) < 1e-9 * np.abs(values)
    values = np.where(real, values.real, values).astype(np.clongdouble)
    chosen = np.where(real, chosen.real, chosen).astype(np.clongdouble)
    chosen /= chosen[0]
    diagonal = np.arange(X.shape[0])
    for _ in range(3):  # quadratic from eight digits; the last for rounding
        system = np.repeat(X[None].astype(np.complex128), values.size, axis=0)
        system[:, diagonal, diagonal] -= values[:, None]
        system[..., 0] = -chosen.T  # of the eigenvalue, as the first component stays
        residual = (X @ chosen - chosen * values).T[..., None].astype(np.complex128)
        change = np.linalg.solve(system, -residual)[..., 0].T
        values = values + change[0]
        chosen[1:] += change[1:]
    return values, chosen
