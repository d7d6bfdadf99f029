"""
Pontryagin's conditions of effort that is measured from an offset, as CasADi functions.

With ``(u - w)^T R (u - w) / 2`` in place of ``u^T R u / 2`` in eq. (7) of Korayem et al. 2009, eq.
(13) becomes ``u = w - R^-1 B^T M^-1 psi_2``; eqs. (11), (12), (14) and (15) stay as they are.

"""

from __future__ import annotations

from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import batch, BatchedFunction
from flex_planner.optimal_control.parameters import ParameterSymbols
from flex_planner.optimal_control.pontryagin import bounded_law, derive_conditions, TorqueLaw
from flex_planner.optimal_control.torque_limits import has_caps


def build_offset_functions(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Derive the functions of the conditions with an offset w (n,) [N m] that differs by point.

    Every function takes `Parameters.stack` last; see `build_optimality_functions`.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates; z = (q, q', psi_1, psi_2) has 4 n_t entries.

    Returns
    -------
    dict of str to (casadi.Function, int)
        The int counts the leading inputs that differ from point to point.

        - ``offset_optimality`` (z, w) -> z'
        - ``offset_optimality_jacobian`` (z, w) -> z', dz'/dz
        - ``offset_control`` (z, w) -> as ``control``: L of eq. (7) without the offset, and H with
          the terms of L in which u meets it

    """
    chain = build_chain(arm)
    symbols = ParameterSymbols.of(chain, capped=has_caps(arm))
    offset, bounded = ca.SX.sym('w', arm.n_joints), bounded_law(symbols)

    def choose(free: Any, speeds: Any) -> TorqueLaw:
        return bounded(free + offset, speeds)

    found, p = derive_conditions(chain, symbols, choose), ca.vertcat(*symbols.stack())
    met = ca.dot(symbols['effort_weights'] * offset, found.torque)
    return {
        'offset_optimality': batch('offset_optimality', [found.z, offset], p, [found.rate]),
        # transposed: CasADi stores columns, NumPy rows
        'offset_optimality_jacobian': batch('offset_optimality_jacobian', [found.z, offset], p, [
            found.rate, found.jacobian.assemble().T]),
        'offset_control': batch('offset_control', [found.z, offset], p, [
            found.torque, found.free_torque + offset, found.cost, found.hamiltonian - met,
            found.payload_share, found.acceleration]),
    }
