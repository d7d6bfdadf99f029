"""
The offset of the effort with which differing arms arrive calmly.

To J of eq. (6) is added a weight times the energy with which S arms arrive. With responses G of
their states and N of that of the plan, linear in a change v of the torque, its least is where

    R (u + v) + G^T m + N^T l = 0,    m = weight (e + G v),    N v = 0

with e what they miss. As the plan is an extremal of effort from an offset w, ``R u = R w - N^T l``
of its own, the torque is ``-R^-1 (G^T m + N^T l')`` away from what the costates of the plan ask
for: an offset that leaves these as they are. The plan that it leads to is an extremal again,
within the limits of the motors, whatever was linearised.

"""

from __future__ import annotations

from dataclasses import dataclass, field

from flex_planner.base.validation import Array
from flex_planner.optimal_control.torque_offset import TorqueOffset
from flex_planner.planning.robust.responses import Responses
import numpy as np

# polynomials of the offset for each step of the responses
_PIECES = 0.4
# of the scaled system, whose responses may depend on one another
_RIDGE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OffsetStep:
    """
    The linear system of the multipliers of one plan, for any weight.

    Parameters
    ----------
    responses : Responses
        Of S arms, on g steps.
    effort_weights : numpy.ndarray, shape (n,)
        Diagonal of R.
    offset : numpy.ndarray, shape (g, n)
        w of the plan at the middles of the steps [N m].
    rows : numpy.ndarray, shape (r, g n)
        G over N.
    gram : numpy.ndarray, shape (r, r)
        (G; N) R^-1 (G; N)^T over the steps in which motors are between their limits.
    drift : numpy.ndarray, shape (r,)
        What the states would change by without the offset.

    """

    responses: Responses
    effort_weights: Array
    offset: Array
    rows: Array
    gram: Array
    drift: Array
    _multipliers: dict[float, Array] = field(default_factory=dict[float, Array], repr=False)

    @classmethod
    def of(cls, responses: Responses, effort_weights: Array, offset: TorqueOffset) -> OffsetStep:
        """Return the system of a plan with an offset."""
        w, free = offset(responses.times), responses.free.ravel()
        rows = np.ascontiguousarray(responses.stacked.transpose(1, 0, 2)).reshape(
            responses.stacked.shape[1], -1)
        root = free / np.sqrt(np.tile(effort_weights * responses.step, len(w)))
        weighed = rows * root
        return cls(responses=responses, effort_weights=effort_weights, offset=w, rows=rows,
                   gram=_gram(weighed, responses.roots.shape[-1]),
                   drift=-_combine(rows, free * w.ravel()))

    def multipliers(self, weight: float) -> Array:
        """Return m and l' for a weight > 0 [1/J], shape (r,)."""
        if weight not in self._multipliers:
            self._multipliers[weight] = self._solve(weight)
        return self._multipliers[weight]

    def _solve(self, weight: float) -> Array:
        count = self.responses.misses.size
        system, right = self.gram.copy(), self.drift.copy()
        system[:count, :count] += np.eye(count) / weight
        right[:count] += self.responses.misses
        scale = 1 / np.sqrt(np.maximum(np.diag(system), np.finfo(float).tiny))
        system *= np.outer(scale, scale)
        system += _RIDGE * np.eye(right.size)
        multipliers: Array = scale * np.linalg.solve(system, right * scale)
        return multipliers

    def predict_misses(self, weight: float) -> Array:
        """Return what the arms would miss with a weight, as `Responses.misses`."""
        misses: Array = self.multipliers(weight)[:self.responses.misses.size] / weight
        return misses

    def predict_effort(self, weight: float, torques: Array) -> float:
        """Return the share by which effort would grow from that of torques (g, n)."""
        R = self.effort_weights
        changed = torques + self.responses.free * (self.wanted(weight) - self.offset)
        return float((R * changed**2).sum() / max((R * torques**2).sum(), 1e-300)) - 1

    def wanted(self, weight: float) -> Array:
        """Return the offset at the middles of the steps, shape (g, n) [N m]."""
        pulls = _combine(self.rows.T, self.multipliers(weight)).reshape(self.offset.shape)
        wanted: Array = -pulls / (self.effort_weights * self.responses.step)
        return wanted

    def make_offset(self, weight: float, share: float = 1.0) -> TorqueOffset:
        """Return the offset for a weight, or a share of the way from that of the plan to it."""
        times, step = self.responses.times, self.responses.step
        wanted = self.offset + share * (self.wanted(weight) - self.offset)
        duration = times[-1] + step / 2
        ends = [1.5 * wanted[i] - 0.5 * wanted[j] for i, j in ((0, 1), (-1, -2))]
        breaks = np.linspace(0, duration, int(_PIECES * times.size) + 1, dtype=np.float64)
        return TorqueOffset.fit(np.concatenate([[0.0], times, [duration]]),
                                np.vstack([ends[0], wanted, ends[1]]), breaks)


def _gram(rows: Array, size: int) -> Array:
    """
    Return the products of rows (r, k), in blocks of a size that r is a multiple of.

    What is so small NumPy's linear algebra does in one thread: others would take longer to wake.

    """
    blocks = rows.reshape(-1, size, rows.shape[1])
    products = blocks[:, None] @ blocks.transpose(0, 2, 1)
    gram: Array = products.transpose(0, 2, 1, 3).reshape(len(rows), -1)
    return gram


def _combine(matrix: Array, vector: Array) -> Array:
    """Return their product, in one thread."""
    product: Array = np.einsum('ij,j->i', matrix, vector)
    return product
