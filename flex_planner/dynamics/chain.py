"""
The dynamics of an arm as symbols: what all is derived from that is built on it.

The equations of motion are one scalar, the virtual power ``W(q, q', a, y) = y . (M(q) a + h(q,
q'))``: what inertia, gravity, elasticity and friction take in a virtual motion y (Kane's form).
Its derivatives are M and h of eq. (3), the rates of the costates and their Jacobian.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """
    Symbolic dynamics ``M(q) a + h(q, q') = B u`` of an arm.

    Attributes
    ----------
    coordinates, rates, accelerations, virtual_rates : casadi.SX, shape (n_t, 1)
        q [rad, m], q', a and y.
    payload_mass, payload_inertia : casadi.SX
        m_p at the tip [kg], and its rotary inertia [kg m^2].
    rigidity : casadi.SX, shape (n, 1)
        E I of each link [N m^2].
    coulomb_friction, coulomb_speed : casadi.SX, shape (n, 1)
        Of each joint [N m], and the speed below which it fades [rad/s].
    power : casadi.SX
        W.
    potential : casadi.SX
        Energy of weight and bending [J].

    """

    coordinates: Any
    rates: Any
    accelerations: Any
    virtual_rates: Any
    payload_mass: Any
    payload_inertia: Any
    rigidity: Any
    coulomb_friction: Any
    coulomb_speed: Any
    power: Any
    potential: Any

    @property
    def kinetic(self) -> Any:
        """Return the kinetic energy [J]."""
        return ca.bilin(self.mass_matrix(), self.rates, self.rates) / 2

    def mass_matrix(self) -> Any:
        """Return M(q), shape (n_t, n_t), eq. (3)."""
        matrix = ca.jacobian(ca.gradient(self.power, self.virtual_rates), self.accelerations)
        return ca.triu2symm(ca.triu(matrix))

    def bias(self) -> Any:
        """Return h(q, q') = H + G + friction, shape (n_t, 1), eq. (3)."""
        return self.inverse_dynamics(ca.SX.zeros(self.accelerations.numel(), 1))

    def inverse_dynamics(self, accelerations: Any) -> Any:
        """Return M a + h, shape (n_t, 1), without forming M."""
        forces = ca.gradient(self.power, self.virtual_rates)
        return ca.substitute(forces, self.accelerations, ca.densify(accelerations))
