"""
The dynamics of an arm without a compiler, for tests that use many arms once.

Building takes milliseconds instead of seconds. What is under test is the same:
:func:`flex_planner.dynamics.build_chain.build_chain`.

"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import physical_symbols
import numpy as np


class LightModel:
    """Stands in for ArmModel where only the dynamics are needed; same methods, same results."""

    def __init__(self, arm: Arm) -> None:
        self.arm, chain = arm, build_chain(arm)
        q, x = chain.coordinates, ca.vertcat(chain.coordinates, chain.rates)
        p = physical_symbols(chain)
        M, V = chain.mass_matrix(), chain.potential
        self._dynamics = ca.Function('dynamics', [x, p], [M, chain.bias()])
        self._energy = ca.Function('energy', [x, p], [M, chain.kinetic, V])
        self._static = ca.Function('static', [q, p], [ca.gradient(V, q), ca.hessian(V, q)[0]])

    def _each(self, function: object, points: Array, p: Array) -> list[Array]:
        """Evaluate points one by one; each output is stacked."""
        rows = [function(x, self._physical(p)) for x in points]  # type: ignore
        return [np.stack([np.array(value) for value in column])
                for column in zip(*rows, strict=True)]

    def _physical(self, p: Array) -> Array:
        """Return the parameters of the dynamics; without those of friction there is none."""
        n = self.arm.n_joints
        count = 2 + 3 * n
        return p[:count] if p.size >= count else np.concatenate([p, np.zeros(n), np.ones(n)])

    def mass_and_energy(self, x: Array, p: Array) -> tuple[Array, Array, Array]:
        mass, kinetic, potential = self._each(self._energy, x, p)
        return mass, kinetic[:, 0, 0], potential[:, 0, 0]

    def static_forces(self, q: Array, p: Array) -> tuple[Array, Array]:
        force, stiffness = self._each(self._static, q, p)
        return force[..., 0], stiffness

    def inverse_dynamics(self, x: Array, acceleration: Array, p: Array) -> Array:
        mass, bias = self._each(self._dynamics, x, p)
        forces: Array = (mass @ acceleration[..., None] + bias)[..., 0]
        return forces

    def state_rate(self, p: Array) -> Callable[[Array, Array], Array]:
        n, n_t = self.arm.n_joints, self.arm.n_coordinates

        def rate(x: Array, torque: Array) -> Array:
            mass, bias = (np.array(value) for value in self._dynamics(x, self._physical(p)))
            forces = np.concatenate([torque, np.zeros(n_t - n)]) - bias[:, 0]
            return np.concatenate([x[n_t:], np.linalg.solve(mass, forces)])

        return rate
