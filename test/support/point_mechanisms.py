"""
Mechanisms in space whose links are clouds of point masses, so that their energies are plain sums.

Each mode moves every point of its link in a direction of its own. The energies follow from
where the points are in the axes of the base, by rotation matrices.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arms.mechanism import FlexibleBody, Mechanism, MechanismLink, RigidBody
from flex_planner.base.validation import Array
import numpy as np
from scipy.spatial.transform import Rotation

POINTS = 5


@dataclass(frozen=True, slots=True, eq=False)
class PointLink:
    """A link of points: masses (k,), places (k, 3), shapes (k, 3, m); the last is its tip."""

    masses: Array
    places: Array
    shapes: Array
    turn: Array
    joint: MechanismLink

    @classmethod
    def draw(cls, rng: np.random.Generator, modes: int) -> PointLink:
        """Return a random link."""
        masses, places = rng.uniform(0.1, 1.0, POINTS), rng.normal(size=(POINTS, 3))
        shapes, turn = rng.normal(size=(POINTS, 3, modes)), rng.normal(size=(3, modes))
        end = rng.normal(size=(3, 3))
        beam = point_body(masses, places, shapes, turn, rng.normal(size=modes))
        joint = MechanismLink(
            base=RigidBody(), beam=beam,
            end=RigidBody(mass=0.7, first_moment=rng.normal(size=3), inertia=end @ end.T),
            position=rng.normal(size=3), axis=int(rng.integers(3)),
            rotation=Rotation.random(random_state=rng).as_matrix(),
            tip_order=tuple(int(i) for i in rng.permutation(3)))
        return cls(masses, places, shapes, turn, joint)


def point_body(masses: Array, places: Array, shapes: Array, turn: Array,
               damping: Array) -> FlexibleBody:
    """Return the integrals of a link of points."""
    m = shapes.shape[2]
    one = np.eye(3)

    def slopes(r: Array, mode: Array) -> Array:
        """Return the sum of (r . phi) 1 - phi r^T."""
        return np.einsum('k,ki,ki,ab->ab', masses, r, mode, one) - np.einsum(
            'k,ka,kb->ab', masses, mode, r)

    by_mode = np.moveaxis(shapes, 2, 0)  # (m, k, 3)
    return FlexibleBody(
        mass=float(masses.sum()), first_moment=masses @ places,
        inertia=sum(w * (r @ r * one - np.outer(r, r))
                    for w, r in zip(masses, places, strict=True)),
        displacement=np.einsum('k,kim->im', masses, shapes),
        inertia_slope=np.array([slopes(places, one) for one in by_mode]).reshape(m, 3, 3),
        inertia_bend=np.array([[slopes(other, one) for other in by_mode]
                               for one in by_mode]).reshape(m, m, 3, 3),
        moment=np.array([masses @ np.cross(places, one) for one in by_mode]).reshape(m, 3).T,
        cross_moment=np.array([[masses @ np.cross(other, one) for one in by_mode]
                               for other in by_mode]).reshape(m, m, 3),
        gram=np.einsum('k,kim,kij->mj', masses, shapes, shapes),
        stiffness=np.diag(np.arange(1.0, m + 1)), damping=np.abs(damping),
        tip=places[-1], tip_displacement=shapes[-1], tip_turn=turn)


def point_mechanism(links: list[PointLink], gravity: Array) -> Mechanism:
    """Return the mechanism of links."""
    return Mechanism(links=[link.joint for link in links],
                     friction=np.linspace(0.1, 0.4, len(links)), gravity=gravity)


def point_energies(links: list[PointLink], gravity: Array, q: Any, rates: Any, payload: Any,
                   rigidity: Any) -> tuple[Any, Any]:
    """Return kinetic and potential energy of the points, and of the bodies at the tips."""
    at, kinetic, potential = len(links), ca.SX(0), ca.SX(0)
    place, turned = ca.SX(3, 1), ca.SX.eye(3)
    for i, link in enumerate(links):
        joint, m = link.joint, link.shapes.shape[2]
        place = place + turned @ joint.position
        turned = turned @ ca.DM(joint.rotation) @ _turn(joint.axis, q[i])
        bend = q[at:at + m]
        at += m
        seen = [place + turned @ (ca.DM(r) + ca.DM(shape) @ bend)
                for r, shape in zip(link.places, link.shapes, strict=True)]
        masses = list(link.masses)
        place = seen[-1]
        for axis in joint.tip_order:
            turned = turned @ _turn(axis, ca.dot(ca.DM(link.turn[axis]), bend))
        end, last = joint.end, link is links[-1]
        # a rigid body is six points with the same moments
        for mass, r in [*_six_points(end), *([(payload, np.zeros(3))] if last else [])]:
            masses.append(mass)
            seen.append(place + turned @ ca.DM(r))
        for mass, point in zip(masses, seen, strict=True):
            kinetic += mass * ca.sumsqr(ca.jtimes(point, q, rates)) / 2
            potential -= mass * ca.dot(ca.DM(gravity), point)
        potential += rigidity[i] * ca.bilin(ca.DM(joint.beam.stiffness), bend, bend) / 2
    return kinetic, potential


def _six_points(body: RigidBody) -> list[tuple[float, Array]]:
    """Return points with the mass, moment and inertia of a body; masses may be negative."""
    centre = body.first_moment / body.mass
    about = body.inertia - body.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    # the integral of r r^T, whose trace is half that of the inertia
    spread = np.trace(about) / 2 * np.eye(3) - about
    sizes, axes = np.linalg.eigh(spread)
    points = [(size / 2, centre + sign * axis) for size, axis in zip(sizes, axes.T, strict=True)
              for sign in (1, -1)]
    return [*points, (body.mass - sizes.sum(), centre)]


def _turn(axis: int, angle: Any) -> Any:
    """Return the matrix of a turn about a coordinate axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    matrix = ca.SX.eye(3)
    second, third = (axis + 1) % 3, (axis + 2) % 3
    matrix[second, second], matrix[second, third] = c, -s
    matrix[third, second], matrix[third, third] = s, c
    return matrix
