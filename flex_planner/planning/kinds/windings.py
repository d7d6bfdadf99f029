"""Other ways round to a point: its posture with a joint turned by a full turn."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.spatial_joint import slides
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np

# longest stroke of a joint on another way round [rad]
_LONGEST = np.deg2rad(270.0)


def other_windings(problem: MotionProblem) -> list[MotionProblem]:
    """
    Return the problems of the same point with a joint turned by a full turn.

    Parameters
    ----------
    problem : MotionProblem
        Of a task whose goal is a point; where it is joint angles there is no other way.

    Returns
    -------
    list of MotionProblem
        Within the limits of the joints, and with strokes of 270 degrees at most.

    """
    task, n = problem.task, problem.model.arm.n_joints
    if not task.must_reach_point:
        return []
    start, goal = problem.start[:n], problem.goal[:n]
    lower, upper = problem.model.arm.angle_limits()
    found = []
    turns = np.eye(n)[[not slides(joint) for joint in task.arm.joints]]
    for turn in np.vstack([turns, -turns]) * 2 * np.pi:
        turned = goal + turn
        if (np.abs(turned - start).max() <= _LONGEST and (turned >= lower).all()
                and (turned <= upper).all()):
            found += _turned(problem, turn)
    return found


def turn_goal(problem: MotionProblem, like: MotionProblem) -> MotionProblem:
    """Return a problem with the posture at the goal that another one has."""
    task = replace(problem.task, goal_positions=like.task.goal_positions)
    return MotionProblem(problem.model, task, problem.parameters)


def say_turns(problem: MotionProblem, other: MotionProblem) -> str:
    """Return which joints come to the goal of another problem the other way round."""
    turns = np.round((other.task.goal_positions - problem.task.goal_positions) / (2 * np.pi))
    return '; '.join(f'joint {i} goes the other way round' for i, turn in enumerate(turns, 1)
                     if turn)


def _turned(problem: MotionProblem, turn: Array) -> list[MotionProblem]:
    """Return the problem with its goal turned, or none where that is no task."""
    try:
        task = replace(problem.task, goal_positions=problem.task.goal_positions + turn)
        return [MotionProblem(problem.model, task, problem.parameters)]
    except FlexPlannerError:  # beyond what a task may have
        return []
