"""
The motion of an arm whose stiff parts follow quasi-statically, from one with these parts rigid.

Each stiff coordinate is where its load, inertia included, holds it without vibration (the slow
manifold of the dynamics). The joints move as they did, so a joint whose motor is within its limits
takes the torque that this needs, by inverse dynamics. The joints' path is the best one of the arm
with rigid parts; that of the arm as it is differs by one over the stiffness, and least effort by
its square.

"""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, differentiation_matrix
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.ringing import Mask
import numpy as np

# corrections of the bending; a second round knows how fast it changes
_CORRECTIONS, _ROUNDS = 3, 2


def follow_quasi_statically(problem: MotionProblem, reduced: MotionProblem,
                            found: CollocationSolution, kept: Mask) -> CollocationSolution:
    """
    Return the motion of all coordinates.

    Parameters
    ----------
    problem : MotionProblem
        Of the arm as it is, n_t coordinates.
    reduced : MotionProblem
        Of the arm with stiff parts rigid.
    found : CollocationSolution
        Its solution.
    kept : numpy.ndarray of bool, shape (n_t,)
        Coordinates that are not stiff.

    """
    motion = _Motion(problem, reduced, found, kept)
    for _ in range(_ROUNDS):
        motion.bend()
    return motion.solution()


class _Motion:
    """Coordinates, rates and accelerations (N, s + 2, n_t) at points and ends of intervals."""

    def __init__(self, problem: MotionProblem, reduced: MotionProblem,
                 found: CollocationSolution, kept: Mask) -> None:
        self._problem, self._found = problem, found
        self._kept, self._stiff = np.flatnonzero(kept), np.flatnonzero(~kept)
        self._theta = np.concatenate([[0.0], found.rule.nodes, [1.0]])
        self._slope = differentiation_matrix(self._theta)
        values = found.values_at(self._theta)
        z, self._n = values.reshape(-1, reduced.size), kept.size
        self._known = reduced.model.controls(z, reduced.p)
        self._q, self._rate, self._acceleration = np.zeros((3, *values.shape[:2], kept.size))
        half = self._kept.size
        self._q[..., kept], self._rate[..., kept] = (values[..., :half],
                                                     values[..., half:2 * half])
        self._acceleration[..., kept] = self._known.acceleration.reshape(*values.shape[:2], half)
        self._q[..., ~kept] = problem.start[:kept.size][~kept]
        mass = reduced.model.mass_and_energy(z[:, :2 * half], reduced.parameters.physical)[0]
        self._virtual = np.linalg.solve(mass, z[:, 3 * half:, None])[..., 0]

    def bend(self) -> None:
        """Bend stiff parts as their load does, and find how fast that changes."""
        model, p, stiff = self._problem.model, self._problem.parameters.physical, self._stiff
        stiffness = model.static_forces(self._q.reshape(-1, self._n), p)[1][:, stiff[:, None],
                                                                            stiff]
        for _ in range(_CORRECTIONS):
            surplus = self._forces()[:, stiff, None]
            change = np.linalg.solve(stiffness, surplus)
            self._q[..., stiff] -= change.reshape(*self._q.shape[:2], -1)
        self._rate[..., stiff] = self._differentiate(self._q[..., stiff])
        self._acceleration[..., stiff] = self._differentiate(self._rate[..., stiff])

    def solution(self) -> CollocationSolution:
        """Return the motion with costates that belong to its torque."""
        problem, n_t = self._problem, self._n
        mass = problem.model.mass_and_energy(self._states(), problem.parameters.physical)[0]
        psi_2 = (mass @ self._find_virtual()[..., None])[..., 0]
        z = np.hstack([self._states(), np.zeros_like(psi_2), psi_2])
        change = self._differentiate(psi_2.reshape(self._q.shape)).reshape(psi_2.shape)
        # psi_2' = ... - psi_1
        z[:, 2 * n_t:3 * n_t] = problem.model.optimality(z, problem.p)[:, 3 * n_t:] - change
        stacked = z.reshape(*self._q.shape[:2], -1)
        nodes = np.vstack([stacked[:, 0], stacked[-1:, -1]])
        return CollocationSolution(self._found.mesh, nodes,
                                   self._differentiate(stacked)[:, 1:-1], self._found.rule)

    def _find_virtual(self) -> Array:
        """
        Return M^-1 psi_2, of which the torque without bounds is the share -1/R at the joints.

        Soft parts would need more than the joints' torque to move as before: then it is left.

        """
        n = self._problem.model.arm.n_joints
        virtual = np.zeros((self._virtual.shape[0], self._n))
        virtual[:, self._kept] = self._virtual
        if self._kept.size == n:
            weights = self._problem.parameters.effort_weights
            virtual[:, :n] -= weights * (self._forces()[:, :n] - self._known.torque)
        return virtual

    def _states(self) -> Array:
        """Return q and q' of all points, (k, 2 n_t)."""
        return np.concatenate([self._q, self._rate], axis=-1).reshape(-1, 2 * self._n)

    def _forces(self) -> Array:
        """Return M q'' + h of all points, (k, n_t)."""
        return self._problem.model.inverse_dynamics(
            self._states(), self._acceleration.reshape(-1, self._n),
            self._problem.parameters.physical)

    def _differentiate(self, values: Array) -> Array:
        """Return the derivatives by time of values (N, s + 2, m)."""
        rates: Array = (self._slope @ values) / self._found.steps[:, None, None]
        return rates
