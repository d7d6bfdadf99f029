"""
The stage equations of all intervals with the mean Jacobian of each: the reference of core.c.

Inside an interval dF/dz is replaced by its mean over the stages. Then the eigenvectors of the
Butcher matrix split the s m stage equations into s/2 complex systems of size m (Butcher, BIT 16,
1976), and of those only the implicit unknowns have to be factorised. The residual stays that of
the true equations, so this costs a digit or two of convergence per iteration and no accuracy.

"""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation.gauss import ComplexArray, GaussRule
from flex_planner.collocation.problem import Indices, SINGULAR_STAGES, SingularSystemError
import numpy as np


class MeanStages:
    """
    The stage equations ``k_i = J (z_0 + h sum_j a_ij k_j) + r_i`` of all intervals.

    In the eigenvectors of A they read ``(I - mu J) x = r`` with mu = h lambda. The rates of the
    explicit unknowns E depend on one another through J_EE with J_EE^2 = 0, so that
    ``(I - mu J_EE)^-1 = I + mu J_EE``, and only the Schur complement of the implicit unknowns I is
    inverted. Vectors are stored as (N, m, r) complex numbers.

    """

    def __init__(self, rule: GaussRule, steps: Array, jacobians: Array,
                 explicit: Indices) -> None:
        self._rule, self._steps, self._jacobians = rule, steps, jacobians
        size = jacobians.shape[-1]
        self._explicit = explicit
        self._implicit = np.setdiff1d(np.arange(size), explicit)
        E, inner = self._explicit, self._implicit
        # J_IE and J_EE, and what they make of the rows of J
        self._across, self._among = jacobians[:, inner[:, None], E], jacobians[:, E[:, None], E]
        self._rows = jacobians[:, E], jacobians[:, inner]
        self._once = self._across @ self._rows[0]
        self._again = self._among @ self._rows[0]
        self._twice = self._across @ self._again
        # the columns of the implicit unknowns, contiguous for many products
        self._down = np.ascontiguousarray(self._rows[0][..., inner])
        self._down_again = np.ascontiguousarray(self._again[..., inner])
        mu = steps[:, None] * rule.spectrum.eigenvalues
        self._mu: ComplexArray = mu.astype(np.complex128)
        self._inverse = self._invert()

    def _invert(self) -> ComplexArray:
        """Return the inverses of the Schur complements, shape (N, r, i, i)."""
        mu, inner = self._mu[:, :, None, None], self._implicit
        first, second, third = (part[:, None][..., inner] for part in (
            self._rows[1], self._once, self._twice))
        system = -mu * (first + mu * (second + mu * third))
        diagonal = np.arange(inner.size)
        system[..., diagonal, diagonal] += 1
        try:
            inverse = np.linalg.inv(system).astype(np.complex128, copy=False)
        except np.linalg.LinAlgError:
            raise SingularSystemError(SINGULAR_STAGES) from None
        if _is_singular(system, inverse):
            raise SingularSystemError(SINGULAR_STAGES)
        return inverse

    def transition(self) -> Array:
        """Return d z_1 / d z_0 of every interval, shape (N, m, m)."""
        count, r = self._mu.shape
        size, spectrum = self._jacobians.shape[-1], self._rule.spectrum
        weights = (self._rule.weights @ spectrum.vectors) * spectrum.inverse.sum(axis=1)
        powers = weights * spectrum.eigenvalues ** np.arange(5)[:, None]  # (5, r)
        flat = self._inverse.reshape(count, r, -1)
        sums = powers.real @ flat.real - powers.imag @ flat.imag
        width, by_power = self._implicit.size, self._steps[:, None] ** np.arange(5)
        # entry p: h^p times the real part of sum w lambda^p S^-1
        powers_of = sums.reshape(count, 5, width, width) * by_power[:, :, None, None]
        h = self._steps[:, None, None]
        of_explicit, of_implicit = self._rows

        def moment(p: int) -> Array:
            """Return the weighted sum of mu^p times the implicit stages of all columns."""
            terms = (of_implicit, self._once, self._twice)
            total: Array = sum(powers_of[:, p + k] @ term for k, term in enumerate(terms))
            return total

        transition = np.empty((count, size, size))
        transition[:, self._implicit] = h * moment(0)
        transition[:, self._explicit] = h * (
            of_explicit + h / 2 * self._again + self._down @ moment(1)
            + self._down_again @ moment(2))
        transition += np.eye(size)
        return transition

    def force(self, residual: Array) -> ComplexArray:
        """Return how a residual (N, s, m) moves the stages while the nodes stay."""
        return self._solve(self._split(residual))

    def correct(self, nodes: Array, forced: ComplexArray) -> Array:
        """Return the correction (N, s, m) of the stages, given that of the nodes (N, m)."""
        rates = (self._jacobians @ nodes[..., None])[..., 0]
        constant = rates[..., None] * self._rule.spectrum.inverse.sum(axis=1)
        return self._join(self._solve(constant) - forced)

    def _solve(self, r: ComplexArray) -> ComplexArray:
        """Return x of ``(I - mu J) x = r``, shapes (N, m, r)."""
        E, inner, mu = self._explicit, self._implicit, self._mu[:, None, :]
        x = np.empty_like(r)
        r_E = np.ascontiguousarray(r[:, E])
        among = _times(self._among, r_E)
        rhs = r[:, inner] + mu * (_times(self._across, r_E) + mu * _times(self._across, among))
        solved = (self._inverse @ rhs.swapaxes(1, 2)[..., None])[..., 0].swapaxes(1, 2)
        moved = mu * solved
        x[:, inner] = solved
        x[:, E] = (r_E + mu * among + _times(self._down, moved)
                   + _times(self._down_again, mu * moved))
        return x

    def _split(self, stages: Array) -> ComplexArray:
        """Return stage vectors (N, s, m) in the eigenvectors, (N, m, r)."""
        values = stages.swapaxes(1, 2)
        inverse = self._rule.spectrum.inverse.T
        split = values @ inverse.real + 1j * (values @ inverse.imag)
        return split.astype(np.complex128, copy=False)

    def _join(self, x: ComplexArray) -> Array:
        """Return stage vectors (N, s, m) of their parts in the eigenvectors."""
        vectors = self._rule.spectrum.vectors.T
        join: Array = (x.real @ vectors.real - x.imag @ vectors.imag).swapaxes(1, 2)
        return join

    def advance(self, x: ComplexArray) -> Array:
        """Return h sum b_i k_i, shape (N, m)."""
        weights = self._rule.weights @ self._rule.spectrum.vectors
        advance: Array = self._steps[:, None] * (x @ weights).real
        return advance


