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
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.planar_chain import build_chain, Chain


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Parameters:
    """Symbols that stay free in the compiled functions, see `arm_model.Parameters`."""

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
        - ``payload_sensitivity`` z -> dz'/dm_p, dH/dm_p, d2H/dm_p2
        - ``forward_dynamics`` (x, u) -> x', eq. (5)
        - ``runge_kutta_step`` (x, torques at the stages, step) -> next x and the two error
          estimates of the Dormand-Prince method of order 8
        - ``inverse_dynamics`` (x, a) -> generalized forces
        - ``mass_and_energy`` x -> M, kinetic energy, potential energy
        - ``static_forces`` q -> dV/dq, d2V/dq2 with V the potential energy

    """
    chain = build_chain(arm)
    par = _Parameters.of(chain, arm.n_joints)
    p = par.stacked()
    z, F, outputs = _optimality(par, arm.n_joints)
    share, payload = outputs[4], chain.payload_mass
    q = chain.coordinates
    x = ca.vertcat(q, chain.rates)
    u, a = ca.SX.sym('u', arm.n_joints), ca.SX.sym('a', arm.n_coordinates)
    M, solve = _factorized(chain.mass_matrix())
    forces = ca.vertcat(u, ca.SX(arm.n_modes, 1))
    state_rate = ca.vertcat(chain.rates, solve(forces - chain.bias()))

    def function(name: str, inputs: list[Any], results: list[Any]) -> tuple[Any, int]:
        dense = [ca.densify(result) for result in results]
        return ca.Function(name, [*inputs, p], dense), len(inputs)

    forward_dynamics = function('forward_dynamics', [x, u], [state_rate])
    return {
        'optimality': function('optimality', [z], [F]),
        # transposed: CasADi stores columns, NumPy rows
        'optimality_jacobian': function('optimality_jacobian', [z], [F, ca.jacobian(F, z).T]),
        'control': function('control', [z], list(outputs)),
        'payload_sensitivity': function('payload_sensitivity', [z], [
            ca.jacobian(F, payload), share, ca.jacobian(share, payload)]),
        'forward_dynamics': forward_dynamics,
        'runge_kutta_step': _runge_kutta_step(forward_dynamics[0]),
        'inverse_dynamics': function('inverse_dynamics', [x, a], [chain.inverse_dynamics(a)]),
        'mass_and_energy': function('mass_and_energy', [x],
                                    [M, chain.kinetic, chain.potential]),
        'static_forces': function('static_forces', [q], [ca.gradient(chain.potential, q),
                                                         ca.hessian(chain.potential, q)[0]]),
    }


def _runge_kutta_step(rate: Any) -> tuple[Any, int]:
    """Return one step of DOP853, with SciPy's coefficients, of x' = rate(x, u, p)."""
    from scipy.integrate import DOP853

    x, u = ca.MX.sym('x', rate.size1_in(0)), ca.MX.sym('u', rate.size1_in(1), DOP853.n_stages)
    step, p = ca.MX.sym('h'), ca.MX.sym('p', rate.size1_in(2))
    slopes: list[Any] = []
    for i in range(DOP853.n_stages):
        slopes.append(rate(x + step * _combined(DOP853.A[i, :i], slopes), u[:, i], p))
    following = x + step * _combined(DOP853.B, slopes)
    # the last stage of the error estimate is at the end of the step, as stage 12 is
    slopes.append(rate(following, u[:, DOP853.n_stages - 1], p))
    errors = [step * _combined(row, slopes) for row in (DOP853.E5, DOP853.E3)]
    return ca.Function('runge_kutta_step', [x, ca.vec(u), step, p], [following, *errors]), 3


def _combined(weights: Any, vectors: list[Any]) -> Any:
    """Return the sum of weighted vectors; 0 for none."""
    return sum((float(w) * v for w, v in zip(weights, vectors, strict=True) if w), 0)


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
