"""
Motions whose payload is unknown.

It is an unknown of the boundary-value problem whose rate is zero, so its value is the same at all
points of any iterate: Newton's method keeps linear equations exactly.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationResult, CollocationSolution
from flex_planner.collocation.problem import CompiledRate, SingularSystemError
from flex_planner.optimal_control.boundary_conditions import PayloadEnds
from flex_planner.optimal_control.free_problem import append_zeros, join_with_more
from flex_planner.optimal_control.motion_problem import Indices, MotionProblem
from flex_planner.optimal_control.parameters import payload_index
import numpy as np


class FreePayloadProblem:
    """
    The payload m_p that is worth its effort: minimise J - sigma m_p.

    The unknowns are (z, m_p, nu) with nu' = -dH/dm_p. At the solution sigma is the price dJ/dm_p
    of the last kilogram, which grows without bound as m_p comes to what the arm can carry. Where
    gravity bends the arm, the states x_0 and x_f at rest depend on m_p too: nu(0) is
    -psi . dx_0/dm_p, and nu(t_f) is -sigma - psi . dx_f/dm_p.

    Parameters
    ----------
    motion : MotionProblem
        Of the task.
    price : float
        sigma [1/kg], > 0.

    """

    def __init__(self, motion: MotionProblem, price: float) -> None:
        self.motion, self._price = motion, price
        self.size = last = motion.size + 2
        self.scale = np.concatenate([motion.scale, [0.1, price]])
        self.explicit: Indices = np.concatenate([motion.explicit, [last - 2, last - 1]])
        self.junctions = motion.junctions
        self._p = motion.p.copy()
        self._ends = _ends(motion)

    def rate(self, t: Array, z: Array) -> Array:
        """Return (z', 0, -dH/dm_p)."""
        motion, p = self._at(z)
        rate = append_zeros(motion.model.optimality(z[:, :-2], p), 2)
        rate[:, -1] = -motion.model.payload_sensitivity(z[:, :-2], p)[1]
        return rate

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return (z', 0, -dH/dm_p) and its Jacobian."""
        motion, p = self._at(z)
        inner, jacobian = motion.model.optimality_jacobian(z[:, :-2], p)
        by_payload, share, bend = motion.model.payload_sensitivity(z[:, :-2], p)
        rate = append_zeros(inner, 2)
        rate[:, -1] = -share
        full = np.zeros((len(z), self.size, self.size))
        full[:, :-2, :-2] = jacobian
        full[:, :-2, -2] = by_payload
        # z' is the gradient of H turned by a quarter, so dz'/dm_p holds that of dH/dm_p
        half = motion.size // 2
        full[:, -1, :half], full[:, -1, half:-2] = by_payload[:, half:], -by_payload[:, :half]
        full[:, -1, -2] = -bend
        return rate, full

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code, None without a compiler."""
        return self.motion.model.compiled_rate('free_payload', self.motion.p)

    def switches(self, t: Array, z: Array) -> Array:
        """Return the motion's, with the payload of the iterate."""
        motion, p = self._at(z)
        return motion.switches(t, z[:, :-2], p)

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        half, size = self.motion.goal.size, self.motion.size
        state, change, bend = self._rest(0, z)
        rows = np.zeros((half + 1, self.size))
        rows[:half, :half], rows[:half, -2] = np.eye(half), -change
        rows[half, half:size], rows[half, -2:] = change, (z[half:size] @ bend, 1)
        return np.append(z[:half] - state, z[half:size] @ change + z[-1]), rows

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        half, size = self.motion.goal.size, self.motion.size
        state, change, bend = self._rest(1, z)
        _, inner = self.motion.right(z[:-2])
        rows = np.zeros((half + 1, self.size))
        rows[:half, :size], rows[:half, -2] = inner, -inner[:, :half] @ change
        rows[half, half:size], rows[half, -2:] = change, (z[half:size] @ bend, 1)
        miss = np.concatenate([z[:half] - state, z[half:size]])
        return np.append(inner @ miss, z[half:size] @ change + z[-1] + self._price), rows

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point: payload and nu go on as they were."""
        return join_with_more(self.motion, junction, before, after)

    def extend(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with the payload of the task as a guess."""
        count, stages, size = solution.stages.shape
        motion = self.motion
        share = motion.model.payload_sensitivity(
            solution.stage_values().reshape(-1, size), motion.p)[1].reshape(count, stages)
        full_stages = append_zeros(solution.stages, 2)
        full_stages[..., -1] = -share
        nodes = append_zeros(solution.nodes, 2)
        nodes[:, -2] = motion.task.payload_mass
        gains = -(solution.steps * (share @ solution.rule.weights))
        nodes[1:, -1] = np.cumsum(gains)
        return CollocationSolution(solution.mesh, nodes, full_stages, solution.rule)

    def restrict(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the payload, and the motion with it."""
        inner = CollocationSolution(solution.mesh, solution.nodes[:, :-2],
                                    solution.stages[..., :-2], solution.rule)
        return float(solution.nodes[0, -2]), inner

    def restrict_result(self, result: CollocationResult) -> CollocationResult:
        """Return the result of the motion with the payload found."""
        return replace(result, solution=self.restrict(result.solution)[1],
                       errors=result.errors[:self.motion.size])

    def fix(self, payload: float) -> MotionProblem:
        """Return the same motion with its payload given."""
        return self.motion.with_changes(payload_mass=payload)

    def _rest(self, end: int, z: Array) -> tuple[Array, Array, Array]:
        """Return the state at an end and its derivatives by the payload of an iterate."""
        try:
            return self._ends.at(end, float(z[-2]))
        except NoEquilibriumError as error:  # it may be absurd: Newton's step is too long
            raise SingularSystemError(str(error)) from None

    def _at(self, z: Array) -> tuple[MotionProblem, Array]:
        """Return the motion and the parameters with the payload of an iterate."""
        self._p[payload_index()] = z[0, -2]
        return self.motion, self._p


def payload_price(motion: MotionProblem, solution: CollocationSolution) -> float:
    """
    Return dJ/dm_p of a motion: the integral of dH/dm_p, and what the bent ends add.

    Raises
    ------
    NoEquilibriumError
        If the links buckle at an end with hardly more payload.

    """
    z = solution.stage_values().reshape(-1, motion.size)
    share = motion.model.controls(z, motion.p).payload_share.reshape(solution.stages.shape[:2])
    ends, half = _ends(motion), motion.goal.size
    start, goal = (ends.at(end, motion.task.payload_mass)[1] for end in (0, 1))
    first, last = solution.nodes[0, half:], solution.nodes[-1, half:]
    return float(solution.steps @ (share @ solution.rule.weights) + first @ start - last @ goal)


def _ends(motion: MotionProblem) -> PayloadEnds:
    return PayloadEnds(motion.model, motion.task, motion.parameters, motion.ends)
