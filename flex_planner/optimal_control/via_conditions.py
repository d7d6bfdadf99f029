"""
What holds where a motion passes its via points, for the optimality conditions.

At the time of a via point ``c(q) = 0`` holds, and the costates of the positions may jump by
``C^T nu`` with ``C = dc/dq`` (Bryson and Ho, Applied Optimal Control, 1975, section 3.5). All else
goes on as it was: states, velocity costates, and so the torques of eq. (14). With as many columns
of C as there are conditions, those of the pivots, nu follows from the jumps of the pivots, and is
none of the unknowns.

"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_jacobian, tip_position
from flex_planner.base.validation import Array
from flex_planner.collocation.problem import SingularSystemError
from flex_planner.optimal_control.via_points import guess_via_times, via_postures, ViaPoint
import numpy as np
from numpy.typing import NDArray

# of a coordinate, for second derivatives of the tip
_NUDGE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class ViaConditions:
    """
    The via points of a motion with the times at which they are passed.

    Attributes
    ----------
    arm : Arm
        n joints, n_t coordinates.
    points : tuple of ViaPoint
        K of them.
    times : numpy.ndarray, shape (K,)
        Given or chosen [s].
    postures : numpy.ndarray, shape (K, n)
        Joint angles near them [rad].
    scale : numpy.ndarray, shape (4 n_t,)
        Magnitudes of (q, q', psi_1, psi_2).

    """

    arm: Arm
    points: tuple[ViaPoint, ...]
    times: Array
    postures: Array
    scale: Array

    @classmethod
    def of(cls, arm: Arm, points: tuple[ViaPoint, ...], ends: tuple[Array, Array],
           duration: float, scale: Array, times: Array | None = None) -> ViaConditions:
        """Return the via points of a motion between joint angles (n,) in a duration [s]."""
        if not points:
            none = np.zeros(0)
            return cls(arm, (), none, np.zeros((0, arm.n_joints)), scale)
        postures = via_postures(arm, points, *ends)
        if times is None:
            times = guess_via_times(points, np.vstack([ends[0], postures, ends[1]]), duration)
        return cls(arm, points, times, postures, scale)

    @property
    def given(self) -> NDArray[np.bool_]:
        """Return which times are given, shape (K,)."""
        return np.array([via.time is not None for via in self.points], dtype=bool)

    def miss(self, index: int, coordinates: Array) -> tuple[Array, Array]:
        """Return c at coordinates (n_t,), shape (k,), and C, shape (k, n_t)."""
        via = self.points[index]
        if via.point.size:
            return tip_position(self.arm, coordinates) - via.point, tip_jacobian(
                self.arm, coordinates)
        joints = np.flatnonzero(np.isfinite(via.positions))
        rows = np.zeros((joints.size, coordinates.size))
        rows[np.arange(joints.size), joints] = 1
        return coordinates[joints] - via.positions[joints], rows

    def join(self, index: int, before: Array, after: Array) -> tuple[Array, Array]:
        """
        Return the conditions at a via point.

        Parameters
        ----------
        index : int
            Of the via point.
        before, after : numpy.ndarray, shape (m,)
            The unknowns, (q, q', psi_1, psi_2) first, just before and after it.

        Returns
        -------
        residual : numpy.ndarray, shape (m,)
            What does not hold.
        rows : numpy.ndarray, shape (m, 2 m)
            Derivatives by both.

        """
        size, n_t = before.size, self.arm.n_coordinates
        residual, rows = after - before, np.hstack([-np.eye(size), np.eye(size)])
        q, jump = before[:n_t], residual[2 * n_t:3 * n_t].copy()
        miss, C = self.miss(index, q)
        pivots = self._pivots(index)
        others = np.setdiff1d(np.arange(n_t), pivots)
        at = 2 * n_t + pivots
        # in units of the costates, by which these rows are scaled
        unit = self.scale[at] / self.scale[pivots]
        residual[at], rows[at] = unit * miss, 0
        rows[at, :n_t] = unit[:, None] * C
        self._share_jump(index, (residual, rows), (q, jump), pivots, others)
        return residual, rows

    def _share_jump(self, index: int, found: tuple[Array, Array], point: tuple[Array, Array],
                    pivots: NDArray[np.intp], others: NDArray[np.intp]) -> None:
        """Let the costates of the other coordinates jump as those of the pivots do."""
        if not self.points[index].point.size:
            return  # they go on as they were
        (residual, rows), (q, jump), n_t = found, point, point[0].size
        C = tip_jacobian(self.arm, q)
        try:
            share = np.linalg.solve(C[:, pivots], C[:, others]).T
        except np.linalg.LinAlgError:
            raise SingularSystemError('the arm is stretched at a via point') from None
        nu: Array = np.asarray(np.linalg.solve(C[:, pivots].T, jump[pivots]), dtype=np.float64)
        bend = _second_derivative(self.arm, q, nu)
        at = 2 * n_t + others
        residual[at] -= share @ jump[pivots]
        rows[at[:, None], 2 * n_t + pivots] += share
        rows[at[:, None], residual.size + 2 * n_t + pivots] -= share
        rows[at, :n_t] += share @ bend[pivots] - bend[others]

    def _pivots(self, index: int) -> NDArray[np.intp]:
        """Return the coordinates whose costates give way to the conditions."""
        via = self.points[index]
        if not via.point.size:
            return np.flatnonzero(np.isfinite(via.positions))
        n = self.arm.n_joints
        at = np.concatenate([self.postures[index], np.zeros(self.arm.n_coordinates - n)])
        C = tip_jacobian(self.arm, at)
        if n < 2:
            return np.arange(2)
        groups = np.array(list(combinations(range(n), len(C))))
        sizes = [abs(float(np.linalg.det(C[:, group]))) for group in groups]
        best: NDArray[np.intp] = groups[int(np.argmax(sizes))]
        return best


def _second_derivative(arm: Arm, q: Array, nu: Array) -> Array:
    """Return the derivative of C^T nu by q, shape (n_t, n_t)."""
    steps = _NUDGE * np.eye(q.size)
    columns = [(tip_jacobian(arm, q + step) - tip_jacobian(arm, q - step)).T @ nu / (2 * _NUDGE)
               for step in steps]
    matrix: Array = np.array(columns).T
    return matrix
