"""
Pontryagin's conditions of motions whose torque has a price on its rate, as CasADi functions.

The torque tau is a state and its rate r the control: ``r^T S r / 2`` is added to L of eq. (7) of
Korayem et al. 2009, and tau has a costate psi_tau,

    tau' = r,    psi_tau' = -(R tau + B^T M^-1 psi_2),    S r + psi_tau = 0

with r put between its bounds as eq. (14) puts a torque. Eqs. (11) and (12) stay as they are, with
tau for u. For S -> 0 without bounds psi_tau vanishes, and its rate is eq. (13).

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import batch, BatchedFunction
from flex_planner.dynamics.torque_bounds import clip
from flex_planner.optimal_control.parameters import ParameterSymbols
from flex_planner.optimal_control.pontryagin import Conditions, derive_conditions, TorqueLaw
from flex_planner.optimal_control.torque_limits import has_caps, TorqueSensitivity


def build_torque_rate_functions(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Derive the functions of the conditions with torque as a state.

    Every function takes last `Parameters.stack`, then S and the bounds of the rates, (n,) each.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates; z = (q, q', psi_1, psi_2, tau, psi_tau) has 4 n_t + 2 n entries.

    Returns
    -------
    dict of str to (casadi.Function, int)
        The int counts the leading inputs that differ from point to point.

        - ``torque_rate`` z -> z'
        - ``torque_rate_jacobian`` z -> z', dz'/dz
        - ``torque_rate_control`` z -> as ``control`` of `build_optimality_functions`, with tau as
          both torques and the price of r in cost and Hamiltonian; then r, and r without bounds

    """
    point = _Point.of(arm)
    z, p, rate = point.z, point.p, point.rate()
    found = point.found
    price = ca.dot(point.weights, point.torque_rate**2) / 2
    hamiltonian = found.hamiltonian + price + ca.dot(point.costate, point.torque_rate)
    return {
        'torque_rate': batch('torque_rate', [z], p, [rate]),
        # transposed: CasADi stores columns, NumPy rows
        'torque_rate_jacobian': batch('torque_rate_jacobian', [z], p, [
            rate, point.jacobian().T]),
        'torque_rate_control': batch('torque_rate_control', [z], p, [
            found.torque, found.torque, found.cost + price, hamiltonian, found.payload_share,
            found.acceleration, point.torque_rate, point.free_rate]),
    }


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """
    The conditions at a point, of symbols.

    Attributes
    ----------
    found : Conditions
        Those of eqs. (11) and (12) with the torque as it is.
    p : casadi.SX
        The parameters.
    torque, costate : casadi.SX, shape (n, 1)
        tau and psi_tau.
    effort_weights, weights, bounds : casadi.SX, shape (n, 1)
        Diagonals of R and S, and the largest rates.

    """

    found: Conditions
    p: Any
    torque: Any
    costate: Any
    effort_weights: Any
    weights: Any
    bounds: Any

    @classmethod
    def of(cls, arm: Arm) -> _Point:
        """Derive them."""
        chain, n = build_chain(arm), arm.n_joints
        symbols = ParameterSymbols.of(chain, capped=has_caps(arm))
        torque, costate, weights, bounds = (ca.SX.sym(name, n) for name in (
            'tau', 'psi_tau', 'S', 'r_max'))
        none = ca.SX(n, 1)
        law = TorqueLaw(torque=torque, multiplier=none, sensitivity=TorqueSensitivity(
            inside=none, by_costate=none, by_speed=none, of_costate=none))
        found = derive_conditions(chain, symbols, lambda free, speeds: law)
        return cls(found, ca.vertcat(*symbols.stack(), weights, bounds), torque, costate,
                   symbols['effort_weights'], weights, bounds)

    @property
    def z(self) -> Any:
        """Return the unknowns."""
        return ca.vertcat(self.found.z, self.torque, self.costate)

    @property
    def free_rate(self) -> Any:
        """Return r without bounds."""
        return -self.costate / self.weights

    @property
    def torque_rate(self) -> Any:
        """Return r."""
        return clip(self.free_rate, -self.bounds, self.bounds)

    def rate(self) -> Any:
        """Return z'."""
        pull = self.effort_weights * self.torque + self.found.virtual[:self.torque.numel()]
        return ca.vertcat(self.found.rate, self.torque_rate, -pull)

    def jacobian(self) -> Any:
        """Return dz'/dz: that of eqs. (11) and (12) in a frame of what the torque adds."""
        inner, n = self.found.jacobian, self.torque.numel()
        n_t, motors = inner.inverse.size1(), inner.motors
        pushed = inner.virtual_by_position[:n, :]
        inside = ca.if_else(ca.fabs(self.free_rate) < self.bounds, 1 / self.weights, 0)
        by_torque = ca.vertcat(ca.SX(n_t, n), motors, -pushed.T, ca.SX(n_t, n))
        of_costate = ca.horzcat(-pushed, ca.SX(n, 2 * n_t), -motors.T)
        return ca.blockcat([
            [inner.assemble(), by_torque, ca.SX(4 * n_t, n)],
            [ca.SX(n, 4 * n_t), ca.SX(n, n), -ca.diag(inside)],
            [of_costate, -ca.diag(self.effort_weights), ca.SX(n, n)]])
