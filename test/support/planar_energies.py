"""
Equations of motion of a planar flexible chain as CasADi expressions.

Euler-Lagrange with assumed modes, Korayem et al. 2009, eqs. (1)-(5) and (18)-(25), for any
number of links and modes. Velocities are carried from link to link in link frames, so that
only one sine and cosine per joint appear; the integrals over a link enter as constants.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
from energy_chain import EnergyChain
from flex_planner.arms.arm import Arm, Link, Node


@dataclass(slots=True)
class _Frame:
    """Motion of a link's base frame, in its own axes; g is gravity."""

    velocity: Any
    position: Any
    gravity: Any
    rate: Any

    def turn(self, angle: Any, rate: Any) -> _Frame:
        """Return the frame after a rotation by ``angle``, turning ``rate`` faster."""
        c, s = ca.cos(angle), ca.sin(angle)
        inverse = ca.vertcat(ca.horzcat(c, s), ca.horzcat(-s, c))
        return _Frame(inverse @ self.velocity, inverse @ self.position, inverse @ self.gravity,
                      self.rate + rate)

    def move(self, length: float, deflection: Any, rate: Any) -> _Frame:
        """Return the frame shifted to a point of the link that bends."""
        v, w = self.velocity, self.rate
        velocity = ca.vertcat(v[0] - w * deflection, v[1] + w * length + rate)
        position = self.position + ca.vertcat(length, deflection)
        return _Frame(velocity, position, self.gravity, w)


def build_energy_chain(arm: Arm) -> EnergyChain:
    """
    Return the symbolic dynamics of an arm.

    Parameters
    ----------
    arm : Arm
        Its flexural rigidities are left symbolic, all else enters as constants.

    """
    q, rates = ca.SX.sym('q', arm.n_coordinates), ca.SX.sym('dq', arm.n_coordinates)
    payload, inertia = ca.SX.sym('m_p'), ca.SX.sym('J_p')
    rigidity, coulomb, fading = (ca.SX.sym(name, arm.n_joints)
                                 for name in ('EI', 'tau_c', 'v_s'))
    zero = ca.SX(2, 1)
    frame = _Frame(zero, zero, ca.SX(ca.sparsify(ca.DM(arm.gravity))), ca.SX(1, 1))
    kinetic, potential, slope, slope_rate = ca.SX(0), ca.SX(0), ca.SX(0), ca.SX(0)
    for i, (link, modal) in enumerate(zip(arm.links, arm.modal_slices, strict=True)):
        turn, turn_rate = _link_turn(arm, i, q), _link_turn(arm, i, rates)
        frame = frame.turn(turn + slope, turn_rate + slope_rate)
        bend, bend_rate = q[modal], rates[modal]
        T, V = _link_energies(link, frame, bend, bend_rate, rigidity[i])
        shapes = link.mode_shapes()
        slope, slope_rate = _dot(shapes.tip_slope, bend), _dot(shapes.tip_slope, bend_rate)
        kinetic += T + arm.nodes[i].inertia * frame.rate**2 / 2
        kinetic += arm.joints[i].motor.reflected_inertia * rates[i]**2 / 2
        frame = frame.move(link.length, _dot(shapes.tip_deflection, bend),
                           _dot(shapes.tip_deflection, bend_rate))
        housing = arm.joints[i + 1].housing if i + 1 < arm.n_joints else Node()
        kinetic += housing.inertia * (frame.rate + slope_rate)**2 / 2
        mass = arm.nodes[i + 1].mass + housing.mass
        kinetic += mass * ca.sumsqr(frame.velocity) / 2
        potential += V - mass * ca.dot(frame.gravity, frame.position)
    kinetic += (arm.nodes[-1].inertia + inertia) * (frame.rate + slope_rate)**2 / 2
    carried = frame.turn(slope, slope_rate).move(*map(float, arm.payload_com), ca.SX(0))
    kinetic += payload * ca.sumsqr(carried.velocity) / 2
    potential += _spring_energy(arm, q) - payload * ca.dot(carried.gravity, carried.position)
    return EnergyChain(
        coordinates=q, rates=rates, payload_mass=payload, payload_inertia=inertia,
        rigidity=rigidity, kinetic=kinetic, potential=potential,
        coulomb_friction=coulomb, coulomb_speed=fading,
        friction=_damping(arm, rigidity) * rates + ca.vertcat(
            *(coulomb[i] * ca.tanh(rates[i] / fading[i]) if joint.coulomb_friction else ca.SX(1, 1)
              for i, joint in enumerate(arm.joints)), ca.SX(arm.n_passive, 1)))


