"""A collocation solution: values at the mesh nodes and a polynomial in every interval."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.collocation.gauss import GaussRule
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class CollocationSolution:
    """
    Piecewise polynomial of degree s, continuous at the nodes.

    Attributes
    ----------
    mesh : numpy.ndarray, shape (N + 1,)
        Node times, increasing.
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
        slopes = np.diff(nodes, axis=0) / np.diff(mesh)[:, None]
        return cls(mesh, nodes, np.repeat(slopes[:, None], rule.stages, axis=1), rule)

    @property
    def steps(self) -> Array:
        """Return the interval lengths, shape (N,)."""
        return np.diff(self.mesh)

    @property
    def intervals(self) -> int:
        """Return the number of intervals, N."""
        return self.mesh.size - 1

    def stage_times(self) -> Array:
        """Return the collocation times, shape (N, s)."""
        return self.mesh[:-1, None] + self.steps[:, None] * self.rule.nodes

    def stage_values(self) -> Array:
        """Return z at the collocation points, shape (N, s, m)."""
        increments = np.einsum('ij,kjm->kim', self.rule.matrix, self.stages)
        values: Array = self.nodes[:-1, None] + self.steps[:, None, None] * increments
        return values

    def __call__(self, times: Array) -> Array:
        """Return z at times (k,) within the mesh, shape (k, m)."""
        interval, theta = self._locate(times)
        basis = self.rule.basis(theta)
        increments = np.einsum('ks,ksm->km', basis, self.stages[interval])
        values: Array = self.nodes[interval] + self.steps[interval, None] * increments
        return values

    def rate(self, times: Array) -> Array:
        """Return dz/dt at times (k,), shape (k, m)."""
        interval, theta = self._locate(times)
        basis = self.rule.basis_rate(theta)
        rate: Array = np.einsum('ks,ksm->km', basis, self.stages[interval])
        return rate

    def on_mesh(self, mesh: Array) -> CollocationSolution:
        """Return the same function sampled on another mesh of the same span."""
        steps = np.diff(mesh)
        stage_times = (mesh[:-1, None] + steps[:, None] * self.rule.nodes).ravel()
        stages = self.rate(stage_times).reshape(steps.size, self.rule.stages, -1)
        return CollocationSolution(mesh, self(mesh), stages, self.rule)

    def _locate(self, times: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the interval of each time and the position inside it, 0 to 1."""
        interval = np.clip(np.searchsorted(self.mesh, times, side='right') - 1, 0,
                           self.intervals - 1)
        return interval, (times - self.mesh[interval]) / self.steps[interval]
