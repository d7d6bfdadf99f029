"""A task as a boundary-value problem: eqs. (11), (12), (14)-(16) for the collocation solver."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.collocation.junctions import double_nodes
from flex_planner.collocation.problem import CompiledRate
from flex_planner.dynamics.statics import check_inertia, natural_modes
from flex_planner.optimal_control.arm_model import ArmModel, Controls
from flex_planner.optimal_control.boundary_conditions import BoundaryConditions
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_conditions import ViaConditions
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]

# of the highest natural frequency; an exact solution takes two or three times as many
_POINTS_PER_CYCLE = 5.0


class MotionProblem:
    """
    The optimality conditions of a task.

    The unknowns are z = (q, q', psi_1, psi_2), 4 n_t of them; `BoundaryConditions` says what holds
    at both ends.

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
    ends : BoundaryConditions
        Rows at both ends.
    start, goal, goal_weights, holding_torque : numpy.ndarray
        Of `ends`.
    p : numpy.ndarray
        Stacked parameters.
    explicit : numpy.ndarray of int
        q and psi_1, whose rates the collocation need not factorise.

    via : ViaConditions
        Via points, and when they are passed.
    holds : bool
        Whether to refuse a goal that the motors cannot hold; without, the problem only stands for
        a task that is refused.
    via_times : numpy.ndarray, shape (K,), optional
        When the via points are passed; free times are guessed if it is not given [s].

    Raises
    ------
    HoldingError
        If a motor is too weak to hold the arm at a goal where it comes to rest.
    UnreachableError, SingularError
        If the bent arm cannot rest at a point; the message says which.
    InvalidTaskError
        See `check_inertia`.

    """

    def __init__(self, model: ArmModel, task: Task, parameters: Parameters, *,
                 holds: bool = True, via_times: Array | None = None) -> None:
        self.model, self.task, self.parameters = model, task, parameters
        self.p = parameters.stack()
        n_t = model.arm.n_coordinates
        self.size = 4 * n_t
        self.ends = BoundaryConditions(model, task, parameters, holds=holds)
        self.start, self.goal = self.ends.start, self.ends.goal
        self.goal_weights = self.ends.goal_weights
        self.holding_torque = self.ends.holding_torque
        self.scale = self._scale()
        self.explicit: Indices = np.r_[0:n_t, 2 * n_t:3 * n_t]
        n = model.arm.n_joints
        self.via = ViaConditions.of(model.arm, task.via_points, (self.start[:n], self.goal[:n]),
                                    task.duration, self.scale, via_times)

    @property
    def junctions(self) -> Array:
        """Return the times of the via points, shape (K,)."""
        return self.via.times

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point, see `ViaConditions.join`."""
        return self.via.join(junction, before, after)

    def rate(self, t: Array, z: Array) -> Array:
        """Return z'; the problem does not depend on time."""
        return self.model.optimality(z, self.p)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian."""
        return self.model.optimality_jacobian(z, self.p)

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code, None without a compiler."""
        return self.model.compiled_rate('optimality', self.p)

    def controls(self, t: Array, z: Array) -> Controls:
        """Return torque, cost and Hamiltonian at times (k,) and points (k, 4 n_t)."""
        return self.model.controls(z, self.p)

    def hamiltonian_rate(self, t: Array, z: Array) -> Array:
        """Return dH/dt of an extremal at times (k,) and points (k, 4 n_t), shape (k,): zero."""
        return np.zeros(len(t))

    def switches(self, t: Array, z: Array, p: Array | None = None) -> Array:
        """Return the distances of the unbounded torque from its bounds, 2 n columns or more."""
        free = (self.controls(t, z) if p is None else self.model.controls(z, p)).free_torque
        n_t, n = self.model.arm.n_coordinates, self.model.arm.n_joints
        return np.hstack(self.parameters.torque_limits.distances(free, z[:, n_t:n_t + n]))

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions of eq. (16)."""
        return self.ends.left(z)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions of eq. (16), or transversality of eq. (6)."""
        return self.ends.right(z)

    def barrier_rate(self, z: Array) -> Array:
        """Return what a barrier adds to L and H, shape (k,): nothing here."""
        return np.zeros(len(z))

    def target_state(self, end: Array) -> Array:
        """Return the state (2 n_t,) that a motion ending in `end` is to reach."""
        return self.ends.target_state(end)

    def with_changes(self, **changes: Any) -> MotionProblem:
        """Return the problem of the same task changed in payload, duration or limits."""
        task = replace(self.task, **changes)
        parameters = replace(self.parameters, payload_mass=task.payload_mass)
        times = self.via.times * (task.duration / self.task.duration)
        return MotionProblem(self.model, task, parameters, via_times=np.where(
            self.via.given, self.via.times, times) if times.size else None)

    def with_via_times(self, times: Array) -> MotionProblem:
        """Return the same problem with its via points passed at other times (K,) [s]."""
        return MotionProblem(self.model, self.task, self.parameters, via_times=times)

    def fewest_intervals(self, stages: int) -> int:
        """Return the intervals of a mesh that resolves nothing finely but overlooks nothing."""
        rates, _ = natural_modes(self.model, self.start[:self.size // 4], self.parameters,
                                 locked=False)
        cycles = float(np.nan_to_num(rates).max()) * self.task.duration / (2 * np.pi)
        return int(np.ceil(_POINTS_PER_CYCLE * cycles / stages))

    def straight_line(self, intervals: int, rule: GaussRule) -> CollocationSolution:
        """
        Return constant velocity from start to goal with zero costates, as a guess.

        Joints go from one via point to the next in the same way.

        """
        n_t = self.model.arm.n_coordinates
        mesh = np.linspace(0, self.task.duration, intervals + 1, dtype=np.float64)
        nodes = np.zeros((intervals + 1, self.size))
        change = self.goal[:n_t] - self.start[:n_t]
        nodes[:, :n_t] = self.start[:n_t] + np.outer(mesh / self.task.duration, change)
        nodes[:, n_t:2 * n_t] = change / self.task.duration
        if not self.junctions.size:
            return CollocationSolution.from_values(mesh, nodes, rule)
        return self._pass_via_points(CollocationSolution.from_values(mesh, nodes, rule))

    def _pass_via_points(self, straight: CollocationSolution) -> CollocationSolution:
        """Return a straight line bent so that joints pass their via points."""
        n, duration = self.model.arm.n_joints, self.task.duration
        n_t = self.model.arm.n_coordinates
        mesh = double_nodes(straight.mesh, self.junctions)
        nodes = straight(mesh)
        times = np.concatenate([[0.0], self.junctions, [duration]])
        way = np.vstack([self.start[:n], self.via.postures, self.goal[:n]])
        slopes = np.diff(way, axis=0) / np.diff(times)[:, None]
        phase = np.clip(np.searchsorted(times, mesh, side='right') - 1, 0, times.size - 2)
        phase[:-1][np.diff(mesh) == 0] -= 1
        nodes[:, :n] = way[phase] + (mesh - times[phase])[:, None] * slopes[phase]
        nodes[:, n_t:n_t + n] = slopes[phase]
        return CollocationSolution.from_values(mesh, nodes, straight.rule)

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
        mass = self.model.mass_and_energy(self.start[None], self.parameters.physical)[0][0]
        check_inertia(mass)
        inertia = np.abs(mass[:, :n]) @ (4 * travel / duration**2)
        bend = np.zeros(0)
        if arm.n_passive:
            coordinates = self.start[None, :arm.n_coordinates]
            stiffness = self.model.static_forces(coordinates, self.parameters.physical)[1][0, n:,
                                                                                           n:]
            bend = np.maximum(np.abs(np.linalg.solve(stiffness, inertia[n:])), 1e-9 * arm.reach)
        positions = np.concatenate([travel, bend])
        velocity_costates = np.abs(mass[:, :n]) @ (self.parameters.effort_weights * inertia[:n])
        scale: Array = np.concatenate([positions, positions / duration,
                                       velocity_costates / duration, velocity_costates]) / 10
        return scale


def task_parameters(task: Task) -> Parameters:
    """Return the parameters that a task and its arm determine."""
    return Parameters.of(task.arm, payload_mass=task.payload_mass,
                         payload_inertia=task.payload_inertia,
                         effort_weights=task.effort_weights,
                         position_weights=task.position_weights,
                         velocity_weights=task.velocity_weights)
