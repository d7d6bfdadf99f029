"""The unknowns of the programme of one arm on one mesh: guesses, bounds, and what they mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.mesh import Mesh
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

# from times (k,) to z (k, 4 n_t), and to q, q', q'' (k, n_t) each
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

    """

    model: ArmModel
    mesh: Mesh

    @property
    def _outer_nodes(self) -> Array:
        """Return the times, from 0 to 1, of the nodes that are no points."""
        nodes: Array = self.mesh.breaks[self.mesh.nodes >= self.mesh.points.size]
        return nodes

    @property
    def _point_size(self) -> int:
        """Return the number of unknowns of a point."""
        return 3 * self.model.arm.n_coordinates + self.model.arm.n_joints

    def bounds(self, parameters: Parameters, duration: float, free: Free,
               most_payload: float = MAX_PAYLOAD) -> tuple[Array, Array]:
        """Return bounds: of those at points, w = u + K_2 q' alone has some."""
        n, K = self.model.arm.n_joints, self.mesh.points.size
        upper = np.full((K, self._point_size), np.inf)
        upper[:, -n:] = parameters.stall_torque
        others = np.full(self._outer_nodes.size * 2 * self.model.arm.n_coordinates, np.inf)
        both = np.concatenate([upper.ravel(), others])
        payload, time = [parameters.payload_mass] * 2, [duration, duration]
        if free is Free.PAYLOAD:
            payload = [0.0, most_payload]
        if free is Free.DURATION:
            time = [_SHORTEST * duration, _LONGEST * duration]
        return (np.concatenate([-both, [payload[0], time[0]]]),
                np.concatenate([both, [payload[1], time[1]]]))

    def rows(self, parameters: Parameters) -> tuple[Array, Array]:
        """Return bounds of the rows: 0 for equations, caps of the torques of motors with any."""
        arm, K = self.model.arm, self.mesh.points.size
        equations = np.zeros((2 * self.mesh.P.shape[0] + K) * arm.n_coordinates)
        caps = np.tile(parameters.max_torque[TorqueLimits.of(arm).capped], K)
        return np.concatenate([equations, -caps]), np.concatenate([equations, caps])

    def on_motion(self, guess: Guess, parameters: Parameters, duration: float) -> Array:
        """Return the unknowns on a motion with costates."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        z = guess(duration * self.mesh.points)
        control = self.model.controls(z, parameters.stack())
        w = control.torque + parameters.torque_slope * z[:, n_t:n_t + n]
        y = np.hstack([z[:, :2 * n_t], control.acceleration, w])
        nodes = guess(duration * self._outer_nodes)[:, :2 * n_t]
        return self._join(y, nodes, parameters, duration)

    def on_path(self, path: Path, parameters: Parameters, duration: float) -> Array:
        """Return the unknowns on a path, with what torques it takes as far as motors give them."""
        n = self.model.arm.n_joints
        q, v, a = path(duration * self.mesh.points)
        torque = self.model.inverse_dynamics(np.hstack([q, v]), a, parameters.physical)[:, :n]
        most, cap = _INSIDE * parameters.stall_torque, _INSIDE * parameters.max_torque
        torque = np.clip(torque, -cap, cap)
        w = np.clip(torque + parameters.torque_slope * v[:, :n], -most, most)
        nodes = np.hstack(path(duration * self._outer_nodes)[:2])
        return self._join(np.hstack([q, v, a, w]), nodes, parameters, duration)

    def on_straight_line(self, start: Array, goal: Array, parameters: Parameters,
                         duration: float) -> Array:
        """Return the unknowns at constant velocity; free fall would lead to worse minima."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        velocity = (goal - start)[:n_t] / duration

        def states(times: Array) -> Array:
            positions = start[:n_t] + np.outer(times, velocity)
            return np.hstack([positions, np.tile(velocity, (times.size, 1))])

        times = duration * self.mesh.points
        y = np.hstack([states(times), np.zeros((times.size, n_t + n))])
        return self._join(y, states(duration * self._outer_nodes), parameters, duration)

    def split(self, x: Array, parameters: Parameters) -> tuple[Array, Array, Parameters, float]:
        """Return y (K, 3 n_t + n), states at the nodes, parameters and duration."""
        K, n_t = self.mesh.points.size, self.model.arm.n_coordinates
        y = x[:K * self._point_size].reshape(K, -1)
        values = np.vstack([y[:, :2 * n_t], x[y.size:-2].reshape(-1, 2 * n_t)])
        return y, values[self.mesh.nodes], replace(parameters, payload_mass=float(x[-2])), float(
            x[-1])

    @staticmethod
    def _join(y: Array, nodes: Array, parameters: Parameters, duration: float) -> Array:
        return np.concatenate([y.ravel(), nodes.ravel(), [parameters.payload_mass, duration]])
