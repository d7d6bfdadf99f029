"""Inverse kinematics of the arm as gravity bends it: its tip at rest is at a given point."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.arms.inverse_kinematics import check_singularity
from flex_planner.arms.kinematics import jacobian, tip_jacobian, tip_position
from flex_planner.base.errors import NoEquilibriumError, UnreachableError
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
                  parameters: PhysicalParameters) -> tuple[Array, Array]:
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
    turned = (_approach if arm.n_joints >= arm.dimension else _nearest)(posture, point)
    coordinates, torque, moves = posture.at(turned)
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
        self.side, self._directions = _side(unbent), unbent.T / arm.reach  # (n, d)
        self._keeps_limits = arm.n_joints > arm.dimension  # others have no joint to spare

    def at(self, turned: Array) -> tuple[Array, Array, Array]:
        """Return coordinates, holding torque, and how the tip at rest follows the joints."""
        n, dynamics = self.arm.n_joints, self._dynamics
        q, torque = equilibrium(dynamics, self._angles(turned), self._parameters)
        moves = tip_jacobian(dynamics.arm, q)
        if not dynamics.arm.n_passive:
            return q, torque, moves
        stiffness = dynamics.static_forces(q[None], self._parameters.physical)[1][0]
        sagging = np.linalg.solve(stiffness[n:, n:], stiffness[n:, :n])
        return q, torque, moves[:, :n] - moves[:, n:] @ sagging

    def tip(self, turned: Array) -> tuple[Array, Array, Array]:
        """Return the tip at rest (d,), its derivative (d, d), and that by the joints (d, n)."""
        q, _, moves = self.at(turned)
        directions = self._directions
        if self._keeps_limits:
            free = self._reference + directions @ turned
            inside = (free > self._lower) & (free < self._upper)
            directions = np.where(inside[:, None], directions, 0.0)
        return tip_position(self._dynamics.arm, q), moves @ directions, moves

    def _angles(self, turned: Array) -> Array:
        """Return the joint angles, shape (n,)."""
        angles: Array = self._reference + self._directions @ turned
        return np.clip(angles, self._lower, self._upper) if self._keeps_limits else angles


def _approach(posture: _BentArm, point: Array) -> Array:
    """Bring the tip from where it rests in the reference posture to a point, in steps."""
    turned: Array = np.zeros(point.size)
    way, step = 0.0, 1.0
    first = posture.tip(turned)[0]
    while way < 1:
        there = min(way + step, 1.0)
        found = _newton(posture, turned, first + there * (point - first))
        if found is None:
            step /= 2
            if step < _SHORTEST_STEP:
                raise UnreachableError(
                    'no posture was found in which the arm, bent by gravity, rests with its tip '
                    f'at {_say_point(point, 6)} m')
        else:
            turned, way = found, there
    return turned


def _newton(posture: _BentArm, start: Array, point: Array) -> Array | None:
    """Solve for a near point; None if that fails, or ends on the other branch."""
    turned, last = start, np.inf
    for _ in range(_MAX_ITERATIONS):
        try:
            tip, slope, moves = posture.tip(turned)
        except NoEquilibriumError:
            return None
        miss = float(np.linalg.norm(tip - point))
        exact = _ENOUGH if miss > _SLOW * last else _EXACT
        if miss <= exact * posture.arm.reach:
            return turned if _side(moves) == posture.side else None
        if exact == _ENOUGH:
            return None
        change, last = np.linalg.lstsq(slope, point - tip, rcond=None)[0], miss
        turned = turned + change
    return None


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
    turned = np.zeros(point.size)
    for _ in range(_MAX_ITERATIONS):
        tip, slope, _ = posture.tip(turned)
        change = np.linalg.lstsq(slope, point - tip, rcond=None)[0]
        turned = turned + change
        if np.abs(change).max() <= _EXACT:
            break
    tip, n = posture.tip(turned)[0], posture.arm.n_joints
    joints = 'one joint' if n == 1 else f'{n} joints'
    if np.linalg.norm(tip - point) > _ENOUGH * posture.arm.reach:
        raise UnreachableError(
            f'the tip of the arm, bent by gravity, rests at {_say_point(tip, 9)} m at nearest: '
            f'with {joints} it does not come to {_say_point(point, 9)} m')
    return turned


def _say_point(point: Array, digits: int) -> str:
    """Return a point in parentheses."""
    return f'({", ".join(f"{entry:.{digits}g}" for entry in point)})'
