"""Motions with a free payload whose torques are states, for the interior-point method."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.problem import Indices, SingularSystemError
from flex_planner.optimal_control.barrier_problem import payload_step
from flex_planner.optimal_control.boundary_conditions import PayloadEnds
from flex_planner.optimal_control.free_problem import append_zeros, join_with_more
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.state_barrier import StateBarrier
import numpy as np

# of a payload, for differences [kg]
_NUDGE = 1e-4


class StatePayloadBarrier(StateBarrier):
    """
    A `StateBarrier` with a free payload at a price, of (z, m_p, nu): see `FreePayloadProblem`.

    Derivatives by the payload are central differences, as exact as Newton's method needs them;
    dH/dm_p itself is exact.

    Parameters
    ----------
    motion : MotionProblem
        Of a task that ends at rest.
    price : float
        sigma [1/kg], > 0.

    """

    def __init__(self, motion: MotionProblem, price: float) -> None:
        super().__init__(motion)
        inner = motion.size
        self.price, self.size = price, inner + 2
        self.explicit: Indices = np.concatenate([motion.explicit, [inner, inner + 1]])
        self._ends = PayloadEnds(motion.model, motion.task, motion.parameters, motion.ends)

    def scale(self, mu: float) -> Array:
        """Return the magnitudes of the unknowns; costates are no larger than the price."""
        scale = self.motion.scale.copy()
        scale[self.motion.layout.costates] *= min(self.growth(mu), max(1.0, self.price))
        return np.concatenate([scale, [0.1, self.price]])

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        inner, layout = np.ascontiguousarray(z[:, :-2]), self.motion.layout
        less, here, more = (self.endless(replace(
            self.motion.parameters, payload_mass=float(z[0, -2]) + change))
            for change in (-_NUDGE, 0.0, _NUDGE))
        rate, by_state = here.rate_jacobian(inner)
        self.replace_rates(inner, y, mu, rate, by_state)
        by_payload = (more.rate(inner) - less.rate(inner)) / (2 * _NUDGE)
        full = append_zeros(rate, 2)
        full[:, -1] = -here.controls(inner).payload_share
        jacobian = np.zeros((len(z), self.size, self.size))
        jacobian[:, :-2, :-2], jacobian[:, :-2, -2] = by_state, by_payload
        # z' is the gradient of H turned by a quarter, so dz'/dm_p holds that of dH/dm_p
        jacobian[:, -1, layout.states] = by_payload[:, layout.costates]
        jacobian[:, -1, layout.costates] = -by_payload[:, layout.states]
        jacobian[:, -1, -2] = (less.controls(inner).payload_share
                               - more.controls(inner).payload_share) / (2 * _NUDGE)
        return full, jacobian

    def longest(self, node: Array, step: Array) -> float:
        """Return the share of a step with which the payload stays positive, and is no jump."""
        return payload_step(self.motion, float(node[-2]), float(step[-2]))

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the initial conditions."""
        return self._rest(0, z, 0.0)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the final conditions."""
        return self._rest(1, z, self.price)

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point: payload and nu go on as they were."""
        return join_with_more(self.motion, junction, before, after)

    def extend(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with the payload of the task, whose price grows evenly."""
        duration = solution.mesh[-1]
        nodes = append_zeros(solution.nodes, 2)
        nodes[:, -2] = self.motion.task.payload_mass
        nodes[:, -1] = -self.price * solution.mesh / duration
        stages = append_zeros(solution.stages, 2)
        stages[..., -1] = -self.price / duration
        return CollocationSolution(solution.mesh, nodes, stages, solution.rule)

    def restrict(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the payload, and the motion with it."""
        return float(solution.nodes[0, -2]), CollocationSolution(
            solution.mesh, solution.nodes[:, :-2], solution.stages[..., :-2], solution.rule)

    def _rest(self, end: int, z: Array, price: float) -> tuple[Array, Array]:
        """Return the conditions at an end (0 or 1), and that nu begins or ends there."""
        layout = self.motion.layout
        try:
            state, change, bend = self._state_at(end, float(z[-2]))
        except NoEquilibriumError as error:  # it may be absurd: Newton's step is too long
            raise SingularSystemError(str(error)) from None
        half, costates = layout.states.size, layout.costates
        given = layout.states[:state.size]
        rows = np.zeros((half + 1, self.size))
        rows[np.arange(state.size), given], rows[:state.size, -2] = 1, -change
        # torques that are free at an end have no costates there
        free = costates[state.size:]
        rows[np.arange(state.size, half), free] = 1
        rows[half, costates[:state.size]] = change
        rows[half, -2:] = z[costates[:state.size]] @ bend, 1
        nu = z[costates[:state.size]] @ change + z[-1] + price
        return np.concatenate([z[given] - state, z[free], [nu]]), rows

    def _state_at(self, end: int, payload: float) -> tuple[Array, Array, Array]:
        """Return what is given at an end, (q, q') or (q, q', tau), and two derivatives by m_p."""
        state, change, bend = self._ends.at(end, payload)
        ends = self.motion.torque_ends
        assert ends is not None
        if not (ends.start, ends.goal)[end].size:
            return state, change, bend
        less, here, more = (self._hold(state + step * change + step**2 * bend / 2, payload + step)
                            for step in (-_NUDGE, 0.0, _NUDGE))
        return (np.append(state, here), np.append(change, (more - less) / (2 * _NUDGE)),
                np.append(bend, (more - 2 * here + less) / _NUDGE**2))

    def _hold(self, state: Array, payload: float) -> Array:
        """Return the torques (n,) that hold the arm in a state with a payload."""
        motion = self.motion
        physical = replace(motion.parameters, payload_mass=payload).physical
        force = motion.model.static_forces(state[None, :motion.layout.coordinates], physical)[0]
        held: Array = force[0, :motion.layout.torques]
        return held
