"""A collocation solution: values at the mesh nodes and a polynomial in every interval."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.collocation.gauss import GaussRule
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class CollocationSolution:
    """
    Piecewise polynomial of degree s, continuous at the nodes but where a node comes twice.

    Attributes
    ----------
    mesh : numpy.ndarray, shape (N + 1,)
        Node times, increasing; where one comes twice, z may jump, see `junctions`.
    nodes : numpy.ndarray, shape (N + 1, m)
        z at the nodes.
    stages : numpy.ndarray, shape (N, s, m)
        z' at the collocation points.
    rule : GaussRule
        The method.

    """

    mesh: Array
    nodes: Array
    stages: Array
    rule: GaussRule

    @classmethod
    def from_values(cls, mesh: Array, nodes: Array, rule: GaussRule) -> CollocationSolution:
        """Return the piecewise linear function through node values, as a guess."""
        steps = np.diff(mesh)[:, None]
        slopes = np.diff(nodes, axis=0) / np.where(steps, steps, 1.0)
        return cls(mesh, nodes, np.repeat(slopes[:, None], rule.stages, axis=1), rule)

    @property
    def steps(self) -> Array:
        """Return the interval lengths, shape (N,)."""
        return np.diff(self.mesh)

    @property
    def junctions(self) -> Array:
        """Return the times of the nodes that come twice, shape (J,)."""
        times: Array = self.mesh[1:][self.steps == 0]
        return times

    @property
    def intervals(self) -> int:
        """Return the number of intervals, N."""
        return self.mesh.size - 1

    def times_at(self, theta: Array) -> Array:
        """Return the times at the same positions, 0 to 1, of all intervals, shape (N, k)."""
        times: Array = self.mesh[:-1, None] + self.steps[:, None] * theta
        return times

    def values_at(self, theta: Array) -> Array:
        """Return z at the same positions of all intervals, shape (N, k, m)."""
        increments = self.rule.basis(theta) @ self.stages
        values: Array = self.nodes[:-1, None] + self.steps[:, None, None] * increments
        return values

    def rates_at(self, theta: Array) -> Array:
        """Return dz/dt at the same positions of all intervals, shape (N, k, m)."""
        rates: Array = self.rule.basis_rate(theta) @ self.stages
        return rates

    def stage_times(self) -> Array:
        """Return the collocation times, shape (N, s)."""
        return self.times_at(self.rule.nodes)

    def stage_values(self) -> Array:
        """Return z at the collocation points, shape (N, s, m)."""
        increments = self.rule.matrix @ self.stages
        values: Array = self.nodes[:-1, None] + self.steps[:, None, None] * increments
        return values

    def __call__(self, times: Array) -> Array:
        """Return z at times (k,) within the mesh, shape (k, m); where it jumps, that after."""
        return self._evaluate(*self._locate(times))

    def _evaluate(self, interval: NDArray[np.intp], theta: Array) -> Array:
        """Return z at positions in intervals, shape (k, m)."""
        basis = self.rule.basis(theta)
        increments = (basis[:, None] @ self.stages[interval])[:, 0]
        values: Array = self.nodes[interval] + self.steps[interval, None] * increments
        return values

    def rate(self, times: Array) -> Array:
        """Return dz/dt at times (k,), shape (k, m)."""
        interval, theta = self._locate(times)
        rate: Array = (self.rule.basis_rate(theta)[:, None] @ self.stages[interval])[:, 0]
        return rate

    def stretched(self, factor: float) -> CollocationSolution:
        """Return the same values at times so many times as late."""
        return CollocationSolution(self.mesh * factor, self.nodes, self.stages / factor, self.rule)

    def on_mesh(self, mesh: Array, rule: GaussRule | None = None) -> CollocationSolution:
        """Return the same function sampled on another mesh of the same span."""
        rule, steps = rule or self.rule, np.diff(mesh)
        stage_times = (mesh[:-1, None] + steps[:, None] * rule.nodes).ravel()
        stages = self.rate(stage_times).reshape(steps.size, rule.stages, -1)
        nodes = self(mesh)
        first = np.flatnonzero(steps == 0)
        nodes[first] = self.before(mesh[first])
        return CollocationSolution(mesh, nodes, stages, rule)

    def before(self, times: Array) -> Array:
        """Return z at times (k,) after the first, shape (k, m); where it jumps, that before."""
        interval = np.clip(np.searchsorted(self.mesh, times, side='left') - 1, 0,
                           self.intervals - 1)
        return self._evaluate(interval, (times - self.mesh[interval]) / self.steps[interval])

    def without_jumps(self) -> CollocationSolution:
        """Return the solution with each node once, at which it may jump nevertheless."""
        there = np.append(self.steps > 0, True)
        return CollocationSolution(self.mesh[there], self.nodes[there], self.stages[there[:-1]],
                                   self.rule)

    def _locate(self, times: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the interval of each time and the position inside it, 0 to 1."""
        interval = np.clip(np.searchsorted(self.mesh, times, side='right') - 1, 0,
                           self.intervals - 1)
        return interval, (times - self.mesh[interval]) / self.steps[interval]
