"""The dynamics of an arm from its energies, by Lagrange's equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EnergyChain:
    """
    Symbolic dynamics ``M(q) a + h(q, q') = B u`` of an arm.

    Attributes
    ----------
    coordinates, rates : casadi.SX, shape (n_t, 1)
        q [rad, m] and q' [rad/s, m/s].
    payload_mass, payload_inertia : casadi.SX
        m_p at the tip [kg], and its rotary inertia [kg m^2].
    rigidity : casadi.SX, shape (n, 1)
        E I of each link [N m^2].
    coulomb_friction, coulomb_speed : casadi.SX, shape (n, 1)
        Of each joint [N m], and the speed below which it fades [rad/s].
    kinetic, potential : casadi.SX
        Energies [J]; potential includes bending.
    friction : casadi.SX, shape (n_t, 1)
        Generalized forces of joint friction [N m] and damping [N].

    """

    coordinates: Any
    rates: Any
    payload_mass: Any
    payload_inertia: Any
    rigidity: Any
    coulomb_friction: Any
    coulomb_speed: Any
    kinetic: Any
    potential: Any
    friction: Any

    def mass_matrix(self) -> Any:
        """Return M(q), shape (n_t, n_t), eq. (3)."""
        return ca.jacobian(ca.gradient(self.kinetic, self.rates), self.rates)

    def bias(self) -> Any:
        """Return h(q, q') = H + G + friction, shape (n_t, 1), eq. (3)."""
        momentum = ca.gradient(self.kinetic, self.rates)
        return (ca.jtimes(momentum, self.coordinates, self.rates)
                - ca.gradient(self.kinetic - self.potential, self.coordinates) + self.friction)

    def inverse_dynamics(self, accelerations: Any) -> Any:
        """Return M a + h, shape (n_t, 1), without forming M."""
        momentum = ca.gradient(self.kinetic, self.rates)
        return ca.jtimes(momentum, self.rates, accelerations) + self.bias()
