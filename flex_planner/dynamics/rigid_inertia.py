"""
The inertia of a rigid planar arm in all postures at once: bounds of its mass matrix.

Velocities are complex numbers, and a quarter turn is the imaginary unit. Those of the ends of the
links, v_k (the last is the tip), give the kinetic energy as ``v^H T v / 2`` with a constant
Hermitian T, because the velocity of any point that is fixed to a link is linear in those of its
ends; T is real where all mass lies on the axes. Between the absolute angles theta, the real part
of ``a_ij exp(1i (theta_j - theta_i))`` is M_ij. Rotors turn with the joints: they add to the
diagonal of M between the joint angles. What is said here of all postures is a consequence of
these facts, kept clear of rounding.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.arms.planar_only import require_planar
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
        Inertia that turns with each link [kg m^2]: its own, and of what is fixed to it.
    rotors : numpy.ndarray, shape (n,)
        Inertia that turns with each joint [kg m^2].
    carried : numpy.ndarray, shape (n,)
        Weights of the ends' velocities in that of the payload's centre of mass.

    """

    lengths: Array
    points: Array
    rotary: Array
    rotors: Array
    carried: Array

    @classmethod
    def of(cls, arm: Arm, payload_mass: float, payload_inertia: float) -> RigidInertia:
        """Return that of a planar arm, taken as rigid, with a payload [kg], [kg m^2]."""
        require_planar(arm, 'bounds of the inertia')
        n = arm.n_joints
        points, rotary = np.zeros((n, n), dtype=complex), np.zeros(n)
        for i, link in enumerate(arm.links):
            moment = complex(*link.first_moment)
            place = _point(n, i, moment / (link.mass * link.length))
            points += link.mass * np.outer(place.conj(), place)
            points[i, i] += arm.end_body(i).mass
            # about the centre of mass; less than none is rounding
            rotary[i] = arm.nodes[i].inertia + max(
                link.rotary_inertia - abs(moment)**2 / link.mass, 0.0)
            if i:
                rotary[i - 1] += arm.joints[i].housing.inertia
        carried = _point(n, n - 1, 1 + complex(*arm.payload_com) / arm.links[-1].length)
        points += payload_mass * np.outer(carried.conj(), carried)
        rotary[-1] += arm.nodes[-1].inertia + payload_inertia
        rotors = np.array([joint.motor.reflected_inertia for joint in arm.joints])
        rotary[0] += rotors[0]  # the first link turns with its joint
        if not points.imag.any():
            points = points.real
        return cls(np.array([link.length for link in arm.links]), points, rotary,
                   np.concatenate([[0.0], rotors[1:]]), carried)

    @property
    def carried_mobility(self) -> float:
        """Return the most that the squared speed of the payload's centre can be of it [1/kg]."""
        return float(_largest_forms(self._weighted_points()[None], self.carried.conj()[None])[0])

    @property
    def point_mobilities(self) -> Array:
        """
        Return the most that ``|v_k|^2`` can be of twice the kinetic energy, shape (n,) [1/kg].

        The diagonal of T^-1. Without rotors, and with all mass on the axes, the arm can move so,
        stretched or folded.

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
        """
        Return the moments about each joint of the mass that turns with its link, (n,) [kg m].

        What is beyond the link counts as if it were at its end. With a payload other than 0 they
        are at least as large as they are.

        """
        beyond, moments = 0.0, np.zeros(self.lengths.size)
        for i in reversed(range(self.lengths.size)):
            link = arm.links[i]
            beyond += arm.end_body(i).mass
            moments[i] = (abs(complex(*link.first_moment) + beyond * link.length)
                          + payload_mass * self.lengths[i] * abs(
                              self.carried[i] if i == arm.n_joints - 1 else 1))
            beyond += link.mass
        return moments

    @property
    def joint_mobilities(self) -> Array:
        """Return the most that squares of joint speeds can be of it, (n,) [1/(kg m^2)]."""
        n = self.lengths.size
        if n <= 2:
            return _largest_forms(self._extreme_postures(), np.eye(n))
        without = self._joint_mobilities_without_rotors()
        joints: Array = without / (1 + self.rotors * without)
        return joints

    def _joint_mobilities_without_rotors(self) -> Array:
        """Return them for the energy of the links alone."""
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
        # each joint has at most its mobility, so that shares of M do for each of them, and rotors
        # count in full
        mobilities = self._joint_mobilities_without_rotors()
        shares = [np.ones_like(torques), torques * np.sqrt(mobilities)]
        return tuple(np.diag(share / share.sum() / mobilities + self.rotors)[None]
                     for share in shares)

    def _extreme_postures(self) -> Array:
        """
        Return the mass matrices of one or two links, stretched and folded, (2, n, n).

        M is linear in the cosine of the one angle that matters, which is that between the links
        but for the direction in which the mass of the second lies.

        """
        n = self.lengths.size
        folds = np.array([[1.0] * n, [1.0] * (n - 1) + [-1.0]])
        sums = np.tril(np.ones((n, n)))
        matrices: Array = sums.T @ (self._absolute() * folds[:, :, None]
                                    * folds[:, None, :]) @ sums + np.diag(self.rotors)
        return matrices

    def _weighted_points(self) -> Array:
        """Return T with the rotary inertia: a link turns at ``|v_k - v_(k-1)| / L_k``."""
        differences = np.eye(self.lengths.size) - np.eye(self.lengths.size, k=-1)
        turning: Array = differences.T @ np.diag(self.rotary / self.lengths**2) @ differences
        return self.points + turning

    def _absolute(self) -> Array:
        """Return the sizes of a_ij: M between absolute angles where that is largest."""
        beyond = np.cumsum(np.cumsum(self.points[::-1, ::-1], axis=0), axis=1)[::-1, ::-1]
        matrix: Array = (np.abs(beyond) * np.outer(self.lengths, self.lengths)
                         + np.diag(self.rotary))
        return matrix


def _point(n: int, link: int, share: complex) -> Array:
    """
    Return the weights of the ends' velocities in that of a point of a link, (n,).

    The point is given relative to the link, as a share of its length, across imaginary.

    """
    weights = np.zeros(n, dtype=complex)
    weights[link] = share
    if link:
        weights[link - 1] = 1 - share
    return weights


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
    """Return the largest ``c^H M^-1 c`` over matrices (..., k, n, n) of vectors (m, n)."""
    n = vectors.shape[1]
    diagonal = np.diagonal(matrices, axis1=-2, axis2=-1).real
    positive = np.asarray((diagonal > 0).all(-1))
    size = np.sqrt(np.where(positive[..., None], diagonal, 1.0))
    left = matrices / (size[..., :, None] * size[..., None, :]) - _ROUNDING * np.eye(n)
    right = vectors / size[..., None, :]  # (..., k, m, n)
    forms = np.zeros(right.shape[:-1])
    # Gaussian elimination of positive definite matrices is backward stable
    for i in range(n):
        pivot = left[..., i, i].real
        positive &= pivot > 0
        pivot = np.where(positive, pivot, 1.0)
        forms += np.abs(right[..., i])**2 / pivot[..., None]
        factors = left[..., :, i] / pivot[..., None]
        right = right - right[..., i, None] * factors[..., None, :]
        left = left - factors[..., :, None] * left[..., None, i, :]
    worst: Array = np.where(positive[..., None], forms, np.inf).max(-2)
    return worst
