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
from flex_planner.optimal_control.torque_conditions import torque_conditions, TorqueState
from flex_planner.optimal_control.torque_ends import TorqueEnds
from flex_planner.optimal_control.via_conditions import ViaConditions
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]

# of the highest natural frequency; an exact solution takes two or three times as many
_POINTS_PER_CYCLE = 5.0


class MotionProblem:
    """
    The optimality conditions of a task.

    The unknowns are z = (q, q', psi_1, psi_2), 4 n_t of them, followed by the torques and their
    costates where the task asks for their rates; `BoundaryConditions` says what holds at both
    ends.

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
    conditions : TorqueConditions
        The rates of the unknowns, and how the torque comes about.
    layout : StateLayout
        Where states and costates stand among the unknowns.
    torque_ends : TorqueEnds or None
        Conditions of the torques at both ends, where they are states.
    explicit : numpy.ndarray of int
        Unknowns whose rates the collocation need not factorise.
    via : ViaConditions
        Via points, and when they are passed.
    holds : bool
        Whether to refuse a goal that the motors cannot hold; without, the problem only stands for
        a task that is refused.
    via_times : numpy.ndarray, shape (K,), optional
        When the via points are passed; free times are guessed if it is not given [s].
    ends : BoundaryConditions, optional
        Of another problem with the same ends, which need not be found again.

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
                 holds: bool = True, via_times: Array | None = None,
                 ends: BoundaryConditions | None = None) -> None:
        self.model, self.task, self.parameters = model, task, parameters
        self.p = parameters.stack()
        self.conditions = torque_conditions(model, task, parameters)
        self.layout = self.conditions.layout
        self.size = self.layout.size
        self.ends = ends or BoundaryConditions(model, task, parameters, holds=holds)
        self.start, self.goal = self.ends.start, self.ends.goal
        self.goal_weights = self.ends.goal_weights
        self.holding_torque = self.ends.holding_torque
        self.torque_ends = self._hold_ends() if self.layout.torques else None
        self.scale = self._scale()
        self.explicit: Indices = self.layout.explicit
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
        return self.conditions.rate(z)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian."""
        return self.conditions.rate_jacobian(z)

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code, None without a compiler."""
        return self.conditions.compiled_rate()

    def controls(self, t: Array, z: Array) -> Controls:
        """Return torque, cost and Hamiltonian at times (k,) and points (k, m)."""
        return self.conditions.controls(z)

    def hamiltonian_rate(self, t: Array, z: Array) -> Array:
        """Return dH/dt of an extremal at times (k,) and points (k, m), shape (k,): zero."""
        return np.zeros(len(t))

    def switches(self, t: Array, z: Array, p: Array | None = None) -> Array:
        """Return functions (k, e) that change their signs where the conditions bend."""
        return self.conditions.switches(z, p)

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions of eq. (16)."""
        inner = self.ends.left(z[:4 * self.layout.coordinates])
        return inner if self.torque_ends is None else self.torque_ends.add_left(z, *inner)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions of eq. (16), or transversality of eq. (6)."""
        inner = self.ends.right(z[:4 * self.layout.coordinates])
        return inner if self.torque_ends is None else self.torque_ends.add_right(z, *inner)

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
        return MotionProblem(self.model, self.task, self.parameters, via_times=times,
                             ends=self.ends)

    def fewest_intervals(self, stages: int) -> int:
        """Return the intervals of a mesh that resolves nothing finely but overlooks nothing."""
        rates, _ = natural_modes(self.model, self.start[:self.layout.coordinates], self.parameters,
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
        if self.torque_ends is not None:
            nodes[:, self.layout.torque_slice] = self.torque_ends.between(mesh / mesh[-1])
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
        Return the magnitude of each unknown that matters, shape (m,).

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
                                       velocity_costates / duration, velocity_costates,
                                       *self._torque_scales(inertia[:n])]) / 10
        return scale

    def _torque_scales(self, torque: Array) -> tuple[Array, ...]:
        """Return what torques and their costates come to, where they are states."""
        if not isinstance(self.conditions, TorqueState):
            return ()
        return torque, self.conditions.weights * torque / self.task.duration

    def _hold_ends(self) -> TorqueEnds:
        """Return the torques that hold the arm at ends where it rests."""
        at_rest = self.task.starts_at_rest, self.task.ends_at_rest
        n_t, n = self.layout.coordinates, self.layout.torques
        held = [self.model.static_forces(state[None, :n_t], self.parameters.physical)[0][0, :n]
                if rests else np.zeros(0)
                for state, rests in zip((self.start, self.goal), at_rest, strict=True)]
        return TorqueEnds(layout=self.layout, start=held[0], goal=held[1])


def task_parameters(task: Task) -> Parameters:
    """Return the parameters that a task and its arm determine."""
    return Parameters.of(task.arm, payload_mass=task.payload_mass,
                         payload_inertia=task.payload_inertia,
                         effort_weights=task.effort_weights,
                         position_weights=task.position_weights,
                         velocity_weights=task.velocity_weights)
