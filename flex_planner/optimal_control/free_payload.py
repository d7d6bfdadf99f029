"""
Motions with an unknown more: the duration, or the payload.

Both are unknowns of the boundary-value problem whose rate is zero, so their value is the same at
all points of any iterate: Newton's method keeps linear equations exactly.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.linear import SingularSystemError
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import Indices, MotionProblem
from flex_planner.optimal_control.parameters import Parameters, payload_index
from flex_planner.optimal_control.task import Task
import numpy as np

# of the first guess of the duration; keeps Newton's method among motions that go forwards
_SHORTEST = 1e-3
_NUDGE = 1e-4


class FreeDurationProblem:
    """
    The optimality conditions of a task whose duration T is free.

    The unknowns are (z, T) over the time divided by T, from 0 to 1. With the price rho of a
    second, stationarity in T means H(T) = -rho.

    Parameters
    ----------
    motion : MotionProblem
        Of the task, whose duration is the scale of T.

    """

    def __init__(self, motion: MotionProblem) -> None:
        self.motion = motion
        self.size = motion.size + 1
        self.scale = np.append(motion.scale, _SHORTEST * motion.task.duration)
        self.explicit: Indices = motion.explicit

    def rate(self, t: Array, z: Array) -> Array:
        """Return (T z', 0)."""
        return _widened(z[:, -1:] * self.motion.rate(t, z[:, :-1]), 1)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return (T z', 0) and its Jacobian."""
        duration = z[:, -1:]
        rate, inner = self.motion.rate_jacobian(t, z[:, :-1])
        jacobian = np.zeros((len(z), self.size, self.size))
        jacobian[:, :-1, :-1] = duration[..., None] * inner
        jacobian[:, :-1, -1] = rate
        return _widened(duration * rate, 1), jacobian

    def switches(self, t: Array, z: Array) -> Array:
        """Return the motion's."""
        return self.motion.switches(t, z[:, :-1])

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the motion's rows."""
        residual, rows = self.motion.left(z[:-1])
        return residual, _widened(rows, 1)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the motion's rows and H + rho, whose gradient is (-psi', x')."""
        residual, rows = self.motion.right(z[:-1])
        point = z[None, :-1]
        hamiltonian = self.motion.model.controls(point, self.motion.p).hamiltonian
        rate = self.motion.rate(np.zeros(1), point)[0]
        half = rate.size // 2
        gradient = np.concatenate([-rate[half:], rate[:half], [0.0]])
        return (np.concatenate([residual, hamiltonian + self.motion.task.time_weight]),
                np.vstack([_widened(rows, 1), gradient]))

    def extended(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with a given duration as a guess."""
        duration = float(solution.mesh[-1])
        stages = _widened(solution.stages * duration, 1)
        nodes = np.hstack([solution.nodes, np.full((solution.mesh.size, 1), duration)])
        return CollocationSolution(solution.mesh / duration, nodes, stages, solution.rule)

    def restricted(self, solution: CollocationSolution) -> CollocationSolution:
        """Return the motion over its own time."""
        duration = solution.nodes[0, -1]
        return CollocationSolution(solution.mesh * duration, solution.nodes[:, :-1],
                                   solution.stages[..., :-1] / duration, solution.rule)

    def fixed(self, duration: float) -> MotionProblem:
        """Return the same motion with its duration given."""
        return MotionProblem(self.motion.model, replace(self.motion.task, duration=duration),
                             self.motion.parameters)


class PayloadProblem:
    """
    The payload m_p that is worth its effort: minimise J - sigma m_p.

    The unknowns are (z, m_p, nu) with nu' = -dH/dm_p. At the solution sigma is the price dJ/dm_p
    of the last kilogram, which grows without bound as m_p comes to what the arm can carry. Where
    gravity bends the arm, the states x_0 and x_f at rest depend on m_p too: nu(0) is
    -psi . dx_0/dm_p, and nu(t_f) is -sigma - psi . dx_f/dm_p.

    Parameters
    ----------
    model, task, parameters
        As of `MotionProblem`.
    price : float
        sigma [1/kg], > 0.

    """

    def __init__(self, model: ArmModel, task: Task, parameters: Parameters,
                 price: float) -> None:
        self._price, self._task = price, task
        self.motion = motion = MotionProblem(model, task, parameters)
        self.size = last = motion.size + 2
        self.scale = np.concatenate([motion.scale, [0.1, price]])
        self.explicit: Indices = np.concatenate([motion.explicit, [last - 2, last - 1]])
        self._p = motion.p.copy()
        self._ends = _Ends(motion)

    def rate(self, t: Array, z: Array) -> Array:
        """Return (z', 0, -dH/dm_p)."""
        motion, p = self._at(z)
        rate = _widened(motion.model.optimality(z[:, :-2], p), 2)
        rate[:, -1] = -motion.model.payload_sensitivity(z[:, :-2], p)[1]
        return rate

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return (z', 0, -dH/dm_p) and its Jacobian."""
        motion, p = self._at(z)
        inner, jacobian = motion.model.optimality_jacobian(z[:, :-2], p)
        by_payload, share, bend = motion.model.payload_sensitivity(z[:, :-2], p)
        rate = _widened(inner, 2)
        rate[:, -1] = -share
        full = np.zeros((len(z), self.size, self.size))
        full[:, :-2, :-2] = jacobian
        full[:, :-2, -2] = by_payload
        # z' is the gradient of H turned by a quarter, so dz'/dm_p holds that of dH/dm_p
        half = motion.size // 2
        full[:, -1, :half], full[:, -1, half:-2] = by_payload[:, half:], -by_payload[:, :half]
        full[:, -1, -2] = -bend
        return rate, full

    def switches(self, t: Array, z: Array) -> Array:
        """Return the motion's, with the payload of the iterate."""
        motion, p = self._at(z)
        return motion.switches(t, z[:, :-2], p)

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        half, size = self.motion.goal.size, self.motion.size
        state, change = self._ends.at(0, float(z[-2]))
        rows = np.zeros((half + 1, self.size))
        rows[:half, :half], rows[:half, -2] = np.eye(half), -change
        rows[half, half:size], rows[half, -1] = change, 1
        return np.append(z[:half] - state, z[half:size] @ change + z[-1]), rows

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        half, size = self.motion.goal.size, self.motion.size
        state, change = self._ends.at(1, float(z[-2]))
        _, inner = self.motion.right(z[:-2])
        rows = np.zeros((half + 1, self.size))
        rows[:half, :size], rows[:half, -2] = inner, -inner[:, :half] @ change
        rows[half, half:size], rows[half, -1] = change, 1
        miss = np.concatenate([z[:half] - state, z[half:size]])
        return np.append(inner @ miss, z[half:size] @ change + z[-1] + self._price), rows

    def extended(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with the payload of the task as a guess."""
        count, stages, size = solution.stages.shape
        motion = self.motion
        share = motion.model.payload_sensitivity(
            solution.stage_values().reshape(-1, size), motion.p)[1].reshape(count, stages)
        full_stages = _widened(solution.stages, 2)
        full_stages[..., -1] = -share
        nodes = _widened(solution.nodes, 2)
        nodes[:, -2] = self._task.payload_mass
        gains = -(solution.steps * (share @ solution.rule.weights))
        nodes[1:, -1] = np.cumsum(gains)
        return CollocationSolution(solution.mesh, nodes, full_stages, solution.rule)

    def restricted(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the payload and the motion with it."""
        inner = CollocationSolution(solution.mesh, solution.nodes[:, :-2],
                                    solution.stages[..., :-2], solution.rule)
        return float(solution.nodes[0, -2]), inner

    def with_payload(self, payload: float) -> MotionProblem:
        """Return the motion with a payload given."""
        task = replace(self._task, payload_mass=payload)
        return MotionProblem(self.motion.model, task,
                             replace(self.motion.parameters, payload_mass=payload))

    def _at(self, z: Array) -> tuple[MotionProblem, Array]:
        """Return the motion and the parameters with the payload of an iterate."""
        self._p[payload_index()] = z[0, -2]
        return self.motion, self._p


def payload_price(motion: MotionProblem, solution: CollocationSolution) -> float:
    """Return dJ/dm_p of a motion: the integral of dH/dm_p, and what the bent ends add."""
    z = solution.stage_values().reshape(-1, motion.size)
    share = motion.model.controls(z, motion.p).payload_share.reshape(solution.stages.shape[:2])
    ends, half = _Ends(motion), motion.goal.size
    start, goal = (ends.at(end, motion.task.payload_mass)[1] for end in (0, 1))
    first, last = solution.nodes[0, half:], solution.nodes[-1, half:]
    return float(solution.steps @ (share @ solution.rule.weights) + first @ start - last @ goal)


class _Ends:
    """States at both ends, and how they change with the payload."""

    def __init__(self, motion: MotionProblem) -> None:
        arm = motion.model.arm
        self._motion = motion
        self._bent = bool(arm.n_modes and arm.gravity.any())

    def at(self, end: int, payload: float) -> tuple[Array, Array]:
        """Return state and its derivative by the payload at the start (0) or the goal (1)."""
        motion = self._motion
        given = (motion.start, motion.goal)[end]
        if not self._bent:
            return given, np.zeros_like(given)
        try:
            states = [self._state(end, payload + change) for change in (0.0, -_NUDGE, _NUDGE)]
        except NoEquilibriumError as error:  # the payload of an iterate may be absurd
            raise SingularSystemError(str(error)) from None
        change: Array = (states[2] - states[1]) / (2 * _NUDGE)
        return states[0], change

    def _state(self, end: int, payload: float) -> Array:
        motion, task = self._motion, self._motion.task
        positions = (task.start_positions, task.goal_positions)[end]
        rates = (task.start_velocities, task.goal_velocities)[end]
        parameters = replace(motion.parameters, payload_mass=payload)
        return np.concatenate([equilibrium(motion.model, positions, parameters)[0], rates])


def _widened(values: Array, more: int) -> Array:
    """Return an array with columns of zeros appended."""
    return np.concatenate([values, np.zeros((*values.shape[:-1], more))], axis=-1)
