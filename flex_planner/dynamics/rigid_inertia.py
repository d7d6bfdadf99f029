"""
The inertia of a rigid planar arm in all postures at once: bounds of its mass matrix.

The velocities v_k of the ends of the links (the last is the tip) give the kinetic energy as
``sum_kl T_kl v_k . v_l / 2`` with a constant T, because the velocity of a uniform link is linear
along it. Between the absolute angles, M_ij = a_ij cos(theta_i - theta_j). What is said here of
all postures is a consequence of these two facts, kept clear of rounding.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
import numpy as np

# of the diagonal: a thousand times the rounding of matrices of this size
_ROUNDING = 1e-12


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

    @property
    def joint_mobilities(self) -> Array:
        """Return the most that squares of joint speeds can be of it, (n,) [1/(kg m^2)]."""
        n = self.lengths.size
        if n <= 2:
            return _largest_forms(self._extreme_postures(), np.eye(n))
        links = np.sqrt(self.turning_mobilities)
        joints: Array = (links + np.concatenate([[0.0], links[:-1]]))**2
        return joints

    def lower_bounds(self, torques: Array) -> tuple[Array, ...]:
        """
        Return sets of matrices (k, n, n) that lie below the mass matrices of all postures.

        For each set and every posture, M between the joint angles is at least some convex
        combination of the set's matrices. So a function that is convex and falls as its matrix
        grows, such as ``c^T M^-1 c``, is nowhere larger than at one of them.

        Parameters
        ----------
        torques : numpy.ndarray, shape (n,)
            Of the motors, in any unit: the bounds are to be close for such vectors c.

        """
        if self.lengths.size <= 2:
            return (self._extreme_postures(),)
        # each joint has at most its mobility, so that shares of M do for each of them
        mobilities = self.joint_mobilities
        shares = [np.ones_like(torques), torques * np.sqrt(mobilities)]
        return tuple(np.diag(share / share.sum() / mobilities)[None] for share in shares)

    def _extreme_postures(self) -> Array:
        """
        Return the mass matrices of one or two links, stretched and folded, (2, n, n).

        M is linear in the cosine of the one angle that matters.

        """
        n = self.lengths.size
        folds = np.array([[1.0] * n, [1.0] * (n - 1) + [-1.0]])
        sums = np.tril(np.ones((n, n)))
        matrices: Array = sums.T @ (
            self._absolute() * folds[:, :, None] * folds[:, None, :]) @ sums
        return matrices

    def _weighted_points(self) -> Array:
        """Return T with the rotary inertia: a link turns at ``|v_k - v_(k-1)| / L_k``."""
        differences = np.eye(self.lengths.size) - np.eye(self.lengths.size, k=-1)
        turning: Array = differences.T @ np.diag(self.rotary / self.lengths**2) @ differences
        return self.points + turning

    def _absolute(self) -> Array:
        """Return a_ij, the mass matrix between absolute angles of the stretched arm."""
        beyond = np.cumsum(np.cumsum(self.points[::-1, ::-1], axis=0), axis=1)[::-1, ::-1]
        matrix: Array = beyond * np.outer(self.lengths, self.lengths) + np.diag(self.rotary)
        return matrix


def largest_form(sets: tuple[Array, ...], vectors: Array) -> Array:
    """
    Return bounds of ``c^T X^-1 c`` over all postures, for vectors c.

    Parameters
    ----------
    sets : tuple of numpy.ndarray, shape (..., k, n, n)
        Of `RigidInertia.lower_bounds`, or ``X = a M + B`` of them with a > 0, for several a.
    vectors : numpy.ndarray, shape (m, n)
        c.

    Returns
    -------
    numpy.ndarray, shape (..., m)
        Infinite where no set has positive definite matrices only.

    """
    forms: Array = np.min([_largest_forms(matrices, vectors) for matrices in sets], axis=0)
    return forms


def _largest_forms(matrices: Array, vectors: Array) -> Array:
    """Return the largest ``c^T M^-1 c`` over matrices (..., k, n, n) of vectors (m, n)."""
    n = vectors.shape[1]
    diagonal = np.diagonal(matrices, axis1=-2, axis2=-1)
    positive = np.asarray((diagonal > 0).all(-1))
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
