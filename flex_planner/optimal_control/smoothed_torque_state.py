"""
Rates of torques that are kept within their bounds by a barrier, for motions within limits.

To H is added ``-mu ln(1 - r_i^2 / b_i^2)`` for every rate r_i with a bound b_i: instead of
switching, ``S r + psi_tau + 2 mu r / (b^2 - r^2) = 0``, which has one root within the bounds.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.validation import Array
from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.arm_model import Controls
from flex_planner.optimal_control.torque_conditions import TorqueConditions, TorqueState
import numpy as np

# halvings of a root's bracket
_HALVINGS = 60


class SmoothedTorqueState(TorqueState):
    """
    The conditions of `TorqueState` with the barrier.

    Parameters
    ----------
    exact : TorqueState
        Rates of n torques, some of them bounded.
    mu : float
        > 0.

    """

    def __init__(self, exact: TorqueState, mu: float) -> None:
        self.model, self.limits, self.layout = exact.model, exact.limits, exact.layout
        self.weights, self.bounds, self.mu = exact.weights, exact.bounds, mu
        self.p = exact.p.copy()
        self.p[-self.bounds.size:] = np.inf  # the compiled functions know of no bounds then

    def rate(self, z: Array) -> Array:
        """Return z'."""
        rate = super().rate(z)
        rate[:, self.layout.torque_slice] = self.torque_rates(z)
        return rate

    def rate_jacobian(self, z: Array) -> tuple[Array, Array]:
        """Return z' and dz'/dz."""
        rate, jacobian = super().rate_jacobian(z)
        rates, n = self.torque_rates(z), self.layout.torques
        rate[:, self.layout.torque_slice] = rates
        room = (1 - rates / self.bounds) * (1 + rates / self.bounds)
        curvature = self.weights + 2 * self.mu / self.bounds**2 * (2 - room) / room**2
        at = self.layout.torque_slice.start + np.arange(n)
        jacobian[:, at, at + n] = -1 / curvature
        return rate, jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return None: what the barrier changes is not compiled."""
        return None

    def controls(self, z: Array) -> Controls:
        """Return torque, cost and Hamiltonian, the price of the torque's rate in both."""
        free = super().controls(z)
        costates = z[:, self.layout.torque_costate_slice]
        rates, unbounded = self.torque_rates(z), -costates / self.weights
        price = (self.weights * (rates**2 - unbounded**2)).sum(axis=1) / 2
        more = price + (costates * (rates - unbounded)).sum(axis=1)
        return replace(free, cost_rate=free.cost_rate + price, hamiltonian=free.hamiltonian + more)

    def torque_rates(self, z: Array) -> Array:
        """Return the rates of the torques, shape (k, n) [N m/s]."""
        costates = z[:, self.layout.torque_costate_slice]
        bounded = np.isfinite(self.bounds)
        rates = -costates / self.weights
        b = self.bounds[bounded]
        rates[:, bounded] = -np.sign(costates[:, bounded]) * b * _root(
            self.weights[bounded] * b**2, np.abs(costates[:, bounded]) * b, self.mu)
        return rates

    def switches(self, z: Array, p: Array | None = None) -> Array:
        """Return no functions: nothing switches."""
        return np.zeros((len(z), 0))

    def barrier_rate(self, z: Array) -> Array:
        """Return what the barrier adds to L and H, shape (k,)."""
        shares = self.torque_rates(z) / self.bounds
        rate: Array = -self.mu * np.log((1 - shares) * (1 + shares)).sum(axis=1)
        return rate


def smooth_rates(conditions: TorqueConditions, mu: float) -> TorqueConditions:
    """Return conditions whose rates of torques, if they have bounds, have a barrier."""
    if not isinstance(conditions, TorqueState) or not np.isfinite(conditions.bounds).any():
        return conditions
    return SmoothedTorqueState(conditions, mu)


def _root(price: Array, pull: Array, mu: float) -> Array:
    """Return x in [0, 1) with ``price x + 2 mu x / (1 - x^2) = pull``, shape (k, n)."""
    low, high = np.zeros_like(pull), np.ones_like(pull)
    for _ in range(_HALVINGS):
        x = (low + high) / 2
        with np.errstate(divide='ignore'):
            beyond = price * x + 2 * mu * x / ((1 - x) * (1 + x)) > pull
        low, high = np.where(beyond, low, x), np.where(beyond, x, high)
    return low
