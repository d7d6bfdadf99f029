"""
How torque comes about: chosen at every moment, or as a state with a price on its rate.

Each class has the optimality conditions at points (k, m) and says where its unknowns stand.
`MotionProblem` takes the one that its task asks for.

"""

from __future__ import annotations

from typing import Protocol

from flex_planner.base.validation import Array
from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.arm_model import ArmModel, Controls
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.state_layout import StateLayout
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np


class TorqueConditions(Protocol):
    """The conditions of a motion whose torque comes about in one way or another."""

    @property
    def layout(self) -> StateLayout:
        """Return where the unknowns stand."""

    @property
    def limits(self) -> TorqueLimits:
        """Return the bounds that torques are put between, infinite where they are none."""

    def rate(self, z: Array) -> Array:
        """Return z'."""

    def rate_jacobian(self, z: Array) -> tuple[Array, Array]:
        """Return z' and dz'/dz."""

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code, None without a compiler."""

    def controls(self, z: Array) -> Controls:
        """Return torque, cost and Hamiltonian."""

    def switches(self, z: Array, p: Array | None = None) -> Array:
        """Return functions (k, e) that change their signs where the conditions bend."""


class ChosenTorque:
    """
    Eqs. (13) to (15): the torque that minimises the Hamiltonian, within the motors' limits.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    parameters : Parameters
        Weights and limits.

    """

    def __init__(self, model: ArmModel, parameters: Parameters) -> None:
        self.model, self.limits, self.p = model, parameters.torque_limits, parameters.stack()
        self.layout = StateLayout(model.arm.n_coordinates)

    def rate(self, z: Array) -> Array:
        """Return z'."""
        return self.model.optimality(z, self.p)

    def rate_jacobian(self, z: Array) -> tuple[Array, Array]:
        """Return z' and dz'/dz."""
        return self.model.optimality_jacobian(z, self.p)

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code, None without a compiler."""
        return self.model.compiled_rate('optimality', self.p)

    def controls(self, z: Array) -> Controls:
        """Return torque, cost and Hamiltonian."""
        return self.model.controls(z, self.p)

    def switches(self, z: Array, p: Array | None = None) -> Array:
        """Return the distances of the unbounded torque from its bounds, 2 n columns or more."""
        return self.distances(self.model.controls(z, self.p if p is None else p).free_torque, z)

    def distances(self, free: Array, z: Array) -> Array:
        """Return how far torques without bounds (k, n) are from them at points (k, 4 n_t)."""
        n_t, n = self.layout.coordinates, self.model.arm.n_joints
        return np.hstack(self.limits.distances(free, z[:, n_t:n_t + n]))


class TorqueState:
    """
    The conditions of `torque_rate_conditions`: the torque is a state.

    The motors' limits are limits of states then, which these conditions know nothing of, see
    `TorqueSlacks`.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    parameters : Parameters
        Weights.
    weights, bounds : numpy.ndarray, shape (n,)
        Diagonal of S, > 0, and the largest rates of the torques, infinite for none [N m/s].

    """

    def __init__(self, model: ArmModel, parameters: Parameters, weights: Array,
                 bounds: Array) -> None:
        n, endless = model.arm.n_joints, np.full(model.arm.n_joints, np.inf)
        self.model, self.weights, self.bounds = model, weights, bounds
        self.limits = TorqueLimits(endless, np.zeros(n), endless)
        self.layout = StateLayout(model.arm.n_coordinates, n)
        self.p: Array = np.concatenate([parameters.stack(), weights, bounds])

    def rate(self, z: Array) -> Array:
        """Return z'."""
        return self.model.torque_rate_function('torque_rate')(z, self.p)[0]

    def rate_jacobian(self, z: Array) -> tuple[Array, Array]:
        """Return z' and dz'/dz."""
        rate, jacobian = self.model.torque_rate_function('torque_rate_jacobian')(z, self.p)
        return rate, jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code, None without a compiler."""
        return self.model.compiled_rate('torque_rate', self.p)

    def controls(self, z: Array) -> Controls:
        """Return torque, cost and Hamiltonian, the price of the torque's rate in both."""
        return Controls.of(self._control(z)[:6])

    def torque_rates(self, z: Array) -> Array:
        """Return the rates of the torques, shape (k, n) [N m/s]."""
        return self._control(z)[6]

    def switches(self, z: Array, p: Array | None = None) -> Array:
        """Return the distances of the unbounded rates from their bounds, where they have one."""
        some = np.isfinite(self.bounds)
        free, bounds = self._control(z)[7][:, some], self.bounds[some]
        return np.hstack([free - bounds, free + bounds])

    def _control(self, z: Array) -> tuple[Array, ...]:
        return self.model.torque_rate_function('torque_rate_control')(z, self.p)


def torque_conditions(model: ArmModel, task: Task, parameters: Parameters) -> TorqueConditions:
    """Return the conditions that a task asks for."""
    if not task.has_torque_rates:
        return ChosenTorque(model, parameters)
    return TorqueState(model, parameters, task.torque_rate_prices, task.torque_rate_bounds)
