"""Units of what joints do, for people: of those that turn, and of those that slide."""

from __future__ import annotations

import math
from typing import NamedTuple

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint import Joint
from flex_planner.arms.spatial_joint import slides
from flex_planner.base.validation import Array
import numpy as np


class JointUnits(NamedTuple):
    """Units of a joint's quantities, and the factor to the shown unit of its position."""

    torque: str
    speed: str
    inertia: str
    stiffness: str
    damping: str
    position: str
    scale: float


TURNING = JointUnits('N m', 'rad/s', 'kg m^2', 'N m/rad', 'N m s/rad', 'deg', math.degrees(1.0))
SLIDING = JointUnits('N', 'm/s', 'kg', 'N/m', 'N s/m', 'm', 1.0)


def units_of(joint: Joint) -> JointUnits:
    """Return the units of a joint of any arm."""
    return SLIDING if slides(joint) else TURNING


def position_scales(arm: Arm) -> Array:
    """Return the factors to degrees of joints that turn, to mm of those that slide, (n,)."""
    return np.array([1e3 if slides(joint) else np.degrees(1.0) for joint in arm.joints])


def label_joints(arm: Arm, turning: str, sliding: str) -> str:
    """Return a label of what joints do, with the unit of those that slide if any do."""
    return f'{turning}, {sliding}' if any(map(slides, arm.joints)) else turning
