"""Via points against limits on the way: what no motion through them can keep."""

from __future__ import annotations

from collections.abc import Iterator

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.validation import Array
from flex_planner.optimal_control.constrained_motion import way_slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import JointRange, KeepOut, PathSlacks
import numpy as np

# by which a slack may be passed, and a tip be off its point: rounding
_MARGIN, _AT_POINT = 1e-6, 1e-9


def check_via_points(problem: MotionProblem) -> str:
    """
    Return which limit a via point breaks whenever it is passed, and by how much; empty if none.

    Looked at are ranges of joints whose angle is given, and regions kept free of a tip whose point
    is given. What else a via point may break depends on the motion.

    """
    slacks = way_slacks_of(problem) if problem.junctions.size else None
    if slacks is None:
        return ''
    for k in range(problem.junctions.size):
        values = slacks(_state_at(problem, k)[None])[0]
        for i in _decided(problem, slacks, k):
            if values[i] < -_MARGIN:
                label = slacks.labels[i]
                return (f'via point {k + 1} breaks a limit that holds on the whole way: '
                        f'{label.name}, by {-values[i] * label.scale:.3g} {label.unit}')
    return ''


def _state_at(problem: MotionProblem, index: int) -> Array:
    """Return the unbent arm at rest in the posture of a via point, shape (2 n_t,)."""
    state = np.zeros(2 * problem.layout.coordinates)
    state[:problem.model.arm.n_joints] = problem.via.postures[index]
    return state


def _decided(problem: MotionProblem, slacks: PathSlacks, index: int) -> Iterator[int]:
    """Yield the slacks that a via point decides, whatever the motion is."""
    via, arm = problem.via.points[index], problem.model.arm
    tip = tip_position(arm, _state_at(problem, index)[:arm.n_coordinates])
    at_point = bool(via.point.size) and float(np.linalg.norm(tip - via.point)) < _AT_POINT
    known = (np.isfinite(via.positions) if via.positions.size
             else np.zeros(arm.n_joints, dtype=bool))
    for i, owner in enumerate(slacks.owners()):
        limit = slacks.constraints[owner]
        if isinstance(limit, JointRange) and known[limit.joint - 1]:
            yield i
        elif isinstance(limit, KeepOut) and at_point and i == slacks.owners().index(owner):
            yield i  # the tip is the first of its points
