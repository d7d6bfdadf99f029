"""Stage equations with the Jacobian of every stage: the reference of core.c."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation.gauss import GaussRule
from flex_planner.collocation.problem import SINGULAR_STAGES, SingularSystemError
import numpy as np


class ExactStages:
    """
    The stage equations ``k_i = J_i (z_0 + h sum_j a_ij k_j) + r_i``, all s m at once.

    A Newton step with them converges quadratically where the mean Jacobian of an interval does
    not fit, at some times the price. Unknowns that need no factorisation are not told apart.

    """

    def __init__(self, rule: GaussRule, steps: Array, jacobians: Array) -> None:
        self._steps, self._jacobians, self._weights = steps, jacobians, rule.weights
        count, stages, size, _ = jacobians.shape
        # entry [n, i, :, j, :]: what stage i of interval n has of stage j
        coupled = (rule.matrix[:, None, :, None] * jacobians[:, :, :, None, :]
                   * steps[:, None, None, None, None])
        system = np.eye(stages * size) - coupled.reshape(count, stages * size, stages * size)
        try:
            self._inverse: Array = np.linalg.inv(system).astype(np.float64, copy=False)
        except np.linalg.LinAlgError:
            raise SingularSystemError(SINGULAR_STAGES) from None
        if not np.isfinite(self._inverse).all():
            raise SingularSystemError(SINGULAR_STAGES)

    def transition(self) -> Array:
        """Return d z_1 / d z_0 of every interval, shape (N, m, m)."""
        count, stages, size, _ = self._jacobians.shape
        by_node = self._inverse @ self._jacobians.reshape(count, stages * size, size)
        transition: Array = np.eye(size) + self._steps[:, None, None] * np.einsum(
            'i,nijk->njk', self._weights, by_node.reshape(count, stages, size, size))
        return transition

    def force(self, residual: Array) -> Array:
        """Return how a residual (N, s, m) moves the stages while the nodes stay."""
        flat = residual.reshape(len(residual), -1, 1)
        forced: Array = (self._inverse @ flat).reshape(residual.shape)
        return forced

    def correct(self, nodes: Array, forced: Array) -> Array:
        """Return the correction (N, s, m) of the stages, given that of the nodes (N, m)."""
        return self.force((self._jacobians @ nodes[:, None, :, None])[..., 0]) - forced

    def advance(self, forced: Array) -> Array:
        """Return h sum b_i k_i, shape (N, m)."""
        advance: Array = self._steps[:, None] * (self._weights @ forced)
        return advance
