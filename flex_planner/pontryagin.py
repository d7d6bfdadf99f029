"""
Pontryagin's conditions of the minimum-effort problem as CasADi expressions.

Korayem et al. 2009, eqs. (7)-(15). The dynamics enter through the inverse dynamics
``ID = M a + h``, so no inverse of a matrix is differentiated: with ``a = M^-1 (B u - h)`` and
``y = M^-1 psi_2`` the derivative of ``psi_2^T a`` is ``-d(y^T ID)/dx`` at fixed y and a.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arm import Arm
from flex_planner.dynamics import build_chain, Chain


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Parameters:
    """Symbols that stay free in the compiled functions, see `flex_planner.model.Parameters`."""

    chain: Chain
    stall: Any
    slope: Any
    effort: Any
    position: Any
    velocity: Any

    @classmethod
    def of(cls, chain: Chain, n: int) -> _Parameters:
        """Create the symbols for n joints."""
        n_t = chain.coordinates.numel()
        return cls(chain=chain, stall=ca.SX.sym('K_1', n), slope=ca.SX.sym('K_2', n),
                   effort=ca.SX.sym('R', n), position=ca.SX.sym('W_1', n_t),
                   velocity=ca.SX.sym('W_2', n_t))

    def stacked(self) -> Any:
        """Return all of them as one column, in the order of `model.Parameters.stacked`."""
        return ca.vertcat(self.chain.payload_mass, self.chain.payload_inertia,
                          self.chain.rigidity, self.stall, self.slope, self.effort,
                          self.position, self.velocity)


def build_functions(arm: Arm) -> dict[str, tuple[Any, int]]:
    """
    Return the functions of an arm that the numerics evaluate, with their batched inputs.

    Every function takes the stacked parameters last.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates; z = (q, q', psi_1, psi_2) has 4 n_t entries.

    Returns
    -------
    dict of str to (casadi.Function, int)
        The int counts the leading inputs that differ from point to point.

        - ``optimality`` z -> z', eqs. (11), (12) with (14), (15)
        - ``optimality_jacobian`` z -> z', dz'/dz
        - ``control`` z -> torque, torque without bounds, running cost L, Hamiltonian H,
          dH/dm_p, accelerations
        - ``forward_dynamics`` (x, u) -> x', eq. (5)
        - ``inverse_dynamics`` (x, a) -> generalized forces
        - ``mass_and_energy`` x -> M, kinetic energy, potential energy
        - ``static_forces`` q -> dV/dq, d2V/dq2 with V the potential energy

    """
    chain = build_chain(arm)
    par = _Parameters.of(chain, arm.n_joints)
    p = par.stacked()
    z, F, outputs = _optimality(par, arm.n_joints)
    q = chain.coordinates
    x = ca.vertcat(q, chain.rates)
    u, a = ca.SX.sym('u', arm.n_joints), ca.SX.sym('a', arm.n_coordinates)
    M, solve = _factorized(chain.mass_matrix())
    forces = ca.vertcat(u, ca.SX(arm.n_modes, 1))
    state_rate = ca.vertcat(chain.rates, solve(forces - chain.bias()))

    def function(name: str, inputs: list[Any], results: list[Any]) -> tuple[Any, int]:
        dense = [ca.densify(result) for result in results]
        return ca.Function(name, [*inputs, p], dense), len(inputs)

    return {
        'optimality': function('optimality', [z], [F]),
        # transposed: CasADi stores columns, NumPy rows
        'optimality_jacobian': function('optimality_jacobian', [z], [F, ca.jacobian(F, z).T]),
        'control': function('control', [z], list(outputs)),
        'forward_dynamics': function('forward_dynamics', [x, u], [state_rate]),
        'inverse_dynamics': function('inverse_dynamics', [x, a], [chain.inverse_dynamics(a)]),
        'mass_and_energy': function('mass_and_energy', [x],
                                    [M, chain.kinetic, chain.potential]),
        'static_forces': function('static_forces', [q], [ca.gradient(chain.potential, q),
                                                         ca.hessian(chain.potential, q)[0]]),
    }


def _factorized(matrix: Any) -> tuple[Any, Any]:
    """Return a symmetric positive definite matrix and its solver by unrolled LDL^T."""
    D, LT, order = ca.ldl(matrix, False)
    return matrix, lambda rhs: ca.ldl_solve(rhs, D, LT, order)


def _optimality(par: _Parameters, n: int) -> tuple[Any, Any, tuple[Any, ...]]:
    """Return z, z' and the outputs of ``control``."""
    chain = par.chain
    q, rates = chain.coordinates, chain.rates
    n_t = q.numel()
    psi_1, psi_2 = ca.SX.sym('psi_1', n_t), ca.SX.sym('psi_2', n_t)
    a, y = ca.SX.sym('a', n_t), ca.SX.sym('y', n_t)
    _, solve = _factorized(chain.mass_matrix())
    y_value = solve(psi_2)
    u, u_free = _bounded(par, y_value[:n], rates[:n])
    a_value = solve(ca.vertcat(u, ca.SX(n_t - n, 1)) - chain.bias())

    work = ca.dot(y, chain.inverse_dynamics(a))
    # dH/du vanishes unless the torque sits on its bound, which moves with the speed
    multiplier = par.slope * par.effort * (u - u_free)
    psi_1_rate = -par.position * q + ca.gradient(work, q)
    psi_2_rate = -par.velocity * rates - psi_1 + ca.gradient(work, rates)
    psi_2_rate[:n] += multiplier
    payload_share = -ca.gradient(work, chain.payload_mass)
    psi_1_rate, psi_2_rate, payload_share = ca.substitute(
        [psi_1_rate, psi_2_rate, payload_share], [a, y], [a_value, y_value])

    cost = (ca.dot(par.position * q, q) + ca.dot(par.velocity * rates, rates)
            + ca.dot(par.effort * u, u)) / 2
    hamiltonian = cost + ca.dot(psi_1, rates) + ca.dot(psi_2, a_value)
    z = ca.vertcat(q, rates, psi_1, psi_2)
    F = ca.vertcat(rates, a_value, psi_1_rate, psi_2_rate)
    return z, F, (u, u_free, cost, hamiltonian, payload_share, a_value)


def _bounded(par: _Parameters, y: Any, speeds: Any) -> tuple[Any, Any]:
    """Return the torque of eq. (14) within the bounds of eq. (15), and without them."""
    free = -y / par.effort
    upper, lower = par.stall - par.slope * speeds, -par.stall - par.slope * speeds
    return ca.fmin(ca.fmax(free, lower), upper), free
