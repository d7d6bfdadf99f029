"""Tasks that replace a plan while it is carried out."""

from __future__ import annotations

import copy
from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidTaskError, InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.ends_at_points import ends_at_points
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.ros.messages.classes import MotionTask, Point
from flex_planner.ros.messages.points import point_coordinates
from flex_planner.ros.settings.planner import PlannerSettings
import numpy as np

# what the plan that is replaced decides
_LEFT_OUT = (
    'start', 'start_positions', 'start_velocities', 'start_modal_displacements', 'via_times',
    'via_positions', 'via_points', 'payload_inertia', 'position_weights', 'velocity_weights',
    'max_torque_rate', 'max_joint_speeds', 'max_torque_shares', 'max_modal_rates',
    'stiffness_error', 'payload_error', 'max_residual', 'path_constraints')
_ONLY_WITH_REPLACES = 'keep_time', 'on_failure'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replacement:
    """
    What is asked of the plan that replaces another one.

    Attributes
    ----------
    goal : numpy.ndarray, shape (n,)
        Joint angles [rad].
    duration : float or None
        From its begin to the arrival; None for the arrival of the plan that is replaced [s].
    keep_time : bool
        Whether it must arrive then.
    torque_rate_weight : numpy.ndarray or None
        Price of the rates of torques; None for that of the plan that is replaced.
    stops : bool
        Whether the arm is to stop where no motion to the goal is found.

    """

    goal: Array
    duration: float | None
    keep_time: bool
    torque_rate_weight: Array | None
    stops: bool


def check_alone(message: MotionTask) -> None:
    """
    Refuse a task that replaces no plan, and says how.

    Raises
    ------
    InvalidTaskError
        If it does.

    """
    given = [name for name in _ONLY_WITH_REPLACES if getattr(message, name)]
    if given:
        raise InvalidTaskError(f'{given[0]} is given, but must be left out where replaces does '
                               'not name the plan that is carried out')


def replacement_from_message(message: MotionTask, running: Plan,
                             settings: PlannerSettings) -> Replacement:
    """
    Return what a task asks for that replaces a plan.

    Raises
    ------
    FlexPlannerError
        One of `ERROR_CODES`, naming field, value and bound.

    """
    _check(message, running.task)
    weight = np.asarray(message.torque_rate_weight)
    return Replacement(
        goal=_goal(message, running, settings), duration=message.duration or None,
        keep_time=bool(message.keep_time), stops=message.on_failure == MotionTask.STOP,
        torque_rate_weight=weight if weight.size else None)


def with_motion(message: MotionTask, task: Task) -> MotionTask:
    """Return a task that replaces a plan as a motion of its own, which says all of itself."""
    whole, n = copy.copy(message), task.arm.n_joints  # whose fields are replaced, not changed
    whole.space, whole.goal_point = MotionTask.JOINT, Point()
    for name in ('start_positions', 'goal_positions', 'start_velocities',
                 'start_modal_displacements', 'effort_weights', 'position_weights',
                 'velocity_weights', 'torque_rate_weight'):
        setattr(whole, name, getattr(task, name).tolist())
    if not task.arm.n_passive:
        whole.start_velocities = task.start_velocities[:n].tolist()
    for name in ('duration', 'payload_mass', 'payload_inertia', 'tolerance'):
        setattr(whole, name, float(getattr(task, name)))
    whole.allow_large_bending = task.allow_large_bending
    return whole


def _check(message: MotionTask, running: Task) -> None:
    """Refuse what contradicts the plan that is replaced, or is none of the constants."""
    given = [name for name in _LEFT_OUT if _is_given(getattr(message, name))]
    if given or message.kind > 1:
        raise InvalidTaskError(f'{(given or ["kind"])[0]} is given, but must be left out where '
                               'replaces names a plan, which decides it')
    if message.space not in (MotionTask.JOINT, MotionTask.CARTESIAN_GOAL):
        raise InvalidValueError('space', message.space, '0 (JOINT) or 2 (CARTESIAN_GOAL) where '
                                'replaces names a plan, on which the motion begins')
    if message.on_failure not in (MotionTask.GO_ON, MotionTask.STOP):
        raise InvalidValueError('on_failure', message.on_failure, '0 (GO_ON) or 1 (STOP)')
    weights = np.asarray(message.effort_weights)
    if weights.size and not np.array_equal(weights, running.effort_weights):
        raise InvalidValueError('effort_weights', message.effort_weights, 'empty or those of '
                                f'the plan that is replaced, {running.effort_weights.tolist()}')
    if message.payload_mass not in (0.0, running.payload_mass):
        raise InvalidValueError('payload_mass', message.payload_mass, '0 or that of the plan '
                                f'that is replaced, {running.payload_mass:g} kg')


def _is_given(value: object) -> bool:
    """Return whether a field of a message is not what it is by default."""
    return bool(len(value)) if hasattr(value, '__len__') else bool(value)


def _goal(message: MotionTask, running: Plan, settings: PlannerSettings) -> Array:
    """Return the joint angles of the goal, also those of the bent arm with its tip at a point."""
    if message.space == MotionTask.JOINT:
        return np.asarray(message.goal_positions, dtype=float)
    if message.elbow not in (-1, 0, 1):
        raise InvalidValueError('elbow', message.elbow, '-1, +1, or 0 for the default')
    arm: Arm = running.arm
    ends = ends_at_points(arm, None, point_coordinates(message.goal_point, arm),
                          message.elbow or settings.elbow, running.problem.goal[:arm.n_joints])
    if not arm.bends_at_rest:
        goal: Array = ends['goal_positions']
        return goal
    task = Task(arm=arm, start_positions=running.problem.goal[:arm.n_joints], duration=1.0,
                payload_mass=running.task.payload_mass,
                payload_inertia=running.task.payload_inertia, **ends)
    return MotionProblem(running.model, task, running.problem.parameters).goal[:arm.n_joints]
