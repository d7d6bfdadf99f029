"""
The inertia of a rigid planar arm in all postures at once: bounds of its mass matrix.

The velocities v_k of the joints' ends (k = 1 ... n, the last is the tip) give the kinetic energy
as ``sum_kl T_kl v_k . v_l / 2`` with a constant T, because the velocity of a uniform link is linear
along it. Between the absolute angles, M_ij = a_ij cos(theta_i - theta_j). What is said here of all
postures is a consequence of these two facts, kept clear of rounding.

"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
import numpy as np

# of the diagonal: a thousand times the rounding of matrices of this size
_ROUNDING = 1e-12
# of the angle of each of two links
_GRID_POINTS = 48
# an interpolation error h^2/8 a third larger, so that a grid twice as fine is never weaker
_NESTED = 4 / 3


@dataclass(frozen=True, slots=True, eq=False)
class RigidInertia:
    """
    What a rigid arm with its payload weighs, whatever its posture.

    Parameters
    ----------
    lengths : numpy.ndarray, shape (n,)
        Of the links [m].
    points : numpy.ndarray, shape (n, n)
        T without rotary inertia [kg].
    rotary : numpy.ndarray, shape (n,)
        Inertia of the nodes and the payload that turns with each link [kg m^2].

    """

    lengths: Array
    points: Array
    rotary: Array

    @classmethod
    def of(cls, arm: Arm, payload_mass: float, payload_inertia: float) -> RigidInertia:
        """Return that of an arm, taken as rigid, with a payload [kg], [kg m^2]."""
        n = arm.n_joints
        points, rotary = np.zeros((n, n)), np.zeros(n)
        for i, link in enumerate(arm.links):
            points[i, i] += link.mass / 3 + arm.nodes[i + 1].mass
            rotary[i] = arm.nodes[i].inertia
            if i:
                points[i - 1, i - 1] += link.mass / 3
                points[i - 1, i] += link.mass / 6
                points[i, i - 1] += link.mass / 6
        points[-1, -1] += payload_mass
        rotary[-1] += arm.nodes[-1].inertia + payload_inertia
        return cls(np.array([link.length for link in arm.links]), points, rotary)

    @property
    def point_mobilities(self) -> Array:
        """
        Return the most that v_k . v_k can be of twice the kinetic energy, shape (n,) [1/kg].

        The diagonal of T^-1; stretched or folded, the arm can move so.

        """
        return _largest_forms(self._weighted_points()[None], np.eye(self.lengths.size))

    @property
    def turning_mobilities(self) -> Array:
        """
        Return the most that squares of absolute link speeds can be of it [1/(kg m^2)].

        The same for ``|v_k - v_(k-1)| / L_k``, shape (n,).

        """
        differences = np.eye(self.lengths.size) - np.eye(self.lengths.size, k=-1)
        return _largest_forms(self._weighted_points()[None], differences) / self.lengths**2

    def first_moments(self, arm: Arm, payload_mass: float) -> Array:
        """Return the mass beyond each joint times its distance along the link, (n,) [kg m]."""
        beyond, moments = payload_mass, np.zeros(self.lengths.size)
        for i in reversed(range(self.lengths.size)):
            beyond += arm.nodes[i + 1].mass
            moments[i] = (beyond + arm.links[i].mass / 2) * arm.links[i].length
            beyond += arm.links[i].mass
        return moments

    def lower_bounds(self, grid_points: int = _GRID_POINTS) -> tuple[Array, ...]:
        """
        Return sets of matrices (k, n, n) that lie below the mass matrices of all postures.

        For each set and every posture, M between the joint angles is at least some convex
        combination of the set's matrices. So a function that is convex and falls as its matrix
        grows, such as ``c^T M^-1 c``, is nowhere larger than at one of them.

        Parameters
        ----------
        grid_points : int
            Per turn of each angle, for three links; even.

        """
        n = self.lengths.size
        if n <= 2:
            # M is linear in the cosine of the one angle that matters
            return (self._joint_matrices(np.array([[1.0] * n, [1.0] * (n - 1) + [-1.0]])),)
        sets = [self._diagonal_bound()]
        if n == 3:
            sets.append(self._grid_bound(grid_points))
        return tuple(sets)

    def _weighted_points(self) -> Array:
        """Return T with the rotary inertia, of which each link's speed is |v_k - v_(k-1)| / L_k."""
        differences = np.eye(self.lengths.size) - np.eye(self.lengths.size, k=-1)
        turning: Array = differences.T @ np.diag(self.rotary / self.lengths**2) @ differences
        return self.points + turning

    def _absolute(self) -> Array:
        """Return a_ij, the mass matrix between absolute angles of the stretched arm."""
        beyond = np.cumsum(np.cumsum(self.points[::-1, ::-1], axis=0), axis=1)[::-1, ::-1]
        matrix: Array = beyond * np.outer(self.lengths, self.lengths) + np.diag(self.rotary)
        return matrix

    def _joint_matrices(self, signs: Array) -> Array:
        """Return the mass matrices of arms stretched and folded as signs (k, n) say."""
        return _between_joints(self._absolute() * signs[:, :, None] * signs[:, None, :])

    def _diagonal_bound(self) -> Array:
        """Return one diagonal matrix: each joint may be as fast as the energy lets it be alone."""
        links = np.sqrt(self.turning_mobilities)
        joints = links + np.concatenate([[0.0], links[:-1]])
        return np.diag(1 / (links.size * joints**2))[None]

    def _grid_bound(self, count: int) -> Array:
        """Return the matrices on a grid of both angles, less what may be missing between."""
        step = 2 * np.pi / count
        # links 2 and 3 against link 1; mirror images have the same inertia
        angles = np.array([(0.0, second, third) for second, third in product(
            step * np.arange(count // 2 + 1), step * np.arange(count))])
        absolute = self._absolute()
        cosines = np.cos(angles[:, :, None] - angles[:, None, :])
        # of cosines interpolated along one angle, or along two
        missing = _NESTED * step**2 / 8 * np.array([[0, 1, 1], [1, 0, 2], [1, 2, 0]])
        size = np.sqrt(np.diag(absolute))
        # a symmetric matrix is less than the diagonal of its weighted row sums
        margin = size * ((absolute * missing) @ (1 / size))
        return _between_joints(absolute * cosines - np.diag(margin))


def _between_joints(absolute: Array) -> Array:
    """Return matrices (k, n, n) between absolute angles as those between joint angles."""
    sums = np.tril(np.ones(absolute.shape[1:]))
    matrices: Array = sums.T @ absolute @ sums
    return matrices


def largest_form(sets: tuple[Array, ...], vectors: Array) -> Array:
    """
    Return bounds of ``c^T M^-1 c`` over all postures, for vectors (m, n), shape (m,).

    Parameters
    ----------
    sets : tuple of numpy.ndarray, shape (k, n, n)
        Of `RigidInertia.lower_bounds`, or convex functions of them that grow with them.
    vectors : numpy.ndarray, shape (m, n)
        c.

    Returns
    -------
    numpy.ndarray, shape (m,)
        Infinite where no set has positive definite matrices only.

    """
    forms: Array = np.min([_largest_forms(matrices, vectors) for matrices in sets], axis=0)
    return forms


def _largest_forms(matrices: Array, vectors: Array) -> Array:
    """Return the largest ``c^T M^-1 c`` over matrices (..., k, n, n) of vectors (m, n)."""
    n = vectors.shape[1]
    diagonal = np.diagonal(matrices, axis1=-2, axis2=-1)
    positive = (diagonal > 0).all(-1)
    size = np.sqrt(np.where(positive[..., None], diagonal, 1.0))
    left = matrices / (size[..., :, None] * size[..., None, :]) - _ROUNDING * np.eye(n)
    right = vectors / size[..., None, :]  # (..., k, m, n)
    forms = np.zeros(right.shape[:-1])
    # Gaussian elimination of positive definite matrices is backward stable
    for i in range(n):
        pivot = left[..., i, i]
        positive &= pivot > 0
        pivot = np.where(positive, pivot, 1.0)
        forms += right[..., i]**2 / pivot[..., None]
        factors = left[..., :, i] / pivot[..., None]
        right = right - right[..., i, None] * factors[..., None, :]
        left = left - factors[..., :, None] * left[..., None, i, :]
    worst: Array = np.where(positive[..., None], forms, np.inf).max(-2)
    return worst
