"""Whether a PD that is sampled and held keeps an arm still, or shakes it."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import ControlledArm
import numpy as np

_STEP = 1e-6
# of the series, for matrices of norm 1/2: the first that is left out is below 1e-16
_TERMS = 14


def feedback_growth(arm: ControlledArm, positions: Array) -> float:
    """
    Return how fast small deviations grow under the PD, where they do so fastest [1/s].

    The logarithm of the spectral radius of a period of the controller, by its length, for the
    equations of motion linearised at rest with straight links; below 0 where all deviations die
    away.

    Parameters
    ----------
    arm : ControlledArm
        n joints.
    positions : numpy.ndarray, shape (k, n)
        Joint angles at which to look [rad].

    """
    straight = np.zeros((len(positions), arm.dynamics.arm.n_passive))
    return max(float(np.log(_spectral_radius(arm, posture))) / arm.controller.period
               for posture in np.hstack([positions, straight]))


def _spectral_radius(arm: ControlledArm, posture: Array) -> float:
    """Return the largest absolute eigenvalue of one period."""
    gains, n, n_t = arm.controller.gains, arm.dynamics.arm.n_joints, posture.size
    free, forced = _linearised(arm, posture)
    system = np.zeros((2 * n_t + n, 2 * n_t + n))
    system[:2 * n_t] = np.hstack([free, forced])
    period = _exponential(system * arm.controller.period)[:2 * n_t]
    feedback = np.zeros((n, 2 * n_t))
    feedback[:, :n], feedback[:, n_t:n_t + n] = -np.diag(gains.stiffness), -np.diag(gains.damping)
    closed = period[:, :2 * n_t] + period[:, 2 * n_t:] @ feedback
    return float(np.abs(np.linalg.eigvals(closed)).max())


def _linearised(arm: ControlledArm, posture: Array) -> tuple[Array, Array]:
    """Return A and B of x' = A x + B u at rest, by central differences."""
    size, n = 2 * posture.size, arm.dynamics.arm.n_joints
    point = np.concatenate([posture, np.zeros(size - posture.size + n)])
    moved = point + _STEP * np.vstack([np.eye(size + n), -np.eye(size + n)])
    rates = arm.dynamics.forward_dynamics(moved[:, :size], moved[:, size:],
                                          arm.parameters.physical)
    slopes = ((rates[:size + n] - rates[size + n:]) / (2 * _STEP)).T
    return slopes[:, :size], slopes[:, size:]


def _exponential(matrix: Array) -> Array:
    """Return the exponential by its series, for which small matrices need no more."""
    squarings = max(0, int(np.ceil(np.log2(2 * np.abs(matrix).sum(axis=1).max() + 1))))
    small, result = matrix / 2**squarings, np.eye(len(matrix))
    for term in range(_TERMS, 0, -1):
        result = np.eye(len(matrix)) + small @ result / term
    for _ in range(squarings):
        result = result @ result
    return result
