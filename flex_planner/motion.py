"""A task as a boundary-value problem: eqs. (11), (12), (14)-(16) for the collocation solver."""

from __future__ import annotations

from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.errors import InvalidTaskError
from flex_planner.model import ArmModel, Parameters
from flex_planner.statics import equilibrium
from flex_planner.task import Task
from flex_planner.validation import Array
import numpy as np


class MotionProblem:
    """
    The optimality conditions of a task.

    The unknowns are z = (q, q', psi_1, psi_2), 4 n_t of them; q and q' are given at both ends.

    Parameters
    ----------
    model : ArmModel
        Of the task's arm, or of the same arm made rigid.
    task : Task
        Start, goal, duration, payload.
    parameters : Parameters
        Weights and limits, see :func:`task_parameters`.

    Attributes
    ----------
    start, goal : numpy.ndarray, shape (2 n_t,)
        States at both ends: at rest, bent as gravity bends the arm.
    holding_torque : numpy.ndarray, shape (n,)
        Holds the arm at the goal [N m].
    p : numpy.ndarray
        Stacked parameters.

    Raises
    ------
    InvalidTaskError
        If a motor is too weak to hold the arm at the goal.

    """

    def __init__(self, model: ArmModel, task: Task, parameters: Parameters) -> None:
        self.model, self.task, self.parameters = model, task, parameters
        self.p = parameters.stacked()
        n_t = model.arm.n_coordinates
        self.size = 4 * n_t
        start, _ = equilibrium(model, task.start_positions, parameters)
        goal, self.holding_torque = equilibrium(model, task.goal_positions, parameters)
        _check_holding(self.holding_torque, parameters)
        self.start = np.concatenate([start, np.zeros(n_t)])
        self.goal = np.concatenate([goal, np.zeros(n_t)])
        self.scale = self._scale()
        self._rows = np.eye(2 * n_t, 4 * n_t)

    def rate(self, t: Array, z: Array) -> Array:
        """Return z'; the problem does not depend on time."""
        return self.model.optimality(z, self.p)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian."""
        return self.model.optimality_jacobian(z, self.p)

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions of eq. (16)."""
        return z[:self.start.size] - self.start, self._rows

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions of eq. (16)."""
        return z[:self.goal.size] - self.goal, self._rows

    def straight_line(self, intervals: int, rule: GaussRule) -> CollocationSolution:
        """Return constant velocity from start to goal with zero costates, as a guess."""
        n_t = self.model.arm.n_coordinates
        mesh = np.linspace(0, self.task.duration, intervals + 1, dtype=np.float64)
        nodes = np.zeros((intervals + 1, self.size))
        change = self.goal[:n_t] - self.start[:n_t]
        nodes[:, :n_t] = self.start[:n_t] + np.outer(mesh / self.task.duration, change)
        nodes[:, n_t:2 * n_t] = change / self.task.duration
        return CollocationSolution.from_values(mesh, nodes, rule)

    def _scale(self) -> Array:
        """
        Return the magnitude of each unknown that matters, shape (4 n_t,).

        A tenth of what a motion with constant acceleration, then deceleration would need: its
        torque gives the costates through u = -R^-1 B^T M^-1 psi_2, its inertia forces the
        bending.

        """
        arm, duration = self.model.arm, self.task.duration
        n = arm.n_joints
        travel = np.maximum(np.abs(self.goal - self.start)[:n], 0.1)
        mass = self.model.mass_and_energy(self.start[None], self.p)[0][0]
        inertia = np.abs(mass[:, :n]) @ (4 * travel / duration**2)
        bend = np.zeros(0)
        if arm.n_modes:
            coordinates = self.start[None, :arm.n_coordinates]
            stiffness = self.model.static_forces(coordinates, self.p)[1][0, n:, n:]
            bend = np.maximum(np.abs(np.linalg.solve(stiffness, inertia[n:])), 1e-9 * arm.reach)
        positions = np.concatenate([travel, bend])
        velocity_costates = np.abs(mass[:, :n]) @ (self.parameters.effort_weights * inertia[:n])
        scale: Array = np.concatenate([positions, positions / duration,
                                       velocity_costates / duration, velocity_costates]) / 10
        return scale


def _check_holding(torque: Array, parameters: Parameters) -> None:
    """Refuse a goal at which the arm would sink as soon as it has arrived."""
    for i, (needed, stall) in enumerate(zip(torque, parameters.stall_torque, strict=True), 1):
        if abs(needed) > stall:
            raise InvalidTaskError(
                f'joint {i} needs {abs(needed):.4g} N m to hold the arm with its payload at the '
                f'goal, but the stall torque of its motor is {stall:.4g} N m')


def task_parameters(task: Task) -> Parameters:
    """Return the parameters that a task and its arm determine."""
    return Parameters.of(task.arm, payload_mass=task.payload_mass,
                         payload_inertia=task.payload_inertia,
                         effort_weights=task.effort_weights,
                         position_weights=task.position_weights,
                         velocity_weights=task.velocity_weights)
