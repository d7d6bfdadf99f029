"""
Limits that hold on the whole way: of joints, speeds, regions kept free, moments and deflections.

`path_constraint` says what one is; `path_slacks` makes array functions of several.

"""

from flex_planner.optimal_control.path_constraints.arm_limits import limits_of_arm
from flex_planner.optimal_control.path_constraints.bending_constraints import (
    BendingMoment,
    Deflection,
)
from flex_planner.optimal_control.path_constraints.constraint_texts import (
    FORMS,
    read_constraint,
    write_constraint,
)
from flex_planner.optimal_control.path_constraints.joint_constraints import (
    JointRange,
    JointSpeed,
)
from flex_planner.optimal_control.path_constraints.obstacles import KeepOut, SelfClearance
from flex_planner.optimal_control.path_constraints.path_constraint import (
    PathConstraint,
    SlackLabel,
)
from flex_planner.optimal_control.path_constraints.path_slacks import PathSlacks
from flex_planner.optimal_control.path_constraints.regions import (
    Capsule,
    Circle,
    HalfPlane,
    Region,
)
from flex_planner.optimal_control.path_constraints.spatial_regions import (
    HalfSpace,
    SpatialCapsule,
    Sphere,
)

__all__ = ['BendingMoment', 'Capsule', 'Circle', 'Deflection', 'FORMS', 'HalfPlane', 'HalfSpace',
           'JointRange', 'JointSpeed', 'KeepOut', 'PathConstraint', 'PathSlacks', 'Region',
           'SelfClearance', 'SlackLabel', 'SpatialCapsule', 'Sphere', 'limits_of_arm',
           'read_constraint', 'write_constraint']
