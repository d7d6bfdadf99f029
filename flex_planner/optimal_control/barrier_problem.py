"""Motions with the motors' limits as a barrier, for the interior-point method."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

ENDLESS = 1e30
"""Stands for a limit that there is none of."""
# of its limits, within which a first torque stays
_INSIDE = 0.9
# a payload keeps this share of itself in a step, and changes by no more than this of the links
_LEAST_LEFT, _LARGEST_JUMP = 0.2, 0.4


class BarrierOfMotion:
    """
    What a motion with a barrier has of the motion itself: its ends and its via points.

    Parameters
    ----------
    motion : MotionProblem
        Of the task.

    """

    def __init__(self, motion: MotionProblem) -> None:
        self.motion = motion
        self.size, self.explicit = motion.size, motion.explicit
        self.junctions = motion.junctions

    def longest(self, node: Array, step: Array) -> float:
        """Return 1: the motion may go anywhere."""
        return 1.0

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        return self.motion.left(z)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        return self.motion.right(z)

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point."""
        return self.motion.join(junction, before, after)

    def growth(self, mu: float) -> float:
        """Return by how much a barrier of the motors' limits makes torques dearer, at least 1."""
        limits = self.motion.parameters
        grown = 2 * mu / (limits.effort_weights * limits.torque_limits.standstill**2)
        return max(1.0, float(grown.max()))


class MotionBarrier(BarrierOfMotion):
    """
    The conditions of `barrier_conditions` for a task: a `BarrierProblem` of z = (q, q', psi).

    Parameters
    ----------
    motion : MotionProblem
        Of the task.

    """

    def __init__(self, motion: MotionProblem) -> None:
        super().__init__(motion)
        self.free = motion.model.arm.n_joints
        self._p = np.where(np.isfinite(motion.p), motion.p, ENDLESS)

    @property
    def cost_rate(self) -> float:
        """Return about the effort per time that a motion takes, or the motors can spend."""
        motion, n = self.motion, self.free
        # the scale of the second costates is a tenth of R times the torques
        half = 3 * motion.size // 4
        torque = np.maximum(10 * motion.scale[half:half + n] / motion.parameters.effort_weights,
                            np.abs(motion.holding_torque))
        torque = np.minimum(torque, motion.parameters.torque_limits.standstill)
        return float(motion.parameters.effort_weights @ torque**2) / 2

    def scale(self, mu: float) -> Array:
        """
        Return the magnitudes of the unknowns.

        While the limits are a barrier alone a torque costs 2 mu / K_1^2, and costates are as large
        as that.

        """
        half = self.motion.size // 2
        scale = self.motion.scale.copy()
        scale[half:] *= self.growth(mu)
        return scale

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        rate, jacobian = self.motion.model.barrier('barrier')(z, y, np.append(self._p, mu))
        return rate, jacobian

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of (torques, slacks, multipliers) that goes with one of z."""
        return self.motion.model.barrier('barrier_direction')(z, y, dz,
                                                              np.append(self._p, mu))[0]

    def guess(self, solution: CollocationSolution, mu: float) -> Array:
        """Return torques inside their limits, slacks and multipliers for a motion."""
        z = solution.stage_values().reshape(-1, solution.nodes.shape[1])
        own = z[:, :self.motion.size]  # without what else is free
        return self._centre(own, mu).reshape(*solution.stages.shape[:2], -1)

    def _centre(self, z: Array, mu: float) -> Array:
        n_t, n = self.motion.model.arm.n_coordinates, self.motion.model.arm.n_joints
        limits, speeds = self.motion.parameters.torque_limits, z[:, n_t:n_t + n]
        lower, upper = (np.clip(each, -ENDLESS, ENDLESS) for each in limits.bounds(speeds))
        middle, half = (lower + upper) / 2, _INSIDE * (upper - lower) / 2
        free = self.motion.model.controls(z, self.motion.p).free_torque
        torque = middle + np.clip(free - middle, -half, half)
        slacks = find_slacks(limits, torque, speeds)
        return np.hstack([torque, slacks, mu / slacks])


class PayloadBarrier(MotionBarrier):
    """
    The same with a free payload at a price, of (z, m_p, nu): see `FreePayloadProblem`.

    Parameters
    ----------
    motion : MotionProblem
        Of the task.
    price : float
        sigma [1/kg], > 0.

    """

    def __init__(self, motion: MotionProblem, price: float) -> None:
        super().__init__(motion)
        self.payload = FreePayloadProblem(motion, price)
        self.size, self.explicit = self.payload.size, self.payload.explicit
        self.price = price

    def scale(self, mu: float) -> Array:
        """Return the magnitudes of the unknowns; costates are no larger than the price."""
        half = self.motion.size // 2
        scale = self.payload.scale.copy()
        scale[half:2 * half] *= min(self.growth(mu), max(1.0, self.price))
        return scale

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        rate, jacobian = self.motion.model.barrier('payload_barrier')(
            z, y, np.append(self._p, mu))
        return rate, jacobian

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of (torques, slacks, multipliers) that goes with one of z."""
        return self.motion.model.barrier('payload_barrier_direction')(
            z, y, dz, np.append(self._p, mu))[0]

    def longest(self, node: Array, step: Array) -> float:
        """Return the share of a step with which the payload stays positive, and is no jump."""
        return payload_step(self.motion, float(node[-2]), float(step[-2]))

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        return self.payload.left(z)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        return self.payload.right(z)

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point."""
        return self.payload.join(junction, before, after)

    def extend(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with the payload of the task, whose price grows evenly."""
        count, stages, size = solution.stages.shape
        duration = solution.mesh[-1] - solution.mesh[0]
        way = (solution.mesh - solution.mesh[0]) / duration
        nodes = np.column_stack([solution.nodes, np.full(count + 1, self.motion.task.payload_mass),
                                 -self.price * way])
        added = np.zeros((count, stages, 2))
        added[..., 1] = -self.price / duration
        return CollocationSolution(solution.mesh, nodes,
                                   np.concatenate([solution.stages, added], axis=-1),
                                   solution.rule)

    def restrict(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the payload, and the motion with it."""
        return self.payload.restrict(solution)


def find_slacks(limits: TorqueLimits, torque: Array, speeds: Array) -> Array:
    """Return what the limits leave for torques at joint speeds (k, n), shape (k, 2 n or 4 n)."""
    margins = limits.margins(torque, speeds)
    if not limits.capped.any():
        margins = margins[:2]
    return np.hstack([np.where(np.isfinite(each), each, ENDLESS) for each in margins])


def payload_step(motion: MotionProblem, payload: float, change: float) -> float:
    """Return the share of a change [kg] with which a payload stays positive, and is no jump."""
    most = _LARGEST_JUMP * motion.model.arm.link_mass
    room = most if change > 0 else min(most, (1 - _LEAST_LEFT) * payload)
    return min(1.0, room / max(abs(change), 1e-300))
