"""
Energies of spatial arms from where their points are, in the axes of the base.

Beams are clouds of point masses at Gauss points, each with the place that its modes give it, so
that none of the integrals of the model enters; bodies turn by rotation matrices. The twist of a
joint adds to its coordinate.

"""

from __future__ import annotations

from typing import Any

import casadi as ca
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import SpatialBody
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.validation import Array
import numpy as np

_POINTS = 24


class SpatialEnergies:
    """Kinetic and potential energy of an arm at symbols q and rates, (n_t, 1) each."""

    def __init__(self, arm: SpatialArm, q: Any, rates: Any, payload_mass: Any,
                 payload_inertia: Any) -> None:
        self._q, self._rates, self._gravity = q, rates, ca.DM(arm.gravity)
        self.kinetic: Any = 0
        self.potential: Any = 0
        n, elastic = arm.n_joints, arm.elastic_joints
        place, axes = ca.DM(np.array(arm.base)), ca.DM.eye(3)
        for i, (joint, link) in enumerate(zip(arm.joints, arm.links, strict=True)):
            moved = q[i]
            self.kinetic += joint.motor.reflected_inertia * rates[i]**2 / 2
            if joint.elasticity is not None:
                twist = q[n + elastic.index(i)]
                moved += twist
                self.potential += joint.elasticity.stiffness * twist**2 / 2
            axes = axes @ ca.DM(np.array(joint.rotation))
            direction = np.array(joint.axis)
            if joint.slides:
                place = place + axes @ ca.DM(direction) * moved
            else:
                axes = axes @ rodrigues(direction, moved)
            self._add(link.body, place, axes)
            modes = q[arm.modal_slices[i]]
            place, axes = self._add_beam(link, modes, place, axes, self._order(arm, i))
            self._add(link.tip_body, place, axes)
        self.tip = place
        axes = axes @ ca.DM(np.array(arm.tip_rotation))
        center = place + axes @ ca.DM(arm.payload_com)
        self._add_points([payload_mass], [center])
        turning = self._turning(axes)
        self.kinetic += payload_inertia * ca.dot(turning, turning) / 2

    def _order(self, arm: SpatialArm, index: int) -> list[int]:
        """Return the order of the elementary turns of a tip: about the next axis last."""
        link, last = arm.links[index], index == arm.n_joints - 1
        joint = arm.joints[index if last else index + 1]
        axis = np.array(joint.axis) if last else np.array(joint.rotation) @ np.array(joint.axis)
        size = np.abs(link.axes().T @ axis)
        final = int(size.argmax()) if size.max() > 1 - 1e-12 else 2
        return [*(i for i in (0, 2, 1) if i != final), final]

    def _velocity(self, place: Any) -> Any:
        return ca.jtimes(place, self._q, self._rates)

    def _turning(self, axes: Any) -> Any:
        """Return the angular velocity in the axes of the base."""
        rate = ca.reshape(ca.jtimes(ca.vec(axes), self._q, self._rates), 3, 3)
        skew = rate @ axes.T
        return ca.vertcat(skew[2, 1], skew[0, 2], skew[1, 0])

    def _add_points(self, masses: list[Any], places: list[Any]) -> None:
        for mass, place in zip(masses, places, strict=True):
            v = self._velocity(place)
            self.kinetic += mass * ca.dot(v, v) / 2
            self.potential -= mass * ca.dot(self._gravity, place)

    def _add(self, body: SpatialBody, place: Any, axes: Any) -> None:
        if body.is_nothing:
            return
        self._add_points([body.mass], [place + axes @ ca.DM(np.array(body.center_of_mass))])
        turning = axes.T @ self._turning(ca.SX(axes))
        self.kinetic += ca.bilin(ca.DM(np.array(body.inertia)), turning, turning) / 2

    def _add_beam(self, link: SpatialLink, modes: Any, place: Any, axes: Any,
                  order: list[int]) -> tuple[Any, Any]:
        """Add a beam; return place and axes at its tip."""
        if link.beam is None:
            return place + axes @ ca.DM(np.array(link.end)), axes
        beam, turned = link.beam, axes @ ca.DM(link.axes())
        x, w = np.polynomial.legendre.leggauss(_POINTS)
        x, w = (x + 1) / 2 * link.length, w / 2 * link.length * beam.linear_density
        self._add_points(list(w), [place + turned @ self._bent(link, beam, modes, s) for s in x])
        self._add_twist(link, beam, modes, turned, x, w / beam.linear_density)
        self.potential += strain_energy(link, beam, modes)
        tip = place + turned @ self._bent(link, beam, modes, link.length)
        for axis, angle in turns_of_tip(link, beam, modes, order):
            turned = turned @ rodrigues(np.eye(3)[axis], angle)
        return tip, turned @ ca.DM(link.axes().T)

    def _bent(self, link: SpatialLink, beam: SpatialBeam, modes: Any, s: float) -> Any:
        """Return where a point of a beam is in the beam's axes."""
        at = ca.vertcat(s, 0, 0)
        if not beam.count:
            return at
        at += ca.DM(beam.displace(link.length, np.array([s]))[0]) @ modes
        if beam.foreshortening:
            at -= ca.vertcat(ca.bilin(ca.DM(shortening(link, beam, s)), modes, modes) / 2, 0, 0)
        return at

    def _add_twist(self, link: SpatialLink, beam: SpatialBeam, modes: Any, axes: Any, x: Array,
                   w: Array) -> None:
        """Add the rotary inertia of the beam's pieces about its axis."""
        if not beam.polar_inertia:
            return
        about = (axes.T @ self._turning(ca.SX(axes)))
        psi = np.zeros((x.size, beam.count))
        psi[:, sum(beam.modes):] = beam.twist(link.length).turn(x)
        for k in range(x.size):
            rate = ca.DM(psi[k][None]) @ self._velocity(modes) if beam.count else 0
            spin = about[0] + rate
            self.kinetic += beam.polar_inertia * w[k] * spin**2 / 2


