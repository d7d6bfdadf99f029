"""
Joint coordinates that put the tip of an unbent spatial arm at a point, or into a pose.

Damped least squares within the joint limits from several starts, always the same; of a redundant
arm the posture nearest to a given one. `flex_planner.dynamics.rest_at_point` goes on from here
where gravity bends the arm.

"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_body import rotation
from flex_planner.arms.spatial_kinematics import tip_frame, tip_moves
from flex_planner.base.errors import SingularError, UnreachableError
from flex_planner.base.validation import Array, vector
import numpy as np
from numpy.typing import ArrayLike

# of the reach, and of a radian
_EXACT = 1e-9
# of the reach: so near to it an arm that sags may come to what the unbent one does not reach
_SAGS = 5e-2
_CANDIDATES = 12
# on the distance from the wanted posture, less and less; from other starts it hardly matters
_WEIGHTS, _OTHER_WEIGHTS = (1e-1, 1e-2, 1e-4, 0.0), (1e-2, 0.0)
# smallest singular value of the Jacobian, of the reach
_SINGULAR = 1e-3
_SEED = 0


def spatial_inverse_kinematics(arm: SpatialArm, point: ArrayLike, near: ArrayLike | None = None,
                               *, orientation: ArrayLike | None = None) -> Array:
    """
    Return joint coordinates that put the tip of the unbent arm at a point.

    Parameters
    ----------
    arm : SpatialArm
        n joints.
    point : array_like, shape (3,)
        In the base frame [m].
    near : array_like, shape (n,), optional
        Posture to stay close to [rad, m]; by default zeros, or what the limits have nearest.
    orientation : array_like, shape (3,) or (3, 3), optional
        Of the tip's frame in that of the base, which is free if it is not given: roll, pitch and
        yaw [rad], or a matrix.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Within the joint limits.

    Raises
    ------
    UnreachableError
        If no posture within the joint limits was found.
    SingularError
        If the tip cannot move there in every direction in which it does elsewhere.
    InvalidValueError
        If a size is wrong, or the orientation is no rotation.

    """
    target = _Target(arm, vector('point', point, 3, unit='m'),
                     None if orientation is None else np.array(
                         rotation('orientation', orientation)))
    _check_reach(arm, target.point)
    posture, miss = _search(target, near)
    if miss > _EXACT:
        what = '' if orientation is None else ' with that orientation'
        raise UnreachableError(
            f'no posture within the joint limits was found that puts the tip at '
            f'{_say(target.point)} m{what}: the nearest of {_CANDIDATES + 1} searches is '
            f'{miss * arm.reach:.3g} m from it')
    check_spatial_singularity(arm, posture)
    return posture


def spatial_posture_near_point(arm: SpatialArm, point: ArrayLike, near: ArrayLike | None = None,
                               *, orientation: ArrayLike | None = None) -> Array:
    """
    Return joint coordinates from which those of the arm at rest with its tip at a point are found.

    They are those of `spatial_inverse_kinematics`; where gravity bends the arm, those nearest to
    the point, or the pose, if they are within a twentieth of the reach and of a radian from it.

    Raises
    ------
    UnreachableError, SingularError, InvalidValueError
        See `spatial_inverse_kinematics`.

    """
    if arm.bends_at_rest:
        _check_reach(arm, vector('point', point, 3, unit='m'), _SAGS)
        posture, miss = _search(_Target(
            arm, vector('point', point, 3, unit='m'), None if orientation is None else np.array(
                rotation('orientation', orientation))), near)
        if _EXACT < miss <= _SAGS:
            return posture
    return spatial_inverse_kinematics(arm, point, near, orientation=orientation)


def check_spatial_singularity(arm: SpatialArm, positions: Array,
                              moves: Array | None = None) -> None:
    """
    Apply the second half of condition (I): the Jacobian must not lose rank.

    An arm whose tip moves on a surface or a curve only is measured by what it can do elsewhere.

    Parameters
    ----------
    arm : SpatialArm
        n joints.
    positions : numpy.ndarray, shape (n,)
        Joint coordinates [rad, m].
    moves : numpy.ndarray, shape (3, n), optional
        The Jacobian; that of the unbent arm if it is not given [m/rad].

    Raises
    ------
    SingularError
        With the reason in words.

    """
    J = _moves(arm, positions) if moves is None else moves
    rank = usual_rank(arm)
    least = float(np.linalg.svd(_relative(arm, J), compute_uv=False)[rank - 1])
    if least < _SINGULAR:
        raise SingularError(
            f'at joint coordinates {_say(positions)} rad the tip of the arm cannot move in every '
            f'direction: the smallest singular value of its Jacobian, {least * arm.reach:.3g} m, '
            f'is below {_SINGULAR * arm.reach:.3g} m')


def farthest_reach(arm: SpatialArm) -> float:
    """Return how far the tip of the unbent arm may get from its first joint at most [m]."""
    return arm.reach + sum(
        float(np.abs(limits).max()) for joint, limits in zip(
            arm.joints, zip(*arm.angle_limits(), strict=True), strict=True) if joint.slides)


def _check_reach(arm: SpatialArm, point: Array, slack: float = _EXACT) -> None:
    """Raise UnreachableError if a point is farther than the arm is long, slides included."""
    far = farthest_reach(arm)
    distance = float(np.linalg.norm(point - arm.base))
    if distance > far + slack * arm.reach:
        raise UnreachableError(f'the point {_say(point)} m is {distance:.6g} m from the first '
                               f'joint; the arm reaches at most {far:.6g} m')


@lru_cache(maxsize=64)
def usual_rank(arm: SpatialArm) -> int:
    """Return the rank of the Jacobian where it is largest, found at some postures."""
    random = np.random.default_rng(_SEED)
    lower, upper = _bounds(arm, np.zeros(arm.n_joints))
    values = [np.linalg.svd(_relative(arm, _moves(arm, posture)), compute_uv=False)
              for posture in random.uniform(lower, upper, (8, arm.n_joints))]
    return max(1, int((np.array(values) > _SINGULAR).sum(axis=1).max()))


def _moves(arm: SpatialArm, positions: Array) -> Array:
    """Return the Jacobian of the unbent arm's tip, shape (3, n) [m/rad]."""
    unbent = np.concatenate([positions, np.zeros(arm.n_passive)])
    moves: Array = tip_moves(arm, unbent)[:3, :arm.n_joints]
    return moves


