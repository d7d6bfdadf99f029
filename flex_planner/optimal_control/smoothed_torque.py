"""
Torques that are kept within the motors' limits by a barrier, for motions near the largest payload.

Nearly all torques are on their limits there, and switch the more often the more the links ring.
With ``-mu sum_k ln c_k(u, q')`` added to H, over the distances c_k from all limits, the torque is
the one root within them of

    R (u - u_free) - mu sum_k (dc_k/du) / c_k = 0

and smooth: the conditions of `barrier_conditions`, slacks and multipliers eliminated for good.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.validation import Array
from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.arm_model import ArmModel, Controls
from flex_planner.optimal_control.barrier_problem import ENDLESS, find_slacks
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_conditions import ChosenTorque, TorqueConditions
import numpy as np

# halvings of a torque's bracket
_HALVINGS = 54


class SmoothedTorque(ChosenTorque):
    """
    The conditions of `ChosenTorque` with the barrier.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    parameters : Parameters
        Weights and limits.
    mu : float
        > 0.

    """

    def __init__(self, model: ArmModel, parameters: Parameters, mu: float) -> None:
        super().__init__(model, parameters)
        self.weights, self.mu = parameters.effort_weights, mu
        self._mass, self._capped = parameters.payload_mass, bool(self.limits.capped.any())
        self._p = np.append(np.where(np.isfinite(self.p), self.p, ENDLESS), mu)

    def rate(self, z: Array) -> Array:
        """Return z'."""
        return self.rate_jacobian(z)[0]

    def rate_jacobian(self, z: Array) -> tuple[Array, Array]:
        """Return z' and dz'/dz."""
        rate, jacobian = self.model.barrier('barrier')(z, self._eliminated(z), self._p)
        return rate, jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return None: the root is not compiled with the rest."""
        return None

    def controls(self, z: Array) -> Controls:
        """Return torque, cost and Hamiltonian, without the barrier."""
        sharp = super().controls(z)
        torque = self._torque(z, sharp.free_torque)
        change = ((torque**2 - sharp.torque**2) @ self.weights) / 2
        pull = ((torque - sharp.torque) * sharp.free_torque) @ self.weights
        n_t = self.layout.coordinates
        loaded = np.column_stack([z, np.full(len(z), self._mass), np.zeros(len(z))])
        rate = self.model.barrier('payload_barrier')(loaded, self._eliminated(z), self._p)[0]
        return replace(
            sharp, torque=torque, free_torque=torque, cost_rate=sharp.cost_rate + change,
            hamiltonian=sharp.hamiltonian + change - pull, payload_share=-rate[:, -1],
            acceleration=rate[:, n_t:2 * n_t])

    def switches(self, z: Array, p: Array | None = None) -> Array:
        """Return no functions: nothing switches."""
        return np.zeros((len(z), 0))

    def barrier_rate(self, z: Array) -> Array:
        """Return what the barrier adds to L and H, shape (k,)."""
        slacks = self._slacks(z, self._torque(z, super().controls(z).free_torque))
        rate: Array = -self.mu * np.where(slacks < ENDLESS, np.log(slacks), 0.0).sum(axis=1)
        return rate

    @property
    def terms(self) -> int:
        """Return how many logarithms the barrier has."""
        limits = self.limits
        return 2 * int(np.isfinite(limits.stall).sum() + limits.capped.sum())

    def _eliminated(self, z: Array) -> Array:
        """Return torques, slacks and multipliers at points (k, 4 n_t)."""
        torque = self._torque(z, super().controls(z).free_torque)
        slacks = self._slacks(z, torque)
        return np.hstack([torque, slacks, self.mu / slacks])

    def _slacks(self, z: Array, torque: Array) -> Array:
        """Return what the limits leave for torques (k, n) at points (k, 4 n_t)."""
        return find_slacks(self.limits, torque, self._speeds(z))

    def _speeds(self, z: Array) -> Array:
        n_t = self.layout.coordinates
        return z[:, n_t:n_t + self.model.arm.n_joints]

    def _torque(self, z: Array, free: Array) -> Array:
        """Return the roots, shape (k, n) [N m]; NaN at speeds that leave a motor no torque."""
        speeds = self._speeds(z)
        lines = self.limits.lines(speeds)
        low, high = (np.clip(each, -ENDLESS, ENDLESS) for each in self.limits.bounds(speeds))
        low, high = np.where(low < high, low, np.nan), np.where(low < high, high, np.nan)
        endless = high >= ENDLESS
        for _ in range(_HALVINGS):
            torque = (low + high) / 2
            with np.errstate(divide='ignore', invalid='ignore'):
                above = self.weights * (torque - free) > self._push(torque, *lines)
            low, high = np.where(above, low, torque), np.where(above, torque, high)
        root: Array = np.where(endless, free, (low + high) / 2)
        return root

    def _push(self, torque: Array, lowest: Array, highest: Array) -> Array:
        """Return what the limits add to the torque, by its weight, shape (k, n)."""
        push: Array = self.mu / (torque - lowest) - self.mu / (highest - torque)
        if self._capped:
            cap = self.limits.cap
            push += self.mu / (torque + cap) - self.mu / (cap - torque)
        return push


def smooth_torques(conditions: TorqueConditions, parameters: Parameters,
                   mu: float) -> TorqueConditions:
    """Return conditions whose torques, if they are chosen, have a barrier."""
    if not isinstance(conditions, ChosenTorque):
        return conditions
    return SmoothedTorque(conditions.model, parameters, mu)
