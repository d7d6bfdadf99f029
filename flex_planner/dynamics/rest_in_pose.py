"""Inverse kinematics of a spatial arm as gravity bends it: its tip at rest is in a given pose."""

from __future__ import annotations

from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_inverse_kinematics import turn_between
from flex_planner.arms.spatial_kinematics import tip_frame, tip_moves
from flex_planner.base.errors import UnreachableError
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
import numpy as np

_MAX_ITERATIONS = 30
# of the reach, and of a radian
_EXACT = 1e-10


def rest_in_pose(dynamics: ArmDynamics, arm: SpatialArm, point: Array, orientation: Array,
                 reference: Array, parameters: PhysicalParameters) -> Array:
    """
    Return the joint coordinates of the arm at rest with its tip in a pose, bent by gravity.

    Newton's method from the posture in which the unbent arm has that pose, or nearly; a redundant
    arm turns as little as it can at every step, and joints stay within their limits.

    Parameters
    ----------
    dynamics : ArmDynamics
        Of the arm: n joints.
    arm : SpatialArm
        Whose joint limits hold.
    point : numpy.ndarray, shape (3,)
        In the base frame [m].
    orientation : numpy.ndarray, shape (3, 3)
        Columns are the axes of the tip's frame in that of the base.
    reference : numpy.ndarray, shape (n,)
        See `spatial_posture_near_point` [rad, m].
    parameters : PhysicalParameters
        Payload and stiffness.

    Returns
    -------
    numpy.ndarray, shape (n,)
        [rad, m].

    Raises
    ------
    UnreachableError
        If the bent arm does not come into that pose, or not within its joint limits.
    NoEquilibriumError
        If the links are too soft for their load.

    """
    n, (lower, upper) = arm.n_joints, arm.angle_limits()
    scale, angles, size = np.array([arm.reach] * 3 + [1.0] * 3), reference, np.inf
    for _ in range(_MAX_ITERATIONS):
        q, _ = equilibrium(dynamics, angles, parameters)
        place, axes = tip_frame(arm, q)
        miss = np.concatenate([point - place, -turn_between(orientation, axes)]) / scale
        size = float(np.linalg.norm(miss))
        if size <= _EXACT:
            return q[:n]
        moves = _follow(dynamics, arm, q, parameters) / scale[:, None]
        angles = np.clip(q[:n] + np.linalg.lstsq(moves, miss, rcond=None)[0], lower, upper)
    raise UnreachableError(
        'no posture within the joint limits was found in which the arm, bent by gravity, rests '
        f'with its tip in that pose: it is missed by {size:.2g} of the reach and of a radian')


def _follow(dynamics: ArmDynamics, arm: SpatialArm, q: Array,
            parameters: PhysicalParameters) -> Array:
    """Return how the tip at rest moves and turns with the joints, shape (6, n)."""
    n, moves = arm.n_joints, tip_moves(arm, q)
    if q.size == n:
        return moves
    stiffness = dynamics.static_forces(q[None], parameters.physical)[1][0]
    sagging = np.linalg.solve(stiffness[n:, n:], stiffness[n:, :n])
    follows: Array = moves[:, :n] - moves[:, n:] @ sagging
    return follows
