"""The unknowns of the programme of one arm on one mesh: guesses, bounds, and what they mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.mesh import Mesh
from flex_planner.optimal_control.direct.point_layout import PointLayout, TorqueRates
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

# from times (k,) to z (k, 4 n_t), with (tau, psi_tau) after it where torques have rates, and to q,
# q', q'' (k, n_t) each
Guess = Callable[[Array], Array]
Path = Callable[[Array], tuple[Array, Array, Array]]

# of the stall torque: how near to it the torques of a guess may be
_INSIDE = 0.95
# a free duration stays within these multiples of the guess
_SHORTEST, _LONGEST = 0.02, 50.0


class Free(Enum):
    """What is free besides the motion; the value is shown to people."""

    NOTHING = 'motion'
    PAYLOAD = 'payload'
    DURATION = 'duration'


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """
    The unknowns of an arm's programme: y at the points, x at nodes, the payload, the duration.

    Attributes
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    mesh : Mesh
        K points.
    rates : TorqueRates or None
        Of torques that are states.

    """

    model: ArmModel
    mesh: Mesh
    rates: TorqueRates | None = None

    @property
    def layout(self) -> PointLayout:
        """Return the order of the unknowns of a point."""
        arm = self.model.arm
        return PointLayout(arm.n_coordinates, arm.n_joints, self.rates is not None)

    @property
    def _outer_nodes(self) -> Array:
        """Return the times, from 0 to 1, of the nodes that are no points."""
        nodes: Array = self.mesh.breaks[self.mesh.nodes >= self.mesh.points.size]
        return nodes

    def bounds(self, parameters: Parameters, duration: float, free: Free,
               most_payload: float = MAX_PAYLOAD) -> tuple[Array, Array]:
        """Return bounds: of those at points, w = u + K_2 q' alone has some."""
        layout, K = self.layout, self.mesh.points.size
        upper = np.full((K, layout.size), np.inf)
        upper[:, layout.drives] = parameters.stall_torque
        others = np.full(self._outer_nodes.size * layout.states, np.inf)
        both = np.concatenate([upper.ravel(), others])
        payload, time = [parameters.payload_mass] * 2, [duration, duration]
        if free is Free.PAYLOAD:
            payload = [0.0, most_payload]
        if free is Free.DURATION:
            time = [_SHORTEST * duration, _LONGEST * duration]
        return (np.concatenate([-both, [payload[0], time[0]]]),
                np.concatenate([both, [payload[1], time[1]]]))

    def rows(self, parameters: Parameters) -> tuple[Array, Array]:
        """Return bounds of the rows: 0 for equations, caps of motors and bounds of rates."""
        arm, K = self.model.arm, self.mesh.points.size
        equations = np.zeros(self.mesh.P.shape[0] * self.layout.states + K * arm.n_coordinates)
        caps = np.tile(np.concatenate([
            parameters.max_torque[TorqueLimits.of(arm).capped],
            np.zeros(0) if self.rates is None else self.rates.bounds]), K)
        return np.concatenate([equations, -caps]), np.concatenate([equations, caps])

    def on_motion(self, guess: Guess, parameters: Parameters, duration: float) -> Array:
        """Return the unknowns on a motion with costates."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        z, at_nodes = (guess(duration * times) for times in (self.mesh.points, self._outer_nodes))
        torque, acceleration = self._move(z, parameters)
        states, slope = z[:, :2 * n_t], parameters.torque_slope
        y = self.layout.join(
            states, acceleration, torque + slope * z[:, n_t:n_t + n],
            self._torque_rates(z) + slope * acceleration[:, :n])
        nodes = at_nodes[:, :2 * n_t]
        if self.rates is not None:
            drives = self._move(at_nodes, parameters)[0] + slope * at_nodes[:, n_t:n_t + n]
            nodes = np.hstack([nodes, drives])
        return self._join(y, nodes, parameters, duration)

    def _move(self, z: Array, parameters: Parameters) -> tuple[Array, Array]:
        """Return torques (k, n) and accelerations (k, n_t) of a motion with costates."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        if self.rates is None:
            control = self.model.controls(z, parameters.stack())
            return control.torque, control.acceleration
        torque = z[:, 4 * n_t:4 * n_t + n]
        rate = self.model.forward_dynamics(np.ascontiguousarray(z[:, :2 * n_t]),
                                           np.ascontiguousarray(torque), parameters.physical)
        return torque, rate[:, n_t:]

    def _torque_rates(self, z: Array) -> Array:
        """Return the rates of torques that are states, shape (k, n); zeros where they are not."""
        n = self.model.arm.n_joints
        if self.rates is None:
            return np.zeros((len(z), n))
        return np.clip(-z[:, -n:] / self.rates.weights, -self.rates.bounds, self.rates.bounds)

    def on_path(self, path: Path, parameters: Parameters, duration: float) -> Array:
        """Return the unknowns on a path, with what torques it takes as far as motors give them."""
        n = self.model.arm.n_joints
        q, v, a = path(duration * self.mesh.points)
        torque = self.model.inverse_dynamics(np.hstack([q, v]), a, parameters.physical)[:, :n]
        most, cap = _INSIDE * parameters.stall_torque, _INSIDE * parameters.max_torque
        torque = np.clip(torque, -cap, cap)
        w = np.clip(torque + parameters.torque_slope * v[:, :n], -most, most)
        nodes = np.hstack(path(duration * self._outer_nodes)[:2])
        y = self.layout.join(np.hstack([q, v]), a, w, np.zeros_like(w))
        return self._join(y, self._with_drives(nodes, w), parameters, duration)

    def on_straight_line(self, start: Array, goal: Array, parameters: Parameters,
                         duration: float) -> Array:
        """Return the unknowns at constant velocity; free fall would lead to worse minima."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        velocity = (goal - start)[:n_t] / duration

        def states(times: Array) -> Array:
            positions = start[:n_t] + np.outer(times, velocity)
            return np.hstack([positions, np.tile(velocity, (times.size, 1))])

        times = duration * self.mesh.points
        rest, still = np.zeros((times.size, n_t)), np.zeros((times.size, n))
        return self._join(self.layout.join(states(times), rest, still, still), self._with_drives(
            states(duration * self._outer_nodes), still), parameters, duration)

    def _with_drives(self, nodes: Array, drives: Array) -> Array:
        """Return (q, q') at nodes with w between that of the points (K, n), if it is a state."""
        if self.rates is None:
            return nodes
        at = [np.interp(self._outer_nodes, self.mesh.points, column) for column in drives.T]
        return np.column_stack([nodes, *at])

    def split(self, x: Array, parameters: Parameters) -> tuple[Array, Array, Parameters, float]:
        """Return y (K, size), states (N + 1, n_x) at the nodes, parameters and duration."""
        K, n_x = self.mesh.points.size, self.layout.states
        y = x[:K * self.layout.size].reshape(K, -1)
        values = np.vstack([y[:, :n_x], x[y.size:-2].reshape(-1, n_x)])
        return y, values[self.mesh.nodes], replace(parameters, payload_mass=float(x[-2])), float(
            x[-1])

    def torque_rates(self, y: Array, parameters: Parameters) -> Array:
        """Return the rates w' - K_2 q'' of torques at points, shape (K, n) [N m/s]."""
        speeding = y[:, self.layout.accelerations][:, :self.model.arm.n_joints]
        rates: Array = y[:, self.layout.drive_rates] - parameters.torque_slope * speeding
        return rates

    @staticmethod
    def _join(y: Array, nodes: Array, parameters: Parameters, duration: float) -> Array:
        return np.concatenate([y.ravel(), nodes.ravel(), [parameters.payload_mass, duration]])
