"""
The power of a body's inertia, gravity, elasticity and damping in a virtual motion.

In Kane's form, ``vy . F + wy . N`` and what the modes add; F and N are what the motion takes at
the origin of the body's frame. Gravity is in the acceleration of the frame.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
from flex_planner.arms.mechanism import FlexibleBody, RigidBody
from flex_planner.base.validation import Array
from flex_planner.dynamics.moving_frame import MovingFrame, Posture
from flex_planner.dynamics.vectors import (
    add,
    apply,
    cross,
    dot,
    is_zero,
    Motion,
    product,
    scale,
    total,
    Vector,
)


@dataclass(frozen=True, slots=True, eq=False)
class Inertia:
    """
    Mass, first moment and inertia about the origin of a frame; entries may be symbols.

    Parameters
    ----------
    mass : object
        [kg].
    moment : tuple
        [kg m].
    matrix : list of lists
        3 by 3 [kg m^2].

    """

    mass: Any
    moment: Vector
    matrix: list[list[Any]]

    @classmethod
    def of(cls, body: RigidBody | FlexibleBody) -> Inertia:
        """Return those of a body; of a flexible one unbent."""
        x, y, z = body.first_moment.tolist()
        return cls(float(body.mass), (x, y, z), body.inertia.tolist())

    def __add__(self, other: Inertia) -> Inertia:
        """Return those of two bodies in one frame."""
        return Inertia(total([self.mass, other.mass]), add(self.moment, other.moment),
                       [[total(pair) for pair in zip(*rows, strict=True)]
                        for rows in zip(self.matrix, other.matrix, strict=True)])

    def spins_about(self, axis: int) -> bool:
        """Return whether it is the same when its frame turns about an axis."""
        first, second = (i for i in range(3) if i != axis)
        skewed = [self.matrix[i][k] for i in range(3) for k in range(3) if i != k]
        across = self.matrix[first][first], self.matrix[second][second]
        return is_zero([self.moment[first], self.moment[second], *skewed]) and (
            is_zero(across) or all(isinstance(entry, float) for entry in across)
            and across[0] == across[1])

    def power(self, frame: MovingFrame) -> Any:
        """Return its power in the virtual motion of its frame [W]."""
        force = add(scale(self.mass, frame.acceleration),
                    cross(frame.angular_acceleration, self.moment),
                    cross(frame.turning, cross(frame.turning, self.moment)))
        torque = add(cross(self.moment, frame.acceleration),
                     apply(self.matrix, frame.angular_acceleration),
                     cross(frame.turning, apply(self.matrix, frame.turning)))
        return total([dot(frame.virtual_velocity, force), dot(frame.virtual_turning, torque)])

    def potential(self, posture: Posture) -> Any:
        """Return its potential energy [J]."""
        weight = add(scale(self.mass, posture.position), self.moment)
        return -1.0 * dot(posture.gravity, weight)


def flexible_power(body: FlexibleBody, carried: Inertia, frame: MovingFrame, modes: Motion,
                   rigidity: Any) -> Any:
    """
    Return the power of a flexible body with a rigid one that turns with its frame [W].

    Parameters
    ----------
    body, carried : FlexibleBody and Inertia
        Both in this frame.
    frame : MovingFrame
        Of the link.
    modes : Motion
        Lists of m coordinates q.
    rigidity : casadi.SX
        Of the link [N m^2].

    """
    q, rates, seconds, virtual = modes.value, modes.rate, modes.acceleration, modes.virtual
    unbent = Inertia.of(body) + carried
    if not body.count:
        return unbent.power(frame)
    moments = _deflect(body.displacement, body.shortening, modes)
    slopes = _inertia_slopes(body, q)
    bent = Inertia(unbent.mass, add(unbent.moment, moments.value),
                   _bent_inertia(unbent.matrix, body, q))
    turning, spin = frame.turning, frame.angular_acceleration
    couple = _modal_moments(body, q)
    force = add(cross(turning, scale(2.0, moments.rate)), moments.acceleration)
    torque = add(scale(2.0, apply(_weighted(slopes, rates), turning)), apply(couple, seconds))
    if body.spin.any():
        torque = add(torque, cross(turning, apply(body.spin, rates)))
    swirl = _swirl(body, rates, virtual)
    return total([
        bent.power(frame), dot(frame.virtual_velocity, force), dot(frame.virtual_turning, torque),
        dot(moments.virtual, frame.acceleration), dot(apply(couple, virtual), spin),
        -1.0 * dot(turning, apply(_weighted(slopes, virtual), turning)),
        product(2.0, dot(turning, swirl)), _modal_power(body, modes, rigidity)])


def flexible_potential(body: FlexibleBody, carried: Inertia, posture: Posture, q: list[Any],
                       rigidity: Any) -> Any:
    """Return the potential energy of a flexible body, bending included [J]."""
    unbent = Inertia.of(body) + carried
    moments = add(apply(body.displacement, q), scale(0.5, _quadratic(body.shortening, q, q)))
    bent = Inertia(unbent.mass, add(unbent.moment, moments), unbent.matrix)
    bending = product(0.5, dot(q, _rows(body.stiffness, q)))
    return total([bent.potential(posture), product(rigidity, bending)])


def tip_shift(body: FlexibleBody, modes: Motion) -> Motion:
    """Return where the tip of a body is in its frame."""
    moved = _deflect(body.tip_displacement, body.tip_shortening, modes)
    x, y, z = body.tip.tolist()
    return replace(moved, value=add((x, y, z), moved.value))


def _deflect(linear: Array, square: Array, modes: Motion) -> Motion:
    """Return ``A q + q^T B q / 2``, which moves, for A (3, m) and symmetric B (3, m, m)."""
    moved = modes.apply(lambda z: apply(linear, z))
    if not square.any():
        return moved
    q, rates = modes.value, modes.rate
    return Motion(
        add(moved.value, scale(0.5, _quadratic(square, q, q))),
        add(moved.rate, _quadratic(square, q, rates)),
        add(moved.acceleration, _quadratic(square, q, modes.acceleration),
            _quadratic(square, rates, rates)),
        add(moved.virtual, _quadratic(square, q, modes.virtual)))


def _quadratic(square: Array, left: list[Any], right: list[Any]) -> Vector:
    """Return ``left^T B right`` for B (3, m, m)."""
    x, y, z = (dot(left, _rows(matrix, right)) if matrix.any() else 0.0 for matrix in square)
    return x, y, z


def _inertia_slopes(body: FlexibleBody, q: list[Any]) -> list[list[list[Any]]]:
    """Return ``K_j(q)``, the integral of (r . Phi_j) 1 - Phi_j r^T, for each mode."""
    return [[[total([float(slope[i, k]), dot(bend[:, i, k], q)]) for k in range(3)]
             for i in range(3)]
            for slope, bend in zip(body.inertia_slope, body.inertia_bend, strict=True)]


def _bent_inertia(unbent: list[list[Any]], body: FlexibleBody, q: list[Any]) -> list[list[Any]]:
    """Return the inertia of the body as it is bent."""
    linear = body.inertia_slope + body.inertia_slope.swapaxes(1, 2)
    square = (body.inertia_bend + body.inertia_bend.swapaxes(2, 3)) / 2
    return [[total([unbent[i][k], *(
        product(q_j, total([float(linear[j, i, k]), dot(square[j, :, i, k], q)]))
        for j, q_j in enumerate(q))]) for k in range(3)] for i in range(3)]


def _modal_moments(body: FlexibleBody, q: list[Any]) -> list[list[Any]]:
    """Return the integral of r x Phi_j, 3 by m."""
    return [[total([float(body.moment[i, j]), dot(body.cross_moment[:, j, i], q)])
             for j in range(body.count)] for i in range(3)]


def _weighted(matrices: list[list[list[Any]]], weights: list[Any]) -> list[list[Any]]:
    """Return the sum of matrices with weights."""
    return [[dot([matrix[i][k] for matrix in matrices], weights) for k in range(3)]
            for i in range(3)]


def _swirl(body: FlexibleBody, rates: list[Any], virtual: list[Any]) -> Vector:
    """Return the sum of ``q'_k y_j`` times the integral of Phi_k x Phi_j."""
    x, y, z = (dot(rates, [dot(row, virtual) for row in body.cross_moment[:, :, i]])
               for i in range(3))
    return x, y, z


def _modal_power(body: FlexibleBody, modes: Motion, rigidity: Any) -> Any:
    """Return the power of the modes among themselves: inertia, bending, damping."""
    bending = dot(modes.virtual, _rows(body.stiffness, modes.value))
    losses = dot(modes.virtual, [product(float(c), rate) for c, rate in zip(
        body.damping, modes.rate, strict=True)])
    return total([dot(modes.virtual, _rows(body.gram, modes.acceleration)),
                  product(rigidity, bending), product(ca.sqrt(rigidity), losses)])


def _rows(matrix: Array, vector: list[Any]) -> list[Any]:
    """Return the product of a constant matrix and coordinates."""
    return [dot(row, vector) for row in matrix]
