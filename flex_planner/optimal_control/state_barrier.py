"""
Motions whose torques are states, as what limits of states are added to.

The rates r of the torques are their only controls. Those with a bound b have slacks and
multipliers of their own,

    1 -+ r / b - s_+- = 0        s_+- l_+- = mu        S r + psi_tau + (l_+ - l_-) / b = 0

which are eliminated point by point. Rates without a bound follow from z.

"""

from __future__ import annotations

from typing import NamedTuple

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.barrier_problem import BarrierOfMotion
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_conditions import TorqueState
import numpy as np

# of its bound, within which a first rate stays
_INSIDE = 0.9


class StateBarrier(BarrierOfMotion):
    """
    A motion as a `BarrierProblem`; y is (r, s, l) of the rates of torques that have a bound.

    `PathBarrier` adds limits of the states.

    Parameters
    ----------
    motion : MotionProblem
        Whose torques are states.

    """

    def __init__(self, motion: MotionProblem) -> None:
        super().__init__(motion)
        task, layout = motion.task, motion.layout
        bounded = np.flatnonzero(np.isfinite(task.torque_rate_bounds))
        self.bounds: Array = task.torque_rate_bounds[bounded]
        self.weights: Array = task.torque_rate_prices[bounded]
        self.free = int(bounded.size)
        self._torques = layout.torque_slice.start + bounded
        self._costates = layout.torque_costate_slice.start + bounded
        self._conditions = self.endless(motion.parameters)

    def endless(self, parameters: Parameters) -> TorqueState:
        """Return the conditions without bounds of rates, with other parameters perhaps."""
        task = self.motion.task
        return TorqueState(self.motion.model, parameters, task.torque_rate_prices,
                           np.full(task.arm.n_joints, np.inf))

    def scale(self, mu: float) -> Array:
        """Return the smallest magnitudes of z that matter."""
        return self.motion.scale

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz."""
        rate, jacobian = self._conditions.rate_jacobian(z)
        self.replace_rates(z, y, mu, rate, jacobian)
        return rate, jacobian

    def replace_rates(self, z: Array, y: Array, mu: float, rate: Array, jacobian: Array) -> None:
        """Put bounded rates and their slopes where those without bounds stand."""
        forced, curvature = self._force(z, y, mu)
        rate[:, self._torques] = y[:, :self.free] + forced
        jacobian[:, self._torques, self._costates] = -1 / curvature

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of y that goes with one of z."""
        at, (forced, curvature) = self._split(y), self._force(z, y, mu)
        step = forced - dz[:, self._costates] / curvature
        upper, lower = self._step_slacks(at, step)
        return np.hstack([
            step, upper, lower,
            mu / at.upper - at.upper_price - at.upper_price / at.upper * upper,
            mu / at.lower - at.lower_price - at.lower_price / at.lower * lower])

    def guess(self, solution: CollocationSolution, mu: float) -> Array:
        """Return rates inside their bounds, slacks and multipliers for a motion."""
        z = solution.stage_values().reshape(-1, solution.nodes.shape[1])
        most = _INSIDE * self.bounds
        rates = np.clip(-z[:, self._costates] / self.weights, -most, most)
        slacks = np.hstack([1 - rates / self.bounds, 1 + rates / self.bounds])
        return np.hstack([rates, slacks, mu / slacks]).reshape(*solution.stages.shape[:2], -1)

    def hamiltonian(self, z: Array, y: Array, mu: float) -> Array:
        """Return H with the barrier of rates once y has moved and z has not, shape (k,)."""
        at, (forced, _) = self._split(y), self._force(z, y, mu)
        costates, weights = z[:, self._costates], self.weights
        # what rates without bounds add is taken away again: -psi_tau^2 / (2 S)
        control = (costates**2 / (2 * weights) + weights * at.rates**2 / 2 + costates * at.rates
                   + (weights * at.rates + costates) * forced)
        upper, lower = self._step_slacks(at, forced)
        barrier = (np.log(at.upper) + np.log(at.lower) + upper / at.upper + lower / at.lower)
        found: Array = (self._conditions.controls(z).hamiltonian + control.sum(axis=1)
                        - mu * barrier.sum(axis=1))
        return found

    def _force(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return the step of bounded rates while z stays, and what their costates divide by."""
        at, b = self._split(y), self.bounds
        above, below = at.upper_price / at.upper, at.lower_price / at.lower
        curvature = self.weights + (above + below) / b**2
        pull = (mu / at.upper - above * (1 - at.rates / b - at.upper)
                - mu / at.lower + below * (1 + at.rates / b - at.lower)) / b
        return -(self.weights * at.rates + z[:, self._costates] + pull) / curvature, curvature

    def _step_slacks(self, at: _Rates, step: Array) -> tuple[Array, Array]:
        """Return the steps of both slacks that go with one of the rates."""
        moved = (at.rates + step) / self.bounds
        return 1 - moved - at.upper, 1 + moved - at.lower

    def _split(self, y: Array) -> _Rates:
        return _Rates(*np.split(y[:, :5 * self.free], 5, axis=1))


class _Rates(NamedTuple):
    """Bounded rates with their slacks and multipliers, shape (k, n_b) each."""

    rates: Array
    upper: Array
    lower: Array
    upper_price: Array
    lower_price: Array
