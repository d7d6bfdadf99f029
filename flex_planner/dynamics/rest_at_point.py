"""Inverse kinematics of the arm as gravity bends it: its tip at rest is at a given point."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.arms.inverse_kinematics import check_singularity
from flex_planner.arms.kinematics import jacobian, tip_jacobian, tip_position
from flex_planner.base.errors import UnreachableError
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
import numpy as np

_MAX_ITERATIONS = 20
# of the reach: distance of the tip from the point, also where joints at limits leave no better
_EXACT, _ENOUGH = 1e-12, 1e-9
# of the way from where the tip rests in the first posture to the point
_SHORTEST_STEP = 1 / 64
_SLOW = 0.5
_FLAT = 1e-12


def rest_at_point(dynamics: ArmDynamics, arm: Arm, point: Array, reference: Array,
                  parameters: PhysicalParameters,
                  near: Array | None = None) -> tuple[Array, Array]:
    """
    Return the arm at rest with its tip at a point, its links bent by gravity.

    From a reference posture the joints turn as the Jacobian there says, which for as many joints
    as the point has coordinates leaves nothing to choose and for more keeps them near it; a joint
    that meets a limit stays there. The branch is that of the reference posture.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    arm : Arm
        Whose joint limits hold.
    point : numpy.ndarray, shape (2,), or (3,) for a spatial arm
        In the base frame [m].
    reference : numpy.ndarray, shape (n,)
        Joint angles of the unbent arm, see `posture_near_point` [rad].
    parameters : PhysicalParameters
        Payload and stiffness.
    near : numpy.ndarray, shape (n_t,), optional
        q at rest there with a little more or less payload, from which it is found sooner.

    Returns
    -------
    coordinates : numpy.ndarray, shape (n_t,)
        q with the static deflection.
    torque : numpy.ndarray, shape (n,)
        That holds it [N m].

    Raises
    ------
    UnreachableError
        If the bent arm does not come to the point, or not within its joint limits.
    SingularError
        If it is stretched out or folded there.
    NoEquilibriumError
        If the links are too soft for their load in the reference posture.

    """
    posture = _BentArm(dynamics, arm, reference, parameters)
    if arm.n_joints < arm.dimension:
        coordinates = posture.at(_nearest(posture, point))[0]
    else:
        found = None if near is None else posture.turn_to(point, near, posture.numbers_of(near))
        coordinates = _approach(posture, point) if found is None else found[0]
    torque, moves = posture.hold(coordinates)
    angles = coordinates[:arm.n_joints]
    _check_limits(arm, angles)
    check_singularity(arm, angles, moves)
    return coordinates, torque


def _check_limits(arm: Arm, angles: Array) -> None:
    """Refuse joint angles outside the limits."""
    for i, (angle, joint) in enumerate(zip(angles, arm.joints, strict=True), 1):
        if not joint.lower_limit <= angle <= joint.upper_limit:
            raise UnreachableError(
                f'to rest there, bent by gravity, joint {i} would have to be at {angle:.4g} rad, '
                f'outside its limits {joint.lower_limit:g} to {joint.upper_limit:g} rad')


class _BentArm:
    """The arm at rest, as a function of numbers, one per coordinate of a point, that turn it."""

    def __init__(self, dynamics: ArmDynamics, arm: Arm, reference: Array,
                 parameters: PhysicalParameters) -> None:
        self.arm, self._dynamics, self._parameters = arm, dynamics, parameters
        self._reference, (self._lower, self._upper) = reference, arm.angle_limits()
        unbent = jacobian(arm, reference)
        self._side, self._directions = _side(unbent), unbent.T / arm.reach  # (n, d)
        self._keeps_limits = arm.n_joints > arm.dimension  # others have no joint to spare

    def at(self, turned: Array) -> tuple[Array, Array, Array]:
        """Return q at rest, the tip (d,), and its derivative (d, d)."""
        q, _ = equilibrium(self._dynamics, self._angles(turned), self._parameters)
        moves = self.hold(q)[1]
        return q, tip_position(self._dynamics.arm, q), moves @ self._turning(turned)

    def hold(self, q: Array) -> tuple[Array, Array]:
        """Return the torque that holds q (n,), and how the tip at rest follows the joints."""
        n = self.arm.n_joints
        force, sagging, _ = self._balance(q)
        moves = tip_jacobian(self._dynamics.arm, q)
        return force[:n], moves[:, :n] - moves[:, n:] @ sagging

    def turn_to(self, point: Array, start: Array, turned: Array) -> tuple[Array, Array] | None:
        """
        Return q at rest with the tip at a near point, and the numbers; None if it is not found.

        Newton's method on the place of the tip and the balance of the links at once.

        """
        n, q, last = self.arm.n_joints, start.copy(), np.inf
        polished = q.size == n  # links that bend take one step more, for their derivatives
        for _ in range(_MAX_ITERATIONS):
            try:
                _, sagging, sag = self._balance(q)
            except np.linalg.LinAlgError:  # about to buckle
                return None
            moves = tip_jacobian(self._dynamics.arm, q)
            follows = moves[:, :n] - moves[:, n:] @ sagging
            left = point - tip_position(self._dynamics.arm, q) - moves[:, n:] @ sag
            miss = float(np.linalg.norm(left)) + float(np.abs(sag).max(initial=0.0))
            near = miss <= _EXACT * self.arm.reach
            if (near and polished) or (miss > _SLOW * last and miss <= _ENOUGH * self.arm.reach):
                return (q, turned) if self._is_whole(q, follows) else None
            if not miss < last:
                return None
            polished, last = polished or near, miss
            turned = turned + _least_squares(follows @ self._turning(turned), left)
            angles = self._angles(turned)
            q[n:] += sag - sagging @ (angles - q[:n])
            q[:n] = angles
        return None

    def numbers_of(self, q: Array) -> Array:
        """Return the numbers (d,) that lead to the joint angles of q, or near them."""
        return _least_squares(self._directions, q[:self.arm.n_joints] - self._reference)

    def _balance(self, q: Array) -> tuple[Array, Array, Array]:
        """Return static forces, how links sag as joints turn, and what they sag more now."""
        n = self.arm.n_joints
        forces, stiffness = self._dynamics.static_forces(q[None], self._parameters.physical)
        if q.size == n:
            return forces[0], np.zeros((0, n)), np.zeros(0)
        pulled = np.column_stack([stiffness[0, n:, :n], -forces[0, n:]])
        solved = np.linalg.solve(stiffness[0, n:, n:], pulled).astype(np.float64)
        return forces[0], solved[:, :n], solved[:, n]

    def _is_whole(self, q: Array, follows: Array) -> bool:
        """Return whether q is on the branch of the reference posture, and would not buckle."""
        n = self.arm.n_joints
        stiffness = self._dynamics.static_forces(q[None], self._parameters.physical)[1]
        return _side(follows) == self._side and bool(
            q.size == n or np.linalg.eigvalsh(stiffness[0, n:, n:])[0] > 0)

    def _turning(self, turned: Array) -> Array:
        """Return the derivative of the joint angles, shape (n, d)."""
        if not self._keeps_limits:
            return self._directions
        free = self._reference + self._directions @ turned
        inside = (free > self._lower) & (free < self._upper)
        return np.where(inside[:, None], self._directions, 0.0)

    def _angles(self, turned: Array) -> Array:
        """Return the joint angles, shape (n,)."""
        angles: Array = self._reference + self._directions @ turned
        return np.clip(angles, self._lower, self._upper) if self._keeps_limits else angles


def _least_squares(matrix: Array, right: Array) -> Array:
    solution: Array = np.linalg.lstsq(matrix, right, rcond=None)[0].astype(np.float64)
    return solution


def _approach(posture: _BentArm, point: Array) -> Array:
    """Bring the tip from where it rests in the reference posture to a point, in steps."""
    way, step = 0.0, 1.0
    turned: Array = np.zeros(point.size)
    q, first, _ = posture.at(turned)
    while way < 1:
        there = min(way + step, 1.0)
        found = posture.turn_to(first + there * (point - first), q, turned)
        if found is None:
            step /= 2
            if step < _SHORTEST_STEP:
                raise UnreachableError(
                    'no posture was found in which the arm, bent by gravity, rests with its tip '
                    f'at {_say_point(point, 6)} m')
        else:
            (q, turned), way = found, there
    return q


def _side(moves: Array) -> float:
    """Return the branch: the sign of the determinant of a square; others have none."""
    rows, columns = moves.shape
    if rows != columns:
        return 0.0
    side = float(np.linalg.det(moves))
    # of an arm in space whose tip moves in a plane only rounding is left
    return float(np.sign(side)) if abs(side) > _FLAT * np.linalg.norm(moves)**rows else 0.0


def _nearest(posture: _BentArm, point: Array) -> Array:
    """Turn the only joint until the tip passes a point, which lies on its curve or is refused."""
    turned: Array = np.zeros(point.size)
    for _ in range(_MAX_ITERATIONS):
        _, tip, slope = posture.at(turned)
        change = _least_squares(slope, point - tip)
        turned = turned + change
        if np.abs(change).max() <= _EXACT:
            break
    tip, n = posture.at(turned)[1], posture.arm.n_joints
    joints = 'one joint' if n == 1 else f'{n} joints'
    if np.linalg.norm(tip - point) > _ENOUGH * posture.arm.reach:
        raise UnreachableError(
            f'the tip of the arm, bent by gravity, rests at {_say_point(tip, 9)} m at nearest: '
            f'with {joints} it does not come to {_say_point(point, 9)} m')
    return turned


def _say_point(point: Array, digits: int) -> str:
    """Return a point in parentheses."""
    return f'({", ".join(f"{entry:.{digits}g}" for entry in point)})'