def _times(matrices: Array, vectors: ComplexArray) -> ComplexArray:
    """Return real matrices (N, a, b) times complex vectors (N, b, r) without widening them."""
    pairs = np.ascontiguousarray(vectors).view(np.float64)
    product: ComplexArray = (matrices @ pairs).view(np.complex128)
    return product


def _is_singular(system: ComplexArray, inverse: ComplexArray) -> bool:
    """
    Tell whether rounding may have made a system ``I - T`` of one that has no inverse.

    If all terms of ``I - T`` change by 1 / sum_ij |inverse_ij| (|I| + |T|)_ji of themselves, it
    may be singular, in whatever units the unknowns are.

    """
    size, limit = system.shape[-1], 0.1 / np.finfo(np.float64).eps
    if 2 * size**2 * _largest_part(inverse) * (_largest_part(system) + 2) < limit:
        return False  # as nearly always, without all the magnitudes
    terms = np.abs(system - np.eye(size)) + np.eye(size)
    sensitivity = np.einsum('...ij,...ji', np.abs(inverse), terms)
    return not (sensitivity < limit).all()


def _largest_part(values: ComplexArray) -> float:
    """Return the largest magnitude of a real or imaginary part."""
    return max(float(np.abs(part).max(initial=0)) for part in (values.real, values.imag))
