"""Joint coordinates in which the tip of a spatial arm rests at a point with an orientation."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_body import rotation
from flex_planner.arms.spatial_inverse_kinematics import spatial_posture_near_point
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array, number, vector
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.rest_in_pose import rest_in_pose
import numpy as np
from numpy.typing import ArrayLike


def posture_in_pose(arm: Arm, point: ArrayLike, orientation: ArrayLike,
                    near: ArrayLike | None = None, *, payload_mass: float = 0.0,
                    payload_inertia: float | None = None) -> Array:
    """
    Return the joint coordinates of an arm at rest with its tip in a pose.

    Gravity bends links and springs: the pose is that of the bent arm with this payload, and with
    another one the same joint coordinates have another pose.

    Parameters
    ----------
    arm : Arm
        A spatial one of n joints; six, or fewer if they happen to allow the pose.
    point : array_like, shape (3,)
        Of the tip, in the base frame [m].
    orientation : array_like, shape (3,) or (3, 3)
        Of the tip's frame in that of the base: roll, pitch and yaw [rad], or a matrix.
    near : array_like, shape (n,), optional
        Posture to stay close to, see `spatial_posture_near_point`.
    payload_mass, payload_inertia : float
        As of `Task`.

    Returns
    -------
    numpy.ndarray, shape (n,)
        [rad, m].

    Raises
    ------
    InvalidValueError
        If the arm is a planar one, a size is wrong or the orientation is no rotation.
    UnreachableError, SingularError, NoEquilibriumError
        See `spatial_posture_near_point` and `rest_in_pose`.

    """
    if not isinstance(arm, SpatialArm):
        raise InvalidValueError('goal_orientation', 'given', 'left out for a planar arm: its tip '
                                'turns with its joints')
    place = vector('goal_point', point, 3, unit='m')
    axes = np.array(rotation('goal_orientation', orientation))
    mass = number('payload_mass', payload_mass, at_least=0, unit='kg')
    posture = spatial_posture_near_point(arm, place, near, orientation=axes)
    if not arm.bends_at_rest:
        return posture
    inertia = arm.payload_inertia if payload_inertia is None else payload_inertia
    carried = PhysicalParameters.of_arm(arm, payload_mass=mass, payload_inertia=inertia)
    return rest_in_pose(ArmDynamics.of(arm), arm, place, axes, posture, carried)
