"""
An arm under a sampled drive as CasADi functions, with the derivatives of its motion.

The state is that of the arm and of its drive; its derivatives by all parameters are carried along
with the same Runge-Kutta steps, so they are those of the computed motion itself, not of an
approximation of it.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.arms.mechanism_of_arm import mechanism_of
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import batch, BatchedFunction, solver_of
from flex_planner.identification.loop_sizes import LAGS, LoopSizes
from flex_planner.identification.plant_parameters import with_damping
import numpy as np


def build_loop_functions(arm: Arm, sizes: LoopSizes) -> dict[str, BatchedFunction]:
    """
    Derive the functions that a fit takes.

    Parameters
    ----------
    arm : Arm
        From `bare_arm`: damping, friction and rotors are symbols here, and what it says of them
        are the weights of the modes and a placeholder of the rotors.
    sizes : LoopSizes
        Of the arrays.

    Returns
    -------
    dict of str to (casadi.Function, int)
        - ``linear_rate`` (x, u) -> q'', its derivatives by x, the parameters, and u
        - ``rest`` q -> dV/dq, d2V/dq2, d2V/dq dp
        - ``loop_step`` ((z, dz), row), controller -> z and its derivatives after a step

    """
    rate = _linear_rate(arm, sizes)
    return {'linear_rate': rate[0], 'rest': rate[1],
            'loop_step': (_loop_step(rate[0][0], sizes), 2)}


def _linear_rate(arm: Arm, sizes: LoopSizes) -> tuple[BatchedFunction, BatchedFunction]:
    """Return q'' with its derivatives, and the forces at rest with theirs."""
    n, n_t = sizes.joints, sizes.coordinates
    links: Any = tuple(with_damping(link, [0.0]) if link.modes else link for link in arm.links)
    chain = build_chain(replace(arm, links=links))
    q, rates, a = chain.coordinates, chain.rates, chain.accelerations
    p, constants = ca.SX.sym('p', sizes.physical), ca.SX.sym('k', 1 + n)
    mass, *groups = ca.vertsplit(p, [0, *range(1, sizes.physical + 1, n)])
    rigidity, damping, viscous, coulomb, rotor = groups
    placeholder = [joint.motor.reflected_inertia for joint in arm.joints]
    symbols = ca.vertcat(chain.payload_mass, chain.payload_inertia, chain.rigidity,
                         chain.coulomb_friction, chain.coulomb_speed)
    values = ca.vertcat(mass, constants[0], rigidity, coulomb, constants[1:])
    losses = _losses(arm, rates, rigidity, damping)
    added = rotor - ca.DM(placeholder)
    forces = ca.substitute(chain.inverse_dynamics(a), symbols, values) + ca.vertcat(
        added * a[:n] + viscous * rates[:n], losses)
    M = ca.substitute(chain.mass_matrix(), symbols, values) + ca.diag(
        ca.vertcat(added, ca.SX.zeros(n_t - n)))
    u, x = ca.SX.sym('u', n), ca.vertcat(q, rates)
    pushed = ca.vertcat(u, ca.SX.zeros(n_t - n))
    solve = solver_of(M)
    bias = ca.substitute(forces, a, ca.SX.zeros(n_t))
    acceleration = solve(pushed - bias)
    change = ca.substitute(-ca.jacobian(forces, ca.vertcat(x, p)), a, acceleration)
    unit = ca.vertcat(ca.SX.eye(n), ca.SX.zeros(n_t - n, n))
    slopes = solve(ca.horzcat(change, unit))
    by_x, by_p, by_u = ca.horzsplit(slopes, [0, 2 * n_t, 2 * n_t + sizes.physical,
                                             slopes.size2()])
    shared = ca.vertcat(p, constants)
    potential = ca.substitute(chain.potential, symbols, values)
    force = ca.gradient(potential, q)
    return (batch('linear_rate', [x, u], shared, [
        acceleration, by_x, by_p, by_u]),
        batch('rest', [q], shared, [force, ca.jacobian(force, q), ca.jacobian(force, p)]))


def _losses(arm: Arm, rates: Any, rigidity: Any, damping: Any) -> Any:
    """Return the damping of twists and modes, of which a chain without ratios has the twists'."""
    losses = [ca.SX(1, 1) for _ in arm.elastic_joints]
    links = mechanism_of(arm).links
    for i, (link, place) in enumerate(zip(links, arm.modal_slices, strict=True)):
        # a bare arm has half the weights as ratios: this is the weight times sqrt(k rho m)
        losses += [2 * damping[i] * float(c) * ca.sqrt(rigidity[i]) * rates[k]
                   for c, k in zip(link.beam.damping, range(place.start, place.stop), strict=True)]
    return ca.vertcat(*losses)


@dataclass(frozen=True, slots=True, eq=False)
class _Carried:
    """A value and its derivatives by all columns."""

    value: Any
    slope: Any

    def __add__(self, other: _Carried) -> _Carried:
        return _Carried(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: _Carried) -> _Carried:
        return _Carried(self.value - other.value, self.slope - other.slope)

    def scale(self, factor: Any) -> _Carried:
        """Return it times a constant number, or one per row."""
        if factor.numel() == 1:
            return _Carried(factor * self.value, factor * self.slope)
        return _Carried(factor * self.value, ca.diag(factor) @ self.slope)

    def rows(self, place: slice) -> _Carried:
        """Return some of its rows."""
        return _Carried(self.value[place], self.slope[place, :])