def rodrigues(axis: Array, angle: Any) -> Any:
    x, y, z = (float(entry) for entry in axis)
    cross = ca.DM([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return ca.DM.eye(3) + ca.sin(angle) * cross + (1 - ca.cos(angle)) * (cross @ cross)


def shortening(link: SpatialLink, beam: SpatialBeam, end: float) -> Array:
    """Return the integral of phi' phi'^T up to a point."""
    x, w = np.polynomial.legendre.leggauss(_POINTS)
    x, w = (x + 1) / 2 * end, w / 2 * end
    first, both = beam.modes[0], sum(beam.modes)
    gamma = np.zeros((beam.count, beam.count))
    for part, plane in ((slice(0, first), 0), (slice(first, both), 1)):
        slopes = beam.bend(link.length, plane).slope(x)
        gamma[part, part] = (slopes.T * w) @ slopes
    return gamma


def strain_energy(link: SpatialLink, beam: SpatialBeam, modes: Any) -> Any:
    """Return the energy of bending and twisting, by the curvatures at Gauss points."""
    x, w = np.polynomial.legendre.leggauss(64)
    x, w = (x + 1) / 2 * link.length, w / 2 * link.length
    first, both = beam.modes[0], sum(beam.modes)
    energy: Any = 0
    for part, shapes, rigidity in (
            (slice(0, first), beam.bend(link.length, 0).curvature(x), beam.flexural_rigidity[0]),
            (slice(first, both), beam.bend(link.length, 1).curvature(x),
             beam.flexural_rigidity[1]),
            (slice(both, None), beam.twist(link.length).slope(x), beam.torsional_rigidity)):
        if shapes.shape[1]:
            energy += ca.bilin(ca.DM(rigidity * (shapes.T * w) @ shapes), modes[part],
                               modes[part]) / 2
    return energy


def turns_of_tip(link: SpatialLink, beam: SpatialBeam, modes: Any,
                 order: list[int]) -> list[tuple[int, Any]]:
    """Return axes and angles of the elementary turns of a bent tip."""
    first, both = beam.modes[0], sum(beam.modes)
    end = np.array([link.length])
    angles: dict[int, Any] = {}
    if first:
        angles[2] = ca.DM(beam.bend(link.length, 0).slope(end)) @ modes[:first]
    if beam.modes[1]:
        angles[1] = -ca.DM(beam.bend(link.length, 1).slope(end)) @ modes[first:both]
    if beam.twist_modes:
        angles[0] = ca.DM(beam.twist(link.length).turn(end)) @ modes[both:]
    return [(axis, angles[axis]) for axis in order if axis in angles]
