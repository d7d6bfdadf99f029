"""
A motion of the rigid arm as a guess for the flexible one: links bent as its forces bend them.

The modes follow from the forces of the rigid motion without ringing. Costates belong to the same
torque: with ``y = (y_rigid, 0)`` it stays ``-R^-1 B^T y``. So ``psi_2 = M(Q) y`` in the mass
matrix of the arm itself, and psi_1 follows from eq. (12).

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, differentiation_matrix, GaussRule
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np


def bend_quasi_statically(problem: MotionProblem, rigid: CollocationSolution, mesh: Array,
                          rule: GaussRule) -> CollocationSolution:
    """
    Return a motion of the flexible arm from one of the same arm made rigid.

    Parameters
    ----------
    problem : MotionProblem
        Of the flexible arm, with the payload of the motion.
    rigid : CollocationSolution
        In (4 n,) unknowns.
    mesh : numpy.ndarray, shape (N + 1,)
        Of the guess; it spans that of the motion [s]. Times that come twice do so once.
    rule : GaussRule
        Of the guess.

    """
    points = _Points.of(np.unique(mesh), rule)
    model, p = problem.model, problem.parameters.physical
    n, n_t, z = model.arm.n_joints, model.arm.n_coordinates, rigid(points.times.ravel())
    parameters = problem.parameters.drop_modes()
    controls = ArmModel.of(model.arm.rigid()).controls(z, parameters.stack())
    states, virtual, acceleration = np.zeros((2, z.shape[0], n_t)), *np.zeros((2, z.shape[0], n_t))
    states[0, :, :n], states[1, :, :n] = z[:, :n], z[:, n:2 * n]
    virtual[:, :n] = -controls.free_torque * parameters.effort_weights
    acceleration[:, :n] = controls.acceleration
    forces = model.inverse_dynamics(np.hstack(list(states)), acceleration, p)[:, n:]
    stiffness = model.static_forces(problem.start[None, :n_t], p)[1][0, n:, n:]
    # to count accelerations of the modes, too, makes worse guesses
    states[0, :, n:] = -np.linalg.solve(stiffness, forces.T).T
    states[1, :, n:] = points.rates(states[0, :, n:])
    mass = model.mass_and_energy(np.hstack(list(states)), p)[0]
    psi_2 = (mass @ virtual[:, :, None])[..., 0]
    lifted = np.hstack([*states, np.zeros_like(psi_2), psi_2])
    # psi_2' = ... - psi_1
    lifted[:, 2 * n_t:3 * n_t] = (model.optimality(lifted, problem.p)[:, 3 * n_t:]
                                  - points.rates(psi_2))
    return points.solution(lifted)


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """
    The collocation points of a mesh with the ends of their intervals.

    Attributes
    ----------
    mesh : numpy.ndarray, shape (N + 1,)
        [s].
    rule : GaussRule
        Of s stages.
    times : numpy.ndarray, shape (N, s + 2)
        [s].
    slopes : numpy.ndarray, shape (s + 2, s + 2)
        Differentiates the polynomial through the points of an interval of unit length.

    """

    mesh: Array
    rule: GaussRule
    times: Array
    slopes: Array

    @classmethod
    def of(cls, mesh: Array, rule: GaussRule) -> _Points:
        """Return those of a mesh."""
        shares = np.concatenate([[0.0], rule.nodes, [1.0]])
        return cls(mesh, rule, mesh[:-1, None] + np.diff(mesh)[:, None] * shares,
                   differentiation_matrix(shares))

    def rates(self, values: Array) -> Array:
        """Return the rates of values (N (s + 2), m) at the points; one at both sides of a node."""
        stacked = values.reshape(*self.times.shape, -1)
        rates = (self.slopes @ stacked) / np.diff(self.mesh)[:, None, None]
        middle = (rates[:-1, -1] + rates[1:, 0]) / 2
        rates[:-1, -1] = rates[1:, 0] = middle
        smooth: Array = rates.reshape(values.shape)
        return smooth

    def solution(self, values: Array) -> CollocationSolution:
        """Return the function with values (N (s + 2), m) at the points."""
        stacked = values.reshape(*self.times.shape, -1)
        nodes = np.concatenate([stacked[:, 0], stacked[-1:, -1]])
        rates = (self.slopes @ stacked)[:, 1:-1] / np.diff(self.mesh)[:, None, None]
        return CollocationSolution(self.mesh, nodes, rates, self.rule)