def _relative(arm: SpatialArm, moves: Array) -> Array:
    """Return a Jacobian in units of the reach per radian, or per reach where a joint slides."""
    slides = np.array([joint.slides for joint in arm.joints])
    relative: Array = moves / np.where(slides, 1.0, arm.reach)
    return relative


class _Target:
    """What the tip is to come to: a point [m], with an orientation (3, 3) or without."""

    def __init__(self, arm: SpatialArm, point: Array, orientation: Array | None) -> None:
        self.arm, self.point, self._orientation = arm, point, orientation

    def miss(self, positions: Array) -> Array:
        """Return by how much the tip misses it, in units of the reach and of a radian."""
        place, axes = tip_frame(self.arm, self._unbent(positions))
        away = (place - self.point) / self.arm.reach
        if self._orientation is None:
            return away
        return np.concatenate([away, turn_between(self._orientation, axes)])

    def slope(self, positions: Array) -> Array:
        """Return its derivative by the joint coordinates, that of the turn for small ones."""
        moves = tip_moves(self.arm, self._unbent(positions))[:, :self.arm.n_joints]
        scaled: Array = moves / np.array([[self.arm.reach]] * 3 + [[1.0]] * 3)
        return scaled[:3] if self._orientation is None else scaled

    def _unbent(self, positions: Array) -> Array:
        return np.concatenate([positions, np.zeros(self.arm.n_passive)])


def turn_between(wanted: Array, axes: Array) -> Array:
    """Return the rotation vector from wanted axes to others, in the axes of the base [rad]."""
    turn = axes @ wanted.T
    vector_part: Array = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0],
                                   turn[1, 0] - turn[0, 1]]) / 2
    sine, cosine = float(np.linalg.norm(vector_part)), (float(np.trace(turn)) - 1) / 2
    angle = float(np.arctan2(sine, cosine))
    if sine > 1e-6:
        scaled: Array = vector_part * (angle / sine)
        return scaled
    if cosine > 0:
        return vector_part
    # by half a turn: about the eigenvector that stays
    values, vectors = np.linalg.eigh((turn + turn.T) / 2)
    half: Array = np.pi * vectors[:, int(values.argmax())]
    return half


def _search(target: _Target, near: ArrayLike | None) -> tuple[Array, float]:
    """Return the posture that comes closest, and its miss relative to the reach."""
    n = target.arm.n_joints
    wanted = np.zeros(n) if near is None else vector('near', near, n)
    best, least = wanted, np.inf
    for i, start in enumerate(_starts(target.arm, wanted)):
        posture = _without_turns(target.arm, _descend(
            target, start, wanted, _OTHER_WEIGHTS if i else _WEIGHTS), wanted)
        miss = float(np.linalg.norm(target.miss(posture)))
        if miss < least:
            best, least = posture, miss
        if least <= _EXACT:
            break
    return best, least


def _descend(target: _Target, start: Array, wanted: Array,
             weights: tuple[float, ...]) -> Array:
    """Return the posture near a wanted one that comes closest, from a start."""
    from scipy.optimize import least_squares  # a tenth of a second, and not every task needs it

    lower, upper = target.arm.angle_limits()
    posture = start
    for weight in weights:
        posture = least_squares(
            lambda q, w=weight: np.concatenate([target.miss(q), w * (q - wanted)]), posture,
            lambda q, w=weight: np.vstack([target.slope(q), w * np.eye(q.size)]),
            bounds=(lower, upper), max_nfev=40, xtol=1e-13, ftol=1e-15, gtol=1e-15).x
    return np.asarray(posture, dtype=float)


def _without_turns(arm: SpatialArm, posture: Array, wanted: Array) -> Array:
    """Return a posture turned by whole turns as near to a wanted one as the limits allow."""
    lower, upper = arm.angle_limits()
    turns = np.clip(np.round((wanted - posture) / (2 * np.pi)),
                    np.ceil((lower - posture) / (2 * np.pi)),
                    np.floor((upper - posture) / (2 * np.pi)))
    return np.where([joint.slides for joint in arm.joints], posture, posture + 2 * np.pi * turns)


def _starts(arm: SpatialArm, wanted: Array) -> Iterator[Array]:
    """Yield postures to start from: the wanted one, then others, always the same."""
    lower, upper = arm.angle_limits()
    middle = np.clip(wanted, lower, upper)
    yield middle
    low, high = _bounds(arm, middle)
    yield from np.random.default_rng(_SEED).uniform(low, high, (_CANDIDATES, wanted.size))


def _bounds(arm: SpatialArm, middle: Array) -> tuple[Array, Array]:
    """Return the joint limits, or half a turn or a reach on both sides where there are none."""
    lower, upper = arm.angle_limits()
    wide = np.array([arm.reach if joint.slides else np.pi for joint in arm.joints])
    return np.maximum(lower, middle - wide), np.minimum(upper, middle + wide)


def _say(numbers: Array) -> str:
    """Return numbers in parentheses."""
    return f'({", ".join(f"{entry:.6g}" for entry in numbers)})'
