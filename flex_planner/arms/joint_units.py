"""Units of what joints do, for people: of those that turn, and of those that slide."""

from __future__ import annotations

import math
from typing import NamedTuple

from flex_planner.arms.joint import Joint
from flex_planner.arms.spatial_joint import slides


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
