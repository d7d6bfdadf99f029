"""What IPOPT found, in the terms of the problem."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from flex_planner.base.validation import Array
import numpy as np


class DirectStatus(Enum):
    """How a solve ended."""

    CONVERGED = 'converged'
    FAILED = 'failed'
    STOPPED = 'stopped'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectResult:
    """
    The last iterate of IPOPT, a solution only if it converged; its start if it was stopped.

    Attributes
    ----------
    status : DirectStatus
        Only ``CONVERGED`` is a solution.
    message : str
        What IPOPT says, or why it was stopped.
    cost : float
        J of eq. (6), by the quadrature of the scheme.
    payload, duration : float
        m_p [kg] and t_f [s].
    times, states, costates : numpy.ndarray, shapes (N + 1,), (N + 1, 2 n_t) twice
        (q, q') and (psi_1, psi_2) at the nodes of the mesh.
    point_times, point_states, point_costates : numpy.ndarray, shapes (k,), (k, 2 n_t) twice
        The same at the collocation points. These costates belong to the torques through eq. (13);
        except for ``gauss`` they are of lower order than those at the nodes.
    torques : numpy.ndarray, shape (k, n)
        At the collocation points [N m].
    iterations : int
        Of IPOPT.
    seconds : float
        Time of the solve, without the derivation of the programme.
    iterate : dict of str to numpy.ndarray
        Unknowns and multipliers of IPOPT, for a warm start.
    node_torques, torque_costates : numpy.ndarray, shape (N + 1, n)
        tau and psi_tau at the nodes where torques have rates, no columns where not.
    point_torque_costates, torque_rates : numpy.ndarray, shape (k, n)
        psi_tau and the rates of the torques at the collocation points [N m/s].

    """

    status: DirectStatus
    message: str
    cost: float
    payload: float
    duration: float
    times: Array
    states: Array
    costates: Array
    point_times: Array
    point_states: Array
    point_costates: Array
    torques: Array
    iterations: int
    seconds: float
    iterate: dict[str, Array]
    node_torques: Array = field(default_factory=lambda: np.zeros((0, 0)))
    torque_costates: Array = field(default_factory=lambda: np.zeros((0, 0)))
    point_torque_costates: Array = field(default_factory=lambda: np.zeros((0, 0)))
    torque_rates: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def nodes(self) -> Array:
        """Return the unknowns of `MotionProblem` at the nodes of the mesh."""
        z = np.hstack([self.states, self.costates])
        return np.hstack([z, self.node_torques, self.torque_costates]) if (
            self.node_torques.size) else z

    @property
    def points(self) -> Array:
        """Return them at the collocation points."""
        z = np.hstack([self.point_states, self.point_costates])
        return np.hstack([z, self.torques, self.point_torque_costates]) if (
            self.node_torques.size) else z

    @property
    def converged(self) -> bool:
        """Whether this is a solution."""
        return self.status is DirectStatus.CONVERGED

    def __call__(self, times: Array) -> Array:
        """Return z, linear between the nodes, at times (k,), shape (k, m)."""
        return np.stack([np.interp(times, self.times, column) for column in self.nodes.T], axis=1)
