"""
Pontryagin's conditions of the minimum-effort problem as CasADi expressions.

Korayem et al. 2009, eqs. (7)-(15). The dynamics enter through the virtual power ``W = y . (M a +
h)``, so no inverse of a matrix is differentiated: with ``a = M^-1 (B u - h)`` and
``y = M^-1 psi_2`` the derivative of ``psi_2^T a`` by the state is ``-dW/dx`` at fixed y and a: the
costates follow from one gradient of ``L + psi_1^T q' - W``, which has the same derivatives as H
at fixed u.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.chain import Chain
from flex_planner.dynamics.dynamics_functions import batch, BatchedFunction, solver_of
from flex_planner.optimal_control.free_rates import (
    free_duration_rates,
    free_payload_rates,
    free_times_rates,
)
from flex_planner.optimal_control.parameters import ParameterSymbols
from flex_planner.optimal_control.rate_jacobian import RateJacobian
from flex_planner.optimal_control.running_cost import running_cost
from flex_planner.optimal_control.torque_limits import (
    free_torque,
    has_caps,
    TorqueSensitivity,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueLaw:
    """
    The torque that is chosen at a point, of symbols, shape (n, 1) each.

    Attributes
    ----------
    torque : casadi.SX
        u [N m].
    multiplier : casadi.SX
        What bounds that move with the speed add to the rates of the joints' second costates.
    sensitivity : TorqueSensitivity
        How both change.

    """

    torque: Any
    multiplier: Any
    sensitivity: TorqueSensitivity


TorqueChoice = Callable[[Any, Any], TorqueLaw]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Conditions:
    """
    The optimality conditions at a point, all of them expressions of z and the parameters.

    Attributes
    ----------
    z, rate : casadi.SX, shape (4 n_t, 1)
        (q, q', psi_1, psi_2), and z' of eqs. (11) and (12).
    jacobian : RateJacobian
        dz'/dz, not yet put together.
    torque, free_torque : casadi.SX, shape (n, 1)
        Eq. (14), and eq. (13) without bounds [N m].
    cost, hamiltonian : casadi.SX
        L of eq. (7) and H of eq. (8).
    payload_share : casadi.SX
        dH/dm_p [1/kg].
    acceleration : casadi.SX, shape (n_t, 1)
        q''.
    virtual : casadi.SX, shape (n_t, 1)
        y = M^-1 psi_2.

    """

    z: Any
    rate: Any
    jacobian: RateJacobian
    torque: Any
    free_torque: Any
    cost: Any
    hamiltonian: Any
    payload_share: Any
    acceleration: Any
    virtual: Any


def build_optimality_functions(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Derive the functions of the optimality conditions that the numerics evaluate.

    Every function takes `Parameters.stack` last.

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
        - ``free_payload``, ``free_payload_jacobian`` and the same of the duration and of the times
          of via points: see `free_rates`

    """
    chain = build_chain(arm)
    symbols = ParameterSymbols.of(chain, capped=has_caps(arm))
    found, p = derive_conditions(chain, symbols), ca.vertcat(*symbols.stack())
    z, F, share, payload = found.z, found.rate, found.payload_share, chain.payload_mass
    functions = {
        'optimality': batch('optimality', [z], p, [F]),
        # transposed: CasADi stores columns, NumPy rows
        'optimality_jacobian': batch('optimality_jacobian', [z], p,
                                     [F, found.jacobian.assemble().T]),
        'control': batch('control', [z], p, [
            found.torque, found.free_torque, found.cost, found.hamiltonian, share,
            found.acceleration]),
        'payload_sensitivity': batch('payload_sensitivity', [z], p, [
            ca.jacobian(F, payload), share, ca.jacobian(share, payload)]),
    }
    return (functions | free_payload_rates(functions) | free_duration_rates(functions)
            | free_times_rates(functions))


def derive_conditions(chain: Chain, parameters: ParameterSymbols,
                      choose: TorqueChoice | None = None) -> Conditions:
    """
    Derive eqs. (8) and (11)-(14) for a chain.

    Parameters
    ----------
    chain : Chain
        Of the arm.
    parameters : ParameterSymbols
        Weights and limits.
    choose : callable, optional
        From the torque without bounds and the joint speeds to the torque; eq. (14) by default.

    """
    q, rates, a, y = (chain.coordinates, chain.rates, chain.accelerations, chain.virtual_rates)
    n_t, n = q.numel(), chain.rigidity.numel()
    psi_1, psi_2, u = (ca.SX.sym(name, size) for name, size in (
        ('psi_1', n_t), ('psi_2', n_t), ('u', n)))
    solve, R = solver_of(chain.mass_matrix()), parameters['effort_weights']
    virtual = solve(psi_2)
    free = free_torque(R, virtual[:n])
    law = (choose or bounded_law(parameters))(free, rates[:n])
    torque = law.torque
    acceleration = solve(ca.vertcat(torque, ca.SX(n_t - n, 1)) - chain.bias())

    def at_point(*expressions: Any) -> Any:
        return ca.substitute(list(expressions), [u, a, y], [torque, acceleration, virtual])

    cost, x = running_cost(parameters, q, rates, u), ca.vertcat(q, rates)
    stand_in = cost + ca.dot(psi_1, rates) - chain.power
    gradient = ca.gradient(stand_in, ca.vertcat(x, chain.payload_mass))
    cost, slope = at_point(cost, gradient)
    costate_rate = -slope[:2 * n_t]
    costate_rate[n_t:n_t + n] += law.multiplier
    return Conditions(
        z=ca.vertcat(x, psi_1, psi_2), rate=ca.vertcat(rates, acceleration, costate_rate),
        jacobian=RateJacobian.of(chain, gradient[:2 * n_t], at_point, solve,
                                 law.sensitivity),
        torque=torque, free_torque=free, cost=cost, payload_share=slope[-1],
        hamiltonian=cost + ca.dot(psi_1, rates) + ca.dot(psi_2, acceleration),
        acceleration=acceleration, virtual=virtual)


def bounded_law(parameters: ParameterSymbols) -> TorqueChoice:
    """Return the choice of eq. (14): the torque without bounds, put between them."""
    limits, R = parameters.torque_limits, parameters['effort_weights']
    return lambda free, speeds: TorqueLaw(
        torque=limits.bound(free, speeds), multiplier=limits.multiplier(R, free, speeds),
        sensitivity=limits.sensitivity(R, free, speeds))
