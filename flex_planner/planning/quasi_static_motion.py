"""
The motion of an arm whose stiff parts follow quasi-statically, from one with these parts rigid.

Each stiff coordinate is where its load, inertia included, holds it without vibration (the slow
manifold of the dynamics). The joints move as they did, by the torque that this takes. Their path
is the best one of the arm with rigid parts; that of the arm as it is differs by one over the
stiffness, and the effort by its square.

"""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, differentiation_matrix
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.ringing import Mask
import numpy as np

# of the bending: the load hardly depends on it
_CORRECTIONS = 3


def follow_quasi_statically(problem: MotionProblem, reduced: MotionProblem,
                            found: CollocationSolution,
                            kept: Mask) -> tuple[CollocationSolution, float]:
    """
    Return the motion of all coordinates, and the effort left out: what its torque lacks in J.

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
    motion.bend()
    return motion.solution(), motion.effort_left_out()


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
        self._position_costates = z[:, 2 * half:3 * half]
        self._virtual = np.linalg.solve(mass, z[:, 3 * half:, None])[..., 0]

    def bend(self) -> None:
        """
        Bend stiff parts as their load does, and find how fast that changes.

        What the bending itself adds to the load by accelerating is left out, for it is smaller
        once more by the square of the frequency; it would be wrong where a motor switches within a
        period.

        """
        model, p, stiff = self._problem.model, self._problem.parameters.physical, self._stiff
        stiffness = model.static_forces(self._q.reshape(-1, self._n), p)[1][:, stiff[:, None],
                                                                            stiff]
        for _ in range(_CORRECTIONS):
            surplus = self._forces(self._q, self._rate, self._acceleration)[:, stiff, None]
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
        z[:, 2 * n_t + self._kept] = self._position_costates
        stiff = self._stiff
        change = self._differentiate(psi_2[:, stiff].reshape(*self._q.shape[:2], -1))
        # psi_2' = ... - psi_1
        rate = problem.model.optimality(z, problem.p)[:, 3 * n_t + stiff]
        z[:, 2 * n_t + stiff] = rate - change.reshape(rate.shape)
        stacked = z.reshape(*self._q.shape[:2], -1)
        nodes = np.vstack([stacked[:, 0], stacked[-1:, -1]])
        return CollocationSolution(self._found.mesh, nodes,
                                   self._differentiate(stacked)[:, 1:-1], self._found.rule)

    def effort_left_out(self) -> float:
        """Return what the torque that all parts need adds to J, or spares, to first order."""
        if self._is_corrected():
            return 0.0
        weights, found = self._problem.parameters.effort_weights, self._found
        rates = (weights * self._known.torque * self._change_of_torque()).sum(axis=-1)
        shares = np.concatenate([[0.0], found.rule.weights, [0.0]])
        return abs(float(found.steps @ (rates.reshape(self._q.shape[:2]) @ shares)))

    def _find_virtual(self) -> Array:
        """Return M^-1 psi_2: the torque without bounds is the share -1/R of it at the joints."""
        n = self._problem.model.arm.n_joints
        virtual = np.zeros((self._virtual.shape[0], self._n))
        virtual[:, self._kept] = self._virtual
        if self._is_corrected():
            virtual[:, :n] -= self._problem.parameters.effort_weights * self._change_of_torque()
        return virtual

    def _is_corrected(self) -> bool:
        """
        Return whether the torque is that which the bending takes.

        It is left where soft parts would need more to move as before, or where a motor is on its
        limit: half of what the bending takes leads further away than nothing.

        """
        return (self._kept.size == self._problem.model.arm.n_joints
                and np.array_equal(self._known.torque, self._known.free_torque))

    def _change_of_torque(self) -> Array:
        """
        Return what moving the joints as before takes beyond the torque of rigid parts.

        In the mean of its vibrations the arm does not start at rest where it does: what the first
        load bends takes the joints along, as no impulse acts. A cubic polynomial leads from there
        to the goal.

        """
        n, kept, stiff = self._known.torque.shape[1], self._kept, self._stiff
        mass = self._problem.model.mass_and_energy(
            self._problem.start[None], self._problem.parameters.physical)[0][0]
        carried = np.linalg.solve(mass[np.ix_(kept, kept)], mass[np.ix_(kept, stiff)])
        start = self._problem.start.reshape(2, -1)[:, stiff]
        first = np.stack([self._q[0, 0, stiff], self._rate[0, 0, stiff]])
        shift = _fade(-(first - start) @ carried.T, self._found.times_at(self._theta))
        q, rate, acceleration = (np.array(each) for each in (self._q, self._rate,
                                                             self._acceleration))
        for values, moved in zip((q, rate, acceleration), shift, strict=True):
            values[..., kept] += moved
        beyond: Array = self._forces(q, rate, acceleration)[:, :n] - self._known.torque
        return beyond

    def _states(self) -> Array:
        """Return q and q' of all points, (k, 2 n_t)."""
        states: Array = np.concatenate([self._q, self._rate], axis=-1)
        return states.reshape(-1, 2 * self._n)

    def _forces(self, q: Array, rate: Array, acceleration: Array) -> Array:
        """Return M q'' + h of all points, (k, n_t)."""
        states = np.concatenate([q, rate], axis=-1).reshape(-1, 2 * self._n)
        return self._problem.model.inverse_dynamics(
            states, acceleration.reshape(-1, self._n), self._problem.parameters.physical)

    def _differentiate(self, values: Array) -> Array:
        """Return the derivatives by time of values (N, s + 2, m)."""
        rates: Array = (self._slope @ values) / self._found.steps[:, None, None]
        return rates


def _fade(start: Array, times: Array) -> tuple[Array, Array, Array]:
    """Return a cubic polynomial from a place and rate (2, m) to none, with its derivatives."""
    duration = times[-1, -1]
    s = (times / duration)[..., None]
    place, slope = start[0], duration * start[1]
    return (place * (1 - s)**2 * (1 + 2 * s) + slope * s * (1 - s)**2,
            (place * 6 * s * (s - 1) + slope * (1 - s) * (1 - 3 * s)) / duration,
            (place * (12 * s - 6) + slope * (6 * s - 4)) / duration**2)
