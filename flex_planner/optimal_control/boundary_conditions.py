"""States at both ends of a motion: eq. (16), the terminal cost of eq. (6), and how they bend."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint_units import units_of
from flex_planner.base.errors import (
    HoldingError,
    NoEquilibriumError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.validation import Array
from flex_planner.dynamics.rest_at_point import rest_at_point
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
import numpy as np

# of a payload, for differences [kg]
_NUDGE = 1e-4


class BoundaryConditions:
    """
    Boundary rows of the optimality conditions of a task.

    The state is given at the start. At the goal each coordinate and rate is either given,
    eq. (16), or weighs in the cost by the terminal term of eq. (6), whose derivative is its
    costate there (transversality).

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    task : Task
        Start and goal.
    parameters : Parameters
        Payload, stiffness and limits.
    holds : bool
        Whether to refuse a goal that the motors cannot hold.

    Attributes
    ----------
    start, goal : numpy.ndarray, shape (2 n_t,)
        States at both ends: bent as gravity bends the arm at rest, its tip at the point where one
        is given, or at the start as the task says.
    goal_weights : numpy.ndarray, shape (2 n_t,)
        Diagonals of W_p and W_v of eq. (6); infinite where the goal must be met.
    holding_torque : numpy.ndarray, shape (n,)
        Holds the arm at the goal [N m].

    Raises
    ------
    HoldingError
        If a motor is too weak to hold the arm at a goal where it comes to rest.
    UnreachableError, SingularError
        If the bent arm cannot rest at a point; the message says which.

    """

    def __init__(self, model: ArmModel, task: Task, parameters: Parameters, *,
                 holds: bool = True) -> None:
        n_t = model.arm.n_coordinates
        self.start = _start_state(model, task, parameters)
        goal, self.holding_torque = rest_at_end(model, task, 'goal', parameters)
        if holds and task.ends_at_rest:
            _check_holding(self.holding_torque, parameters, model.arm)
        self.goal = np.concatenate([goal, task.goal_velocities])
        self.goal_weights = np.concatenate([task.goal_position_weights,
                                            task.goal_velocity_weights])
        self._left_rows = np.eye(2 * n_t, 4 * n_t)
        self._right_rows = _transversality(self.goal_weights)

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions of eq. (16) and their rows."""
        return z[:self.start.size] - self.start, self._left_rows

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions of eq. (16), or transversality of eq. (6), and rows."""
        half = self.goal.size
        miss = np.concatenate([z[:half] - self.goal, z[half:]])
        residual: Array = self._right_rows @ miss
        return residual, self._right_rows

    def target_state(self, end: Array) -> Array:
        """Return the state (2 n_t,) that a motion ending in `end` is to reach."""
        return np.where(np.isinf(self.goal_weights), self.goal, end)


def _start_state(model: ArmModel, task: Task, parameters: Parameters) -> Array:
    """Return the state (2 n_t,) at the start."""
    if task.start_modal_displacements.size:
        coordinates = np.concatenate([task.start_positions, task.start_modal_displacements])
    else:
        coordinates, _ = rest_at_end(model, task, 'start', parameters)
    return np.concatenate([coordinates, task.start_velocities])


def rest_at_end(model: ArmModel, task: Task, end: str, parameters: Parameters,
                near: Array | None = None) -> tuple[Array, Array]:
    """
    Return the coordinates (n_t,) of the arm at rest at 'start' or 'goal', and what holds it.

    Those at rest with about that payload may help to find them.

    """
    positions, point = getattr(task, f'{end}_positions'), getattr(task, f'{end}_point')
    if not point.size:
        return equilibrium(model, positions, parameters)
    try:
        return rest_at_point(model, task.arm, point, positions, parameters, near)
    except (UnreachableError, SingularError) as error:
        raise type(error)(f'{end}_point: {error}') from None


def _transversality(weights: Array) -> Array:
    """Return the rows of ``x - goal = 0``, or of ``psi - W (x - goal) = 0`` for finite W."""
    given = np.isinf(weights)
    states = np.where(given, 1.0, -np.where(given, 0.0, weights))
    return np.hstack([np.diag(states), np.diag(np.where(given, 0.0, 1.0))])


def _check_holding(torque: Array, parameters: Parameters, arm: Arm) -> None:
    """Refuse a goal at which the arm would sink as soon as it has arrived."""
    most = parameters.torque_limits.standstill
    for i, (needed, stall) in enumerate(zip(torque, most, strict=True)):
        if abs(needed) > stall:
            raise HoldingError(i, float(needed), float(stall), units_of(arm.joints[i]).torque)


class PayloadEnds:
    """
    States at both ends, and how they change with the payload.

    Parameters
    ----------
    model, task, parameters
        As of `BoundaryConditions`.
    conditions : BoundaryConditions
        With the payload of the task.

    """

    def __init__(self, model: ArmModel, task: Task, parameters: Parameters,
                 conditions: BoundaryConditions) -> None:
        self._model, self._task, self._parameters = model, task, parameters
        self._given = conditions.start, conditions.goal
        bends = task.arm.bends_at_rest
        self._bent = bends and not task.start_modal_displacements.size, bends
        # that were found last, from which others are found soon
        self._near: list[Array | None] = [None, None]
        # for the same payload the same to the last digit, wherever the search for rest began
        self._last: list[tuple[float, tuple[Array, Array, Array]] | None] = [None, None]

    def at(self, end: int, payload: float) -> tuple[Array, Array, Array]:
        """
        Return the state at the start (0) or the goal (1), and two derivatives by the payload.

        Shape (2 n_t,) each; the second one is as exact as Newton's method needs it, 1e-4.

        Raises
        ------
        NoEquilibriumError
            If the arm does not come to rest with that payload, or a little more or less, or not
            at its point.

        """
        given = self._given[end]
        if not self._bent[end]:
            return given, np.zeros_like(given), np.zeros_like(given)
        last = self._last[end]
        if last is None or last[0] != payload:
            here, less, more = (self._state(end, payload + change)
                                for change in (0.0, -_NUDGE, _NUDGE))
            last = payload, (here, (more - less) / (2 * _NUDGE),
                             (more - 2 * here + less) / _NUDGE**2)
            self._last[end] = last
        return last[1]

    def _state(self, end: int, payload: float) -> Array:
        parameters = replace(self._parameters, payload_mass=payload)
        name, velocities = (('start', self._task.start_velocities),
                            ('goal', self._task.goal_velocities))[end]
        try:
            coordinates, _ = rest_at_end(self._model, self._task, name, parameters,
                                         self._near[end])
        except (SingularError, UnreachableError) as error:
            raise NoEquilibriumError(str(error)) from None
        self._near[end] = coordinates
        return np.concatenate([coordinates, velocities])
