"""Where states and costates stand among the unknowns of a motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from flex_planner.base.validation import Array
from flex_planner.collocation.problem import Indices
import numpy as np


@dataclass(frozen=True)
class StateLayout:
    """
    The order of the unknowns: (q, q', psi_1, psi_2), and (tau, psi_tau) where torque is a state.

    Parameters
    ----------
    coordinates : int
        n_t.
    torques : int
        How many torques are states: n, or 0 where torque is chosen at every moment.

    """

    coordinates: int
    torques: int = 0

    @property
    def size(self) -> int:
        """Return the number of unknowns, 4 n_t + 2 n or 4 n_t."""
        return 4 * self.coordinates + 2 * self.torques

    @property
    def torque_slice(self) -> slice:
        """Return where the torques stand, empty where they are no states."""
        return slice(4 * self.coordinates, 4 * self.coordinates + self.torques)

    @property
    def torque_costate_slice(self) -> slice:
        """Return where the costates of the torques stand."""
        return slice(4 * self.coordinates + self.torques, self.size)

    @cached_property
    def states(self) -> Indices:
        """Return where the states stand: q, q', tau, shape (size / 2,)."""
        torques = self.torque_slice
        found: Indices = np.r_[0:2 * self.coordinates, torques.start:torques.stop]
        return found

    @cached_property
    def costates(self) -> Indices:
        """Return where their costates stand, in the same order."""
        n_t, torques = self.coordinates, self.torque_costate_slice
        found: Indices = np.r_[2 * n_t:4 * n_t, torques.start:torques.stop]
        return found

    def take_states(self, z: Array) -> Array:
        """Return the states of unknowns (..., m), not copied where they stand side by side."""
        states: Array = z[..., self.states] if self.torques else z[..., :2 * self.coordinates]
        return states

    def turn(self, rate: Array) -> Array:
        """Return the gradient of H (..., m) from the rates of an extremal: (-psi', x')."""
        gradient = np.empty_like(rate)
        gradient[..., self.states] = -rate[..., self.costates]
        gradient[..., self.costates] = rate[..., self.states]
        return gradient

    @cached_property
    def explicit(self) -> Indices:
        """Return q, psi_1 and tau, whose rates the collocation need not factorise."""
        n_t, torques = self.coordinates, self.torque_slice
        found: Indices = np.r_[0:n_t, 2 * n_t:3 * n_t, torques.start:torques.stop]
        return found
