"""
Limits on the way: joint angles and speeds of the arm, checked at every moment of a motion.

The conditions of optimality know nothing of these limits, so a motion may swing through them
between a start and a goal that keep them. `find_limit_violations` says where.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
import math

from flex_planner.arms.joint_units import JointUnits, SLIDING, TURNING, units_of
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np

# [rad], and as a share of max_speed: by how much a limit may be passed. Motions are exact to a
# millionth, so less than this is rounding, as of a start that is its joint's limit.
MARGIN = 1e-6
# positions in an interval of the mesh: its polynomials are of degree 11 at most
_POSITIONS = np.linspace(0, 1, 25, dtype=np.float64)
# around a sample that is largest: each time the step is an eighth
_AROUND = np.linspace(-1, 1, 17, dtype=np.float64)
_ZOOMS = 4


class LimitKind(Enum):
    """What is limited; the value is shown to people."""

    LOWER_ANGLE = 'lower limit'
    UPPER_ANGLE = 'upper limit'
    SPEED = 'max_speed'


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitViolation:
    """
    Where a motion is furthest beyond a limit of a joint.

    Attributes
    ----------
    joint : int
        Index, from 0.
    kind : LimitKind
        The limit.
    time : float
        Of the worst excess [s].
    value, limit : float
        Joint angle [rad] or signed joint speed, and its limit in that direction [rad/s].
    units : JointUnits
        Of the joint, for people.

    """

    joint: int
    kind: LimitKind
    time: float
    value: float
    limit: float
    units: JointUnits = TURNING

    @property
    def excess(self) -> float:
        """Return by how much the limit is passed, > 0 [rad, rad/s]."""
        return abs(self.value - self.limit)

    @property
    def share(self) -> float:
        """Return the excess as a share of a half turn, or of the limit of the speed [-]."""
        return self.excess / (abs(self.limit) if self.kind is LimitKind.SPEED else math.pi)

    def __str__(self) -> str:
        """Return the violation in a sentence."""
        if self.kind is LimitKind.SPEED:
            speed, does = self.units.speed, 'slides' if self.units is SLIDING else 'turns'
            return (f'joint {self.joint + 1} {does} at {self.value:.4g} {speed} at '
                    f'{self.time:.4g} s, {self.excess:.3g} {speed} beyond its max_speed of '
                    f'{abs(self.limit):.4g}')
        unit = self.units.position
        value, limit, excess = self.units.scale * np.array([self.value, self.limit, self.excess])
        return (f'joint {self.joint + 1} is at {value:.5g} {unit} at {self.time:.4g} s, '
                f'{excess:.3g} {unit} beyond its {self.kind.value} of {limit:.5g} {unit}')


def find_limit_violations(problem: MotionProblem,
                          solution: CollocationSolution) -> tuple[LimitViolation, ...]:
    """
    Return where a motion leaves limits of its joints, the worst first.

    A joint has one entry for each of its limits that is passed, at the time of its worst excess,
    whose value is that of the polynomials of the solution: their extremum, not a sample.

    Parameters
    ----------
    problem : MotionProblem
        Of n joints; the limits are those of its task's arm.
    solution : CollocationSolution
        The motion.

    Returns
    -------
    tuple of LimitViolation
        Empty where all limits are kept to `MARGIN`.

    """
    limits, found = _limits(problem), list[LimitViolation]()
    if not limits:
        return ()
    joints = _joint_motion(problem, solution)
    samples = joints.values_at(_POSITIONS)
    for limit in limits:
        time, excess = _largest(joints, limit, samples)
        if excess > limit.margin:
            value = limit.bound + limit.sign * excess
            found.append(LimitViolation(joint=limit.joint, kind=limit.kind, time=time,
                                        value=value, limit=limit.bound,
                                        units=units_of(problem.task.arm.joints[limit.joint])))
    return tuple(sorted(found, key=lambda one: -one.share))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Limit:
    """A bound of an angle or a speed: sign * (x[column] - bound) is to be at most the margin."""

    joint: int
    kind: LimitKind
    column: int
    sign: float
    bound: float
    margin: float

    def excess(self, x: Array) -> Array:
        """Return by how much angles and speeds (..., 2 n) are beyond the bound."""
        beyond: Array = self.sign * (x[..., self.column] - self.bound)
        return beyond


def _limits(problem: MotionProblem) -> list[_Limit]:
    """Return the finite limits of all joints; a speed has one in each direction."""
    n, found = problem.model.arm.n_joints, []
    for i, joint in enumerate(problem.task.arm.joints):
        speed = joint.motor.max_speed
        for kind, column, sign, bound, margin in (
                (LimitKind.LOWER_ANGLE, i, -1.0, joint.lower_limit, MARGIN),
                (LimitKind.UPPER_ANGLE, i, 1.0, joint.upper_limit, MARGIN),
                (LimitKind.SPEED, n + i, -1.0, -speed, MARGIN * speed),
                (LimitKind.SPEED, n + i, 1.0, speed, MARGIN * speed)):
            if math.isfinite(bound):
                found.append(_Limit(joint=i, kind=kind, column=column, sign=sign, bound=bound,
                                    margin=margin))
    return found


def _joint_motion(problem: MotionProblem, solution: CollocationSolution) -> CollocationSolution:
    """Return angles and speeds of the joints alone, 2 n unknowns."""
    n, n_t = problem.model.arm.n_joints, problem.model.arm.n_coordinates
    kept = np.r_[0:n, n_t:n_t + n]
    return replace(solution, nodes=solution.nodes[:, kept], stages=solution.stages[..., kept])


def _largest(solution: CollocationSolution, limit: _Limit, samples: Array) -> tuple[float, float]:
    """Return time and size of the largest excess, < 0 where the limit is kept."""
    beyond = limit.excess(samples)  # (N, k)
    k, i = np.unravel_index(int(beyond.argmax()), beyond.shape)
    center, step = float(solution.times_at(_POSITIONS)[k, i]), 1 / (_POSITIONS.size - 1)
    # between samples a motion rises by less than from one to the next
    if beyond[k, i] + np.abs(np.diff(beyond, axis=1)).max() < 0:
        return center, float(beyond[k, i])
    step *= float(solution.steps[k])
    for _ in range(_ZOOMS):
        near = np.clip(center + step * _AROUND, solution.mesh[0], solution.mesh[-1])
        values = limit.excess(solution(near))
        center, step = float(near[values.argmax()]), step * 2 / (_AROUND.size - 1)
    return center, float(values.max())
