"""The limits on the way that an arm has by itself, and those of a task."""

from __future__ import annotations

import math

from flex_planner.arms.arm import Arm
from flex_planner.optimal_control.path_constraints.bending_constraints import BendingMoment
from flex_planner.optimal_control.path_constraints.joint_constraints import (
    JointRange,
    JointSpeed,
)
from flex_planner.optimal_control.path_constraints.path_constraint import PathConstraint


def limits_of_arm(arm: Arm) -> tuple[PathConstraint, ...]:
    """Return the limits of angles, speeds and bending moments that an arm's file gives."""
    found: list[PathConstraint] = []
    for i, joint in enumerate(arm.joints, 1):
        if math.isfinite(joint.lower_limit) or math.isfinite(joint.upper_limit):
            found.append(JointRange(joint=i, lower=joint.lower_limit, upper=joint.upper_limit))
        if math.isfinite(joint.motor.max_speed):
            found.append(JointSpeed(joint=i, limit=joint.motor.max_speed))
    found += [BendingMoment(link=i, limit=link.allowable_moment)
              for i, link in enumerate(arm.links, 1)
              if link.modes and math.isfinite(link.allowable_moment)]
    return tuple(found)