def _stack(parts: Sequence[_Carried]) -> _Carried:
    return _Carried(ca.vertcat(*(part.value for part in parts)),
                    ca.vertcat(*(part.slope for part in parts)))


def _loop_step(linear_rate: Any, sizes: LoopSizes) -> Any:
    """
    Return one Runge-Kutta step of the arm, at whose beginning the drive may be sampled.

    A row has the angles, speeds and efforts that the drive follows, (n,) each; the length of the
    step and its derivative by the delay; 1 where the drive is sampled, and 1 where that is for
    the first time; and 1 for the one of the commands, newest first, that acts. The controller is
    stiffness and damping of the drive, then of the guide, which acts at once; what a filter keeps
    of the last speed; 1 if speeds are measured, 0 if they are differences; and the period.

    """
    n, n_t, n_c, n_z = sizes.joints, sizes.coordinates, sizes.columns, sizes.state
    carried, row = ca.MX.sym('z', n_z * (1 + n_c)), ca.MX.sym('r', sizes.row)
    controller = ca.MX.sym('c', 4 * n + 3)
    shared = ca.MX.sym('p', sizes.physical + n + 1 + n)
    ends = [0, sizes.physical, sizes.physical + n, shared.numel()]
    physical, offset, constants = ca.vertsplit(shared, ends)
    at = _Carried(carried[:n_z], ca.reshape(carried[n_z:], n_z, n_c))
    step, step_slope, sampled, first = ca.vertsplit(row[3 * n:3 * n + 4])
    before = 2 * n_t
    drive = _sample(at, row[:3 * n], controller, offset, sizes, first)
    kept = at.rows(slice(before, n_z))
    drive = kept + (drive - kept).scale(sampled)
    acting = drive.rows(slice(2 * n, 3 * n))  # the guide
    for lag in range(LAGS + 1):
        command = drive.rows(slice((3 + lag) * n, (4 + lag) * n))
        acting = acting + command.scale(row[3 * n + 4 + lag])
    lengths = ca.MX(1, n_c)
    lengths[0, sizes.physical + n] = step_slope
    every = ca.vertcat(physical, constants)

    def rate(x: _Carried) -> _Carried:
        acceleration, by_x, by_p, by_u = linear_rate(x.value, acting.value, every)
        value = ca.vertcat(x.value[n_t:], acceleration)
        direct = ca.horzcat(by_p, ca.MX.zeros(n_t, n_c - sizes.physical))
        change = by_x @ x.slope + direct + by_u @ acting.slope
        return _Carried(step * value, step * ca.vertcat(x.slope[n_t:, :], change)
                        + value @ lengths)

    moved = _runge_kutta(rate, at.rows(slice(0, before)))
    after = _stack([moved, drive])
    return ca.Function('loop_step', [carried, row, controller, shared], [
        ca.vertcat(after.value, ca.vec(after.slope))])


def _runge_kutta(rate: Callable[[_Carried], _Carried], x: _Carried) -> _Carried:
    """Return x after a step of the classical method, whose length is in the rate."""
    half, third, sixth = (ca.MX(1 / parts) for parts in (2, 3, 6))
    first = rate(x)
    second = rate(x + first.scale(half))
    more = rate(x + second.scale(half))
    last = rate(x + more)
    return x + (first + last).scale(sixth) + (second + more).scale(third)


def _sample(at: _Carried, followed: Any, controller: Any, offset: Any, sizes: LoopSizes,
            first: Any) -> _Carried:
    """Return the drive after it has read its encoders."""
    n, n_t = sizes.joints, sizes.coordinates
    stiffness, damping, guide_stiffness, guide_damping, rest = ca.vertsplit(
        controller, [0, n, 2 * n, 3 * n, 4 * n, 4 * n + 3])
    keeps, measured, period = (rest[i] for i in range(3))
    goal, speed_goal, effort = (
        _Carried(part, ca.MX(n, sizes.columns)) for part in ca.vertsplit(followed, n))
    shift = np.zeros((n, sizes.columns))
    shift[:, sizes.physical:sizes.physical + n] = np.eye(n)
    angles = at.rows(slice(0, n)) + _Carried(offset, ca.MX(ca.DM(shift)))
    speeds = at.rows(slice(n_t, n_t + n))
    filtered = at.rows(slice(2 * n_t, 2 * n_t + n)).scale(keeps) + (
        angles - at.rows(sizes.angles)).scale((1 - keeps) / period)
    seen = speeds.scale(measured) + filtered.scale(1 - measured)
    command = effort + (goal - angles).scale(stiffness) + (speed_goal - seen).scale(damping)
    guide = (goal - angles).scale(guide_stiffness) + (speed_goal - speeds).scale(guide_damping)
    commands = [command]
    for lag in range(LAGS):
        start = 2 * n_t + (3 + lag) * n
        old = at.rows(slice(start, start + n))
        commands.append(old + (command - old).scale(first))
    return _stack([filtered, angles, guide, *commands])