def _link_turn(arm: Arm, index: int, coordinates: Any) -> Any:
    """Return the angle by which a joint turns its link: that of an elastic one twists."""
    if index not in arm.elastic_joints:
        return coordinates[index]
    return coordinates[index] + coordinates[arm.n_joints + arm.elastic_joints.index(index)]


def _spring_energy(arm: Arm, q: Any) -> Any:
    """Return the energy of the springs in the joints."""
    springs = [joint.elasticity.stiffness for joint in arm.joints if joint.elasticity]
    return sum((stiffness * q[arm.n_joints + k]**2 / 2 for k, stiffness in enumerate(springs)),
               ca.SX(0))


def _damping(arm: Arm, rigidity: Any) -> Any:
    """Return the damping coefficient of each coordinate: joints, then modes."""
    coefficients = [ca.SX(ca.sparsify(ca.DM(joint.viscous_friction))) for joint in arm.joints]
    coefficients += [ca.SX(joint.elasticity.damping) for joint in arm.joints if joint.elasticity]
    for i, link in enumerate(arm.links):
        modes, ratios = link.mode_shapes(), link.damping_ratios
        for j, ratio in enumerate(ratios.tolist()):
            mass = link.linear_density * modes.gram[j, j]
            coefficients.append(2 * ratio * ca.sqrt(rigidity[i] * modes.stiffness[j, j] * mass)
                                if ratio else ca.SX(1, 1))
    return ca.vertcat(*coefficients)


def _dot(weights: Any, values: Any) -> Any:
    """Return the scalar product of constants and symbols; 0 for none of them."""
    return sum((float(w) * values[j] for j, w in enumerate(weights) if w), ca.SX(0))


def _rest_moments(link: Link) -> tuple[tuple[float, float], float]:
    """Return first moments along and across, and the inertia about the joint, piece by piece."""
    if link.center_of_mass is not None and link.inertia is not None:
        x, y = link.center_of_mass
        return (link.mass * x, link.mass * y), link.inertia + link.mass * (x**2 + y**2)
    start, first, second = 0.0, 0.0, 0.0
    for share, density in [(one.share, one.density) for one in link.sections] or [(1.0, 1.0)]:
        length = share * link.length
        mass, middle = link.linear_density * density * length, start + length / 2
        first, start = first + mass * middle, start + length
        second += mass * (middle**2 + length**2 / 12)
    return (first, 0.0), second


def _link_energies(link: Link, frame: _Frame, q: Any, dq: Any, rigidity: Any) -> tuple[Any, Any]:
    """
    Return kinetic and potential energy of one link, eqs. (21) and (23).

    The square of the curvature that eq. (23) lacks is there.

    """
    rho, L, modes = link.linear_density, link.length, link.mode_shapes()
    v, w, g = frame.velocity, frame.rate, frame.gravity
    mass, (first, aside), second = rho * L, *_rest_moments(link)
    b_q, b_dq = aside + _dot(rho * modes.area, q), _dot(rho * modes.area, dq)
    gram = ca.sparsify(ca.DM(rho * modes.gram))
    kinetic = (mass * ca.sumsqr(v) / 2 - v[0] * w * b_q + v[1] * (w * first + b_dq)
               + w**2 * (second + ca.bilin(gram, q, q)) / 2
               + w * _dot(rho * modes.moment, dq) + ca.bilin(gram, dq, dq) / 2)
    weight = mass * ca.dot(g, frame.position) + g[0] * first + g[1] * b_q
    bending = rigidity * ca.bilin(ca.sparsify(ca.DM(modes.stiffness)), q, q) / 2
    return kinetic, bending - weight
