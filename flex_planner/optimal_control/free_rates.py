"""
The rates of motions with one more unknown, as CasADi functions.

They call the functions of the conditions, so that hardly anything more is compiled.

"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
from flex_planner.dynamics.dynamics_functions import BatchedFunction
from flex_planner.optimal_control.parameters import payload_index


def free_payload_rates(functions: Mapping[str, BatchedFunction]) -> dict[str, BatchedFunction]:
    """Return the rates of `FreePayloadProblem` and their Jacobian, of (z, m_p, nu) and p."""
    F, F_jacobian, sensitivity = (functions[name][0] for name in (
        'optimality', 'optimality_jacobian', 'payload_sensitivity'))
    size, half, at = F.numel_in(0), F.numel_in(0) // 2, payload_index()
    unknowns, p = ca.MX.sym('unknowns', size + 2), ca.MX.sym('p', F.numel_in(1))
    z, loaded = unknowns[:size], ca.vertcat(p[:at], unknowns[size], p[at + 1:])
    by_payload, share, bend = sensitivity(z, loaded)
    rate, inner = F_jacobian(z, loaded)
    # the costates' rates are less the gradient of H, so dz'/dm_p holds that of dH/dm_p
    turned = ca.vertcat(by_payload[half:], -by_payload[:half])
    # columns of the transposed matrix are the rows of z', m_p' and nu'
    jacobian = ca.horzcat(ca.vertcat(inner, by_payload.T, ca.MX.zeros(1, size)),
                          ca.MX.zeros(size + 2, 1), ca.vertcat(turned, -bend, 0))
    return _pair('free_payload', [unknowns, p],
                 ca.vertcat(F(z, loaded), 0, -share), ca.vertcat(rate, 0, -share), jacobian)


def free_duration_rates(functions: Mapping[str, BatchedFunction]) -> dict[str, BatchedFunction]:
    """Return the rates of `FreeDurationProblem` and their Jacobian, of (z, T) and p."""
    F, F_jacobian = (functions[name][0] for name in ('optimality', 'optimality_jacobian'))
    size = F.numel_in(0)
    unknowns, p = ca.MX.sym('unknowns', size + 1), ca.MX.sym('p', F.numel_in(1))
    z, duration = unknowns[:size], unknowns[size]
    rate, inner = F_jacobian(z, p)
    jacobian = ca.horzcat(ca.vertcat(duration * inner, rate.T), ca.MX.zeros(size + 1, 1))
    return _pair('free_duration', [unknowns, p],
                 ca.vertcat(duration * F(z, p), 0), ca.vertcat(duration * rate, 0), jacobian)


def free_times_rates(functions: Mapping[str, BatchedFunction]) -> dict[str, BatchedFunction]:
    """Return the rates of `FreeViaTimesProblem` and their Jacobian, of (z, t, d) and p."""
    F, F_jacobian = (functions[name][0] for name in ('optimality', 'optimality_jacobian'))
    size = F.numel_in(0)
    unknowns, p = ca.MX.sym('unknowns', size + 2), ca.MX.sym('p', F.numel_in(1))
    z, phase = unknowns[:size], unknowns[size + 1]
    rate, inner = F_jacobian(z, p)
    jacobian = ca.horzcat(ca.vertcat(phase * inner, ca.MX.zeros(1, size), rate.T),
                          ca.vertcat(ca.MX.zeros(size + 1, 1), 1), ca.MX.zeros(size + 2, 1))
    return _pair('free_times', [unknowns, p], ca.vertcat(phase * F(z, p), phase, 0),
                 ca.vertcat(phase * rate, phase, 0), jacobian)


def _pair(name: str, inputs: list[ca.MX], alone: ca.MX, rate: ca.MX,
          jacobian: ca.MX) -> dict[str, BatchedFunction]:
    """Return a function of rates and one of rates and Jacobian, with dense results."""
    with_jacobian = [ca.densify(rate), ca.densify(jacobian)]
    return {name: (ca.Function(name, inputs, [ca.densify(alone)]), 1),
            f'{name}_jacobian': (ca.Function(f'{name}_jacobian', inputs, with_jacobian), 1)}
