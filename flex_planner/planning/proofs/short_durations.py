"""
Durations that are out of all proportion to the motion, told before anything is solved.

Other than the bounds of `duration_bounds` these are no proofs of the arm as it is.

"""

from __future__ import annotations

from functools import lru_cache

from flex_planner.arms.arm import Arm
from flex_planner.arms.spatial_joint import slides
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION, MAX_VELOCITY
from flex_planner.planning.kinds.paths import JointPath
from flex_planner.planning.proofs.duration_bounds import bound_by_energy, bound_by_power
from flex_planner.planning.proofs.motion_facts import knows_bounds, MotionFacts
from flex_planner.planning.strategies.initial_guesses import rigid_problem
import numpy as np

# by so much the links may bend to make an arm faster than it is when they are rigid
_FASTER = 3.0
# a first guess of a shortest duration, in units of what is known to be too short
_LEAST_GUESS, _LONGEST_GUESS = 3.0, 30.0
_SAMPLES = 41


def check_duration(problem: MotionProblem) -> None:
    """
    Refuse a task whose joints would have to be faster than any speed that a task may have.

    Raises
    ------
    InvalidTaskError
        Naming the duration, its bound and the joint.

    """
    if problem.task.time_weight:  # it is only a guess
        return
    strokes = _strokes(problem)
    joint, asked = int(strokes.argmax()), problem.task.duration
    least = float(strokes[joint]) / MAX_VELOCITY
    if asked < least:
        unit = 'm' if slides(problem.task.arm.joints[joint]) else 'rad'
        raise InvalidTaskError(
            f'duration is {asked:g} s, but must be at least {least:.4g} s: joint {joint + 1} '
            f'moves by {strokes[joint]:.4g} {unit}, and at {MAX_VELOCITY:g} {unit}/s at most')


def find_doubt(problem: MotionProblem) -> str | None:
    """Return why a motion of an arm that bends is not worth looking for; None if it is."""
    if not problem.model.arm.n_passive or problem.task.time_weight:
        return None
    asked = problem.task.duration
    if _moves_evenly(problem, _FASTER * asked):  # then no bound is above that
        return None
    needed = rigid_bound(problem)
    if asked * _FASTER >= needed:
        return None
    joints = ' and joints' if problem.model.arm.elastic_joints else ''
    return (f'not looked for: with rigid links{joints} the motion takes at least {needed:.4g} s, '
            f'which is proved, and bending does not make an arm {_FASTER:g} times as fast, which '
            f'is not; {asked:g} s were asked for')


def _moves_evenly(problem: MotionProblem, duration: float) -> bool:
    """
    Return whether the arm made rigid can do a motion of a simple shape in a duration.

    All joints follow a straight `JointPath`, which begins and ends at rest; where the task does
    not, this says no.

    """
    task, n = problem.task, problem.task.arm.n_joints
    if (np.any(task.start_velocities) or np.any(task.goal_velocities)
            or not np.isinf(problem.goal_weights).all()):
        return False
    path = JointPath(problem.start[:n], problem.goal[:n], np.zeros((0, n)))
    positions, speeds, accelerations = path(
        np.linspace(0.0, 1.0, _SAMPLES, dtype=np.float64), duration)
    parameters = problem.parameters.drop_modes()
    torques = _rigid_model(task.arm).inverse_dynamics(
        np.hstack([positions, speeds]), accelerations, parameters.physical)
    lower, upper = parameters.torque_limits.bounds(speeds)
    return bool((lower <= torques).all() and (torques <= upper).all())


@lru_cache(maxsize=16)
def _rigid_model(arm: Arm) -> ArmModel:
    """Return the functions of an arm made rigid; those of the last arms are kept."""
    return ArmModel.of(arm.rigid())


def rigid_bound(problem: MotionProblem) -> float:
    """Return a duration [s] that the arm made rigid does not undercut; 0 if none is proved."""
    try:
        rigid = problem if not problem.model.arm.n_passive else rigid_problem(problem)
    except InvalidTaskError:  # motors that hold the bent arm may be too weak for the straight one
        return 0.0
    if not knows_bounds(rigid.task.arm):
        return 0.0
    facts = MotionFacts(rigid)
    return max(bound(facts).seconds for bound in (bound_by_power, bound_by_energy))


def guess_duration(problem: MotionProblem) -> float:
    """Return a duration [s] near that of a task with which a search may begin."""
    given, least = problem.task.duration, float(_strokes(problem).max()) / MAX_VELOCITY
    needed = rigid_bound(problem)
    if given < needed or given > _LONGEST_GUESS * needed > 0:
        given = _LEAST_GUESS * needed
    return float(min(max(given, least), MAX_DURATION))


def _strokes(problem: MotionProblem) -> Array:
    """Return by how much each joint must turn, (n,) [rad]."""
    n = problem.model.arm.n_joints
    hard = np.isinf(problem.goal_weights[:n])
    found: Array = np.where(
        hard, np.abs(problem.goal - problem.start)[:n], 0.0)
    return found
