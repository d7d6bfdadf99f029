"""The planned torque as a function of time, as the certificate applies it."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.mesh import switching_times
from flex_planner.dynamics.integration import PiecewisePolynomial
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.sampled_motion import sample_motion
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

_SAME_TIME = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class PlannedTorque:
    """
    The torque of eq. (14) as a function of time.

    The torque without bounds and the speeds are polynomials in every interval of the mesh; the
    bounds of eq. (15) are applied last, so that the corners where a motor switches stay sharp.

    Attributes
    ----------
    pieces : PiecewisePolynomial
        Free torques, then joint speeds, 2 n values.
    limits : TorqueLimits
        Of the motors.

    """

    pieces: PiecewisePolynomial
    limits: TorqueLimits

    @classmethod
    def of(cls, problem: MotionProblem, solution: CollocationSolution) -> PlannedTorque:
        """Interpolate the torque of a solution, cut where a motor switches."""
        cuts = switching_times(problem, solution)
        solution = solution.without_jumps()  # torques have none, but bend there
        if cuts.size:
            solution = solution.on_mesh(_merge(solution.mesh, cuts))
        n, n_t = problem.model.arm.n_joints, problem.model.arm.n_coordinates
        points = sample_motion(problem, solution)
        values = np.hstack([points.controls.free_torque, points.z[:, n_t:n_t + n]])
        values = values.reshape(solution.intervals, points.theta.size, -1)
        return cls(PiecewisePolynomial.through(solution.mesh, points.theta, values),
                   problem.conditions.limits)

    @property
    def breaks(self) -> Array:
        """Return the times at which the torque may bend [s]."""
        return self.pieces.breaks

    def basis(self, shares: Array) -> Array:
        """Return a matrix for `within`, at shares (k,) of an interval."""
        return self.pieces.basis(shares)

    def __call__(self, time: float) -> Array:
        """Return the torques at one time, shape (n,)."""
        return self._bounded(self.pieces(time))

    def within(self, interval: int, basis: Array) -> Array:
        """Return the torques where `basis` was taken, in a mesh interval, shape (k, n)."""
        return self._bounded(basis @ self.pieces.coefficients[interval])

    def everywhere(self, basis: Array) -> Array:
        """Return `within` of all mesh intervals, shape (N, k, n)."""
        count, size, width = self.pieces.coefficients.shape
        # one product, and joint by joint: NumPy is slow where many axes are short
        flat = self.pieces.coefficients.transpose(2, 0, 1).reshape(width * count, size) @ basis.T
        free, speeds = flat.reshape(2, width // 2, -1)
        torques = self.limits.column().bound(free, speeds)
        return np.ascontiguousarray(torques.T).reshape(count, len(basis), width // 2)

    def _bounded(self, values: Array) -> Array:
        n = values.shape[-1] // 2
        torque: Array = self.limits.bound(values[..., :n], values[..., n:])
        return torque


def _merge(mesh: Array, cuts: Array) -> Array:
    """Return a mesh with cuts added, except those at its nodes."""
    distance = np.abs(cuts[:, None] - mesh).min(axis=1)
    new = cuts[distance > _SAME_TIME * (mesh[-1] - mesh[0])]
    merged: Array = np.sort(np.concatenate([mesh, new]))
    return merged
