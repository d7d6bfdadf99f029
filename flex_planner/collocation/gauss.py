"""Gauss-Legendre collocation: nodes, Butcher matrix and the polynomial inside an interval."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
    integrals : numpy.ndarray, shape (s, s + 1)
        Coefficients, lowest power first, of the integral of each Lagrange polynomial.

    """

    nodes: Array
    weights: Array
    matrix: Array
    integrals: Array

    @staticmethod
    @cache
    def of(stages: int) -> GaussRule:
        """Return the rule with a number of stages, from 2 to 8."""
        if not 2 <= stages <= 8:
            raise ValueError(f'stages is {stages}, but must be from 2 to 8')
        points, weights = np.polynomial.legendre.leggauss(stages)
        nodes = (points + 1) / 2
        coefficients = np.zeros((stages, stages + 1))
        for j in range(stages):
            others = np.delete(nodes, j)
            lagrange = Polynomial.fromroots(others) / np.prod(nodes[j] - others)
            coefficients[j] = lagrange.integ().coef
        matrix = np.vander(nodes, stages + 1, increasing=True) @ coefficients.T
        return GaussRule(nodes, weights / 2, matrix, coefficients)

    @property
    def stages(self) -> int:
        """Return the number of stages, s."""
        return int(self.nodes.size)

    def basis(self, theta: Array) -> Array:
        """Return the integrals of the Lagrange polynomials up to theta, shape (k, s)."""
        basis: Array = np.vander(theta, self.stages + 1, increasing=True) @ self.integrals.T
        return basis

    def basis_rate(self, theta: Array) -> Array:
        """Return the Lagrange polynomials at theta, shape (k, s)."""
        powers = np.vander(theta, self.stages, increasing=True)
        degrees = np.arange(1, self.stages + 1, dtype=np.float64)
        rate: Array = powers @ (self.integrals[:, 1:] * degrees).T
        return rate
