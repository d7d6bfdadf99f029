"""Conditions at both ends of a motion whose torque is a state."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.optimal_control.state_layout import StateLayout
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueEnds:
    """
    The torque that holds the arm where it rests; where it does not, the torque is free.

    A torque that is free at an end has the costate 0 there.

    Attributes
    ----------
    layout : StateLayout
        Of a motion of n joints whose torques are states.
    start, goal : numpy.ndarray, shape (n,)
        Holding torques; empty where the arm does not rest [N m].

    """

    layout: StateLayout
    start: Array
    goal: Array

    def add_left(self, z: Array, residual: Array, rows: Array) -> tuple[Array, Array]:
        """Return the initial conditions (l,) and their rows (l, 4 n_t) with those of torques."""
        return self._add(z, residual, rows, self.start)

    def add_right(self, z: Array, residual: Array, rows: Array) -> tuple[Array, Array]:
        """Return the final conditions with those of torques."""
        return self._add(z, residual, rows, self.goal)

    def between(self, shares: Array) -> Array:
        """Return torques on the way from one end to the other, at shares (k,), shape (k, n)."""
        none = np.zeros(self.layout.torques)
        start, goal = (held if held.size else none for held in (self.start, self.goal))
        return start + shares[:, None] * (goal - start)

    def _add(self, z: Array, residual: Array, rows: Array,
             held: Array) -> tuple[Array, Array]:
        layout = self.layout
        at = layout.torque_slice if held.size else layout.torque_costate_slice
        added = np.zeros((len(rows) + layout.torques, layout.size))
        added[:len(rows), :rows.shape[1]] = rows
        added[len(rows):, at] = np.eye(layout.torques)
        return np.concatenate([residual, z[at] - held if held.size else z[at]]), added
