"""Joints in space: revolute and prismatic, about or along any axis."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.joint import Joint, Node
from flex_planner.arms.spatial_body import as_point, IDENTITY, Matrix, Point, rotation
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import vector
import numpy as np

__all__ = ['SpatialJoint']

_SHORTEST = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialJoint(Joint):
    """
    A joint at the end of the link before, or at the base.

    What is a torque [N m], an angle [rad] or a speed [rad/s] of a revolute joint is a force [N], a
    way [m] or a speed [m/s] of a prismatic one.

    Parameters
    ----------
    axis : array_like, shape (3,)
        About which the link turns, or along which it slides, in the frame of the joint; its
        length does not matter.
    rotation : array_like, shape (3,) or (3, 3)
        Of the joint's frame in that of the link before: roll, pitch and yaw [rad], or a matrix
        whose columns are its axes. The frame of the link is that of the joint, moved by it.
    slides : bool
        Whether the joint is prismatic.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    axis: Point = (0.0, 0.0, 1.0)
    rotation: Matrix = IDENTITY
    slides: bool = False

    def __post_init__(self) -> None:
        # no `super()`: a dataclass with slots is made anew
        Joint.__post_init__(self)
        if self.housing != Node():
            raise InvalidValueError('housing', 'given', 'left out for a joint in space: the body '
                                    'at the tip of the link before says what sits there')
        direction = vector('axis', self.axis, 3)
        if not np.linalg.norm(direction) > _SHORTEST:
            raise InvalidValueError('axis', direction.tolist(), 'a direction, not 0')
        object.__setattr__(self, 'axis', as_point(direction / np.linalg.norm(direction)))
        object.__setattr__(self, 'rotation', rotation('rotation', self.rotation))
        if not isinstance(self.slides, bool):
            raise InvalidValueError('slides', self.slides, 'true or false')


def slides(joint: Joint) -> bool:
    """Return whether a joint of any arm is prismatic."""
    return isinstance(joint, SpatialJoint) and joint.slides
