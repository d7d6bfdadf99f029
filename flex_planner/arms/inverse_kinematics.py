"""
Joint angles that put the tip at a point, and condition (I) of the paper.

The arm is taken unbent, as at rest in a horizontal plane; where gravity bends it,
`flex_planner.dynamics.rest_at_point` goes on from here. Closed form for one and two links; for
more the posture nearest to a given one, found numerically within the joint limits. For spatial
arms see `spatial_inverse_kinematics`.

"""

from __future__ import annotations

from dataclasses import replace
import math

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import jacobian, tip_position
from flex_planner.arms.planar_only import require_planar
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_inverse_kinematics import (
    check_spatial_singularity,
    spatial_inverse_kinematics,
    spatial_posture_near_point,
)
from flex_planner.base.errors import (
    InvalidValueError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.validation import Array
import numpy as np
from numpy.typing import ArrayLike

# relative to reach^2: nearer to a stretched or folded arm a small step needs huge joint motion
_SINGULAR = 1e-3
# relative to the reach
_EXACT = 1e-9
_CANDIDATES = 12
# of the reach, and of the width of the workspace: so far within it, an arm that sags is still on
# the branch of the unbent one
_INSIDE, _INSIDE_NARROW = 5e-2, 0.25
# on the distance from the wanted posture, less and less
_WEIGHTS = (1e-1, 1e-2, 1e-4, 0.0)


def workspace(arm: Arm) -> tuple[float, float]:
    """Return the smallest and largest distance of a planar arm's tip from its base [m]."""
    require_planar(arm, 'rings that a tip reaches')
    lengths = [link.length for link in arm.links]
    return max(0.0, 2 * max(lengths) - sum(lengths)), sum(lengths)


def check_angle_limits(arm: Arm, field: str, positions: Array) -> None:
    """Raise InvalidValueError if a joint angle is outside its limits."""
    for i, (angle, joint) in enumerate(zip(positions, arm.joints, strict=True)):
        if not joint.lower_limit <= angle <= joint.upper_limit:
            raise InvalidValueError(
                f'{field}[{i}]', float(angle),
                f'within the limits of the joint, {joint.lower_limit:g} to '
                f'{joint.upper_limit:g} rad')


def check_singularity(arm: Arm, positions: ArrayLike, moves: Array | None = None) -> None:
    """
    Apply the second half of condition (I): the Jacobian must not lose rank.

    An arm with one joint moves its tip along a circle only and is never refused.

    Parameters
    ----------
    arm : Arm
        n joints.
    positions : array_like, shape (n,)
        Joint angles [rad].
    moves : numpy.ndarray, shape (2 or 3, n), optional
        The Jacobian; that of the unbent arm if it is not given [m/rad].

    Raises
    ------
    SingularError
        With the reason in words.

    """
    angles = np.asarray(positions, dtype=float)
    if isinstance(arm, SpatialArm):
        check_spatial_singularity(arm, angles, moves)
        return
    if arm.n_joints < 2:
        return
    J = jacobian(arm, angles) if moves is None else moves
    # for two joints this is |det J|
    measure = float(np.sqrt(max(np.linalg.det(J @ J.T), 0.0)))
    limit = _SINGULAR * arm.reach**2
    if measure < limit:
        degrees = ', '.join(f'{np.degrees(angle):.2f}' for angle in angles)
        raise SingularError(
            f'the arm is stretched out or folded at joint angles ({degrees}) deg: '
            f'sqrt(det(J J^T)) = {measure:.3g} m^2 is below {limit:.3g} m^2, so its tip cannot '
            'move in every direction')


def inverse_kinematics(arm: Arm, point: ArrayLike, elbow: int,
                       near: Array | None = None) -> Array:
    """
    Return joint angles that put the tip of the unbent arm at a point.

    Parameters
    ----------
    arm : Arm
        n joints.
    point : array_like, shape (2,), or (3,) for a spatial arm
        In the base frame [m].
    elbow : int
        Sign of the second joint angle, +1 or -1; with more than two links the side to which
        the arm bends if `near` is not given. No effect on a single link, nor on a spatial arm.
    near : numpy.ndarray, shape (n,), optional
        Posture to stay close to: full turns of the first joint, and with more than two links
        the choice among the solutions [rad].

    Returns
    -------
    numpy.ndarray, shape (n,)
        [rad].

    Raises
    ------
    UnreachableError
        If the point is out of the workspace, or joint limits keep the arm from it.
    SingularError
        If the arm is stretched out or folded there.
    InvalidValueError
        If `elbow` is not +1 or -1.

    """
    if elbow not in (-1, 1):
        raise InvalidValueError('elbow', elbow, '+1 or -1')
    if isinstance(arm, SpatialArm):
        return spatial_inverse_kinematics(arm, point, near)
    target = np.asarray(point, dtype=float)
    _check_workspace(arm, target)
    if arm.n_joints == 1:
        positions = np.array([np.arctan2(target[1], target[0])])
    elif arm.n_joints == 2:
        positions = _two_links(arm, target, elbow)
    else:
        wanted = _bent_posture(arm, target, elbow) if near is None else near
        positions = _nearest_posture(arm, target, wanted)
    positions = _turn_into_limits(arm, positions, near)
    check_singularity(arm, positions)
    return positions


def posture_near_point(arm: Arm, point: ArrayLike, elbow: int,
                       near: Array | None = None) -> Array:
    """
    Return joint angles from which those of the arm at rest with its tip at a point are found.

    They are those of `inverse_kinematics`. Where gravity bends the arm they are so for the nearest
    point that is clear of the edges of the workspace, and without joint limits if those keep only
    the unbent arm from it: the bent one may come to where the other cannot.

    Parameters
    ----------
    arm, point, elbow, near
        As of `inverse_kinematics`.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Outside the joint limits only where the unbent arm would have to leave them [rad].

    Raises
    ------
    UnreachableError, SingularError, InvalidValueError
        See `inverse_kinematics`.

    """
    if isinstance(arm, SpatialArm):
        return spatial_posture_near_point(arm, point, near)
    if not arm.bends_at_rest:
        return inverse_kinematics(arm, point, elbow, near)
    inside = _move_inside(arm, np.asarray(point, dtype=float))
    try:
        return inverse_kinematics(arm, inside, elbow, near)
    except UnreachableError:
        free = replace(arm, joints=tuple(
            replace(joint, lower_limit=-math.inf, upper_limit=math.inf) for joint in arm.joints))
        angles = inverse_kinematics(free, inside, elbow, near)
    turns = np.round((np.clip(angles, *arm.angle_limits()) - angles) / (2 * np.pi))
    return angles + 2 * np.pi * turns


def _move_inside(arm: Arm, point: Array) -> Array:
    """Return the nearest point that is clear of the edges of the unbent arm's workspace."""
    near, far = workspace(arm)
    margin = min(_INSIDE * arm.reach, _INSIDE_NARROW * (far - near))
    distance = float(np.hypot(*point))
    wanted = float(np.clip(distance, near + margin, far - margin))
    if wanted == distance:
        return point
    direction = point / distance if distance else np.array([1.0, 0.0])
    return wanted * direction


def _check_workspace(arm: Arm, point: Array) -> None:
    """Raise UnreachableError if a point is nearer or farther than the arm can reach."""
    near, far = workspace(arm)
    distance, slack = float(np.hypot(*point)), _EXACT * arm.reach
    if not near - slack <= distance <= far + slack:
        circle = f'only {far:.6g} m' if near == far else f'from {near:.6g} m to {far:.6g} m'
        raise UnreachableError(f'the point ({point[0]:.6g}, {point[1]:.6g}) m is '
                               f'{distance:.6g} m from the base; the arm reaches {circle}')


def _two_links(arm: Arm, point: Array, elbow: int) -> Array:
    """Return the closed form for two links."""
    x, y = point
    L_1, L_2 = (link.length for link in arm.links)
    cosine = (x**2 + y**2 - L_1**2 - L_2**2) / (2 * L_1 * L_2)
    theta_2 = elbow * np.arccos(np.clip(cosine, -1, 1))
    theta_1 = np.arctan2(y, x) - np.arctan2(L_2 * np.sin(theta_2), L_1 + L_2 * np.cos(theta_2))
    return np.array([np.remainder(theta_1 + np.pi, 2 * np.pi) - np.pi, theta_2])


def _bent_posture(arm: Arm, point: Array, elbow: int) -> Array:
    """Return a posture bent evenly to one side, its tip in the direction of a point."""
    share = np.clip(np.hypot(*point) / arm.reach, 0, 1)
    posture = np.full(arm.n_joints, elbow * 2 * np.arccos(share) / (arm.n_joints - 1))
    posture[0] = 0.0
    tip = tip_position(arm.rigid(), posture)
    posture[0] = np.arctan2(point[1], point[0]) - np.arctan2(tip[1], tip[0])
    return posture


def _nearest_posture(arm: Arm, point: Array, near: Array) -> Array:
    """Return the posture closest to a given one among those that reach a point."""
    rigid, (lower, upper) = arm.rigid(), arm.angle_limits()
    from scipy.optimize import least_squares  # a tenth of a second, and not every task needs it

    for start in _starts(near, lower, upper):
        positions = start
        for weight in _WEIGHTS:
            positions = least_squares(
                lambda q, w=weight: np.concatenate([
                    (tip_position(rigid, q) - point) / arm.reach, w * (q - near)]),
                positions, lambda q, w=weight: np.vstack([
                    jacobian(rigid, q) / arm.reach, w * np.eye(near.size)]),
                bounds=(lower, upper), max_nfev=60, xtol=1e-15, ftol=1e-15,
                gtol=1e-15).x
        if np.abs(tip_position(rigid, positions) - point).max() <= _EXACT * arm.reach:
            return np.asarray(positions, dtype=float)
    raise UnreachableError(f'no posture within the joint limits was found that puts the tip at '
                           f'({point[0]:.6g}, {point[1]:.6g}) m')


def _starts(near: Array, lower: Array, upper: Array) -> list[Array]:
    """Return postures to start from: the given one, then others, always the same."""
    random = np.random.default_rng(0)
    middle = np.clip(near, lower, upper)
    low, high = np.maximum(lower, middle - np.pi), np.minimum(upper, middle + np.pi)
    return [middle, *random.uniform(low, high, (_CANDIDATES, near.size))]


def _turn_into_limits(arm: Arm, positions: Array, near: Array | None) -> Array:
    """Return the same posture by the full turns that suit the joint limits, then `near`."""
    result = positions.copy()
    for i, joint in enumerate(arm.joints):
        wanted = 0.0 if near is None else near[i]
        allowed_place = np.clip(wanted, joint.lower_limit, joint.upper_limit)
        turns = np.round((allowed_place - positions[i]) / (2 * np.pi)) + np.arange(-1, 2)
        angles = positions[i] + 2 * np.pi * turns
        allowed = angles[(angles >= joint.lower_limit) & (angles <= joint.upper_limit)]
        if not allowed.size:
            raise UnreachableError(
                f'joint {i + 1} would have to be at {positions[i]:.4g} rad, outside its limits '
                f'{joint.lower_limit:g} to {joint.upper_limit:g} rad')
        if i == 0 or not joint.lower_limit <= result[i] <= joint.upper_limit:
            result[i] = allowed[np.argmin(np.abs(allowed - wanted))]
    return result
