"""
Pontryagin's conditions with the motors' limits as a barrier, as CasADi functions.

In place of eq. (14) every limit ``c_k(u, q') >= 0`` has a slack s and a multiplier l,

    c_k(u, q') - s_k = 0        s_k l_k = mu        R u + y - sum_k l_k dc_k/du = 0

with ``y = B^T M^-1 psi_2``. For mu -> 0 these are eqs. (14) and (15) of Korayem et al. 2009, and
for any mu they belong to the least of J less mu times the integral of sum_k ln c_k. Linearised
they give (u, s, l) in terms of z, so that a Newton step sees only ``z' = F + J dz``: the unknowns
besides z are eliminated point by point, and found again from the step.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import batch, BatchedFunction
from flex_planner.optimal_control.parameters import ParameterSymbols
from flex_planner.optimal_control.pontryagin import Conditions, derive_conditions, TorqueLaw
from flex_planner.optimal_control.torque_limits import has_caps, TorqueSensitivity


def build_barrier_functions(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Derive the functions that an interior-point method evaluates.

    Every function takes `Parameters.stack` last, with mu after it. y is (u, s, l): n torques, a
    slack and a multiplier of each limit.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.

    Returns
    -------
    dict of str to (casadi.Function, int)
        The int counts the leading inputs that differ from point to point.

        - ``barrier`` (z, y) -> F and J of the step z' = F + J dz
        - ``barrier_direction`` (z, y, dz) -> dy
        - ``payload_barrier``, ``payload_barrier_direction``: the same of (z, m_p, nu), see
          `FreePayloadProblem`

    """
    point = _Point.of(arm)
    return {name: batch(name, inputs, point.p, results)
            for name, (inputs, results) in (point.functions() | point.loaded_functions()).items()}


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """The conditions at a point, and the step of (u, s, l) that goes with one of z."""

    found: Conditions
    p: Any
    payload: Any
    u: Any
    slacks: list[Any]
    multipliers: list[Any]
    mu: Any
    weights: Any
    margins: list[Any]
    by_torque: list[Any]
    by_speed: list[Any]

    @classmethod
    def of(cls, arm: Arm) -> _Point:
        """Derive them."""
        chain, n = build_chain(arm), arm.n_joints
        symbols = ParameterSymbols.of(chain, capped=has_caps(arm))
        u, mu, v = ca.SX.sym('u_b', n), ca.SX.sym('mu'), chain.rates[:n]
        margins = symbols.torque_limits.margins(u, v)
        by_torque, by_speed = (
            [ca.jtimes(margin, symbol, ca.SX.ones(n)) for margin in margins] for symbol in (u, v))
        slacks, multipliers = ([ca.SX.sym(f'{name}_{k}', n) for k in range(len(margins))]
                               for name in ('s', 'l'))
        limits = _Limits(symbols['effort_weights'], slacks, multipliers, by_torque, by_speed)
        found = derive_conditions(chain, symbols, lambda free, speeds: limits.law(u))
        return cls(found, ca.vertcat(*symbols.stack(), mu), chain.payload_mass, u, slacks,
                   multipliers, mu, symbols['effort_weights'], margins, by_torque, by_speed)

    @property
    def limits(self) -> _Limits:
        """Return the limits."""
        return _Limits(self.weights, self.slacks, self.multipliers, self.by_torque,
                       self.by_speed)

    @property
    def y(self) -> Any:
        """Return (u, s, l)."""
        return ca.vertcat(self.u, *self.slacks, *self.multipliers)

    def steps(self, of_virtual: Any, of_speeds: Any) -> Any:
        """Return the step of (u, s, l) that goes with steps of B^T y and q'."""
        limits, n = self.limits, self.u.numel()
        ratios = limits.ratios
        pulls = [self.mu / s - ratio * (c - s)
                 for s, ratio, c in zip(self.slacks, ratios, self.margins, strict=True)]
        forced = (-(self.weights * self.u + self.found.virtual[:n])
                  + _total(self.by_torque, pulls)) / limits.curvature
        u = forced - of_virtual / limits.curvature - limits.torque_by_speed * of_speeds
        s = [c - s + by_u * u + by_v * of_speeds for c, s, by_u, by_v in zip(
            self.margins, self.slacks, self.by_torque, self.by_speed, strict=True)]
        multipliers = [self.mu / slack - old - ratio * step for slack, old, ratio, step in zip(
            self.slacks, self.multipliers, ratios, s, strict=True)]
        return u, s, multipliers

    def condense(self, rate: Any) -> Any:
        """Return a rate with what the step of (u, s, l) adds to it while z stays."""
        u, _, multipliers = self.steps(0, 0)
        return rate + ca.jtimes(rate, ca.vertcat(self.u, *self.multipliers),
                                ca.vertcat(u, *multipliers))

    def functions(self) -> dict[str, tuple[list[Any], list[Any]]]:
        """Return inputs and results of the functions of z."""
        z, dz = self.found.z, ca.SX.sym('dz', self.found.z.numel())
        virtual = ca.jtimes(self.found.virtual[:self.u.numel()], z, dz)
        return {
            'barrier': ([z, self.y], [self.condense(self.found.rate),
                                      self.found.jacobian.assemble().T]),
            'barrier_direction': ([z, self.y, dz], [self._direction(virtual, dz)])}

    def loaded_functions(self) -> dict[str, tuple[list[Any], list[Any]]]:
        """Return inputs and results of the functions of (z, m_p, nu)."""
        inner, n, mass = self.found.z, self.u.numel(), ca.SX.sym('m_p')
        size = inner.numel()
        half, dz = size // 2, ca.SX.sym('dz', size + 2)
        z, share = ca.vertcat(inner, mass, ca.SX.sym('nu')), self.found.payload_share
        by_mass = ca.jacobian(self.found.virtual[:n], self.payload)
        # the torque falls as y = M^-1 psi_2 grows with the payload
        pushed = -by_mass / self.limits.curvature
        rate = self.found.rate
        by_payload = ca.jacobian(rate, self.payload) + ca.jtimes(rate, self.u, pushed)
        by_payload[half + size // 4:half + size // 4 + n] += self.limits.torque_by_speed * by_mass
        bend = ca.jacobian(share, self.payload) + ca.jtimes(share, self.u, pushed)
        turned = ca.vertcat(by_payload[half:], -by_payload[:half])
        jacobian = ca.horzcat(
            ca.vertcat(self.found.jacobian.assemble().T, by_payload.T, ca.SX(1, size)),
            ca.SX(size + 2, 1), ca.vertcat(turned, -bend, 0))
        virtual = ca.jtimes(self.found.virtual[:n], inner, dz[:size]) + by_mass * dz[size]
        results = [ca.vertcat(self.condense(rate), 0, self.condense(-share)), jacobian,
                   self._direction(virtual, dz)]
        F, J, dy = ca.substitute(results, [self.payload], [mass])
        return {'payload_barrier': ([z, self.y], [F, J]),
                'payload_barrier_direction': ([z, self.y, dz], [dy])}

    def _direction(self, virtual: Any, dz: Any) -> Any:
        """Return the step of (u, s, l) that goes with one of z."""
        n_t, n = self.found.z.numel() // 4, self.u.numel()
        u, slacks, multipliers = self.steps(virtual, dz[n_t:n_t + n])
        return ca.vertcat(u, *slacks, *multipliers)


@dataclass(frozen=True, slots=True, eq=False)
class _Limits:
    """The motors' limits with the slacks and multipliers of an iterate, all (n, 1)."""

    weights: Any
    slacks: list[Any]
    multipliers: list[Any]
    by_torque: list[Any]
    by_speed: list[Any]

    @property
    def ratios(self) -> list[Any]:
        """Return l / s of each limit."""
        return [multiplier / slack for multiplier, slack in zip(
            self.multipliers, self.slacks, strict=True)]

    @property
    def curvature(self) -> Any:
        """Return R + sum l / s (dc/du)^2: a torque costs this much when it changes."""
        return self.weights + _total(self.by_torque, [
            ratio * by for ratio, by in zip(self.ratios, self.by_torque, strict=True)])

    @property
    def torque_by_speed(self) -> Any:
        """Return -du/dq'."""
        return _total(self.by_speed, [
            ratio * by for ratio, by in zip(self.ratios, self.by_torque, strict=True)]
        ) / self.curvature

    def law(self, u: Any) -> TorqueLaw:
        """Return u as the torque of a point, with what its linearised conditions say of it."""
        lost, curvature = self.torque_by_speed, self.curvature
        stiffness = _total(self.by_speed, [
            ratio * by for ratio, by in zip(self.ratios, self.by_speed, strict=True)])
        return TorqueLaw(
            torque=u, multiplier=_total(self.by_speed, self.multipliers),
            sensitivity=TorqueSensitivity(
                inside=self.weights / curvature, by_costate=1 / curvature, by_speed=lost,
                of_costate=stiffness - curvature * lost**2))


def _total(left: list[Any], right: list[Any]) -> Any:
    """Return the sum of products."""
    return sum(a * b for a, b in zip(left, right, strict=True))
