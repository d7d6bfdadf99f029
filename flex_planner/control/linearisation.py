"""Equations of motion linearised at many points, and what they make of a step in time."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
import numpy as np

_STEP = 1e-6
# of the series, for matrices of norm 1/2: the error of the first that is left out is 1e-8
_TERMS = 6


def linearise_dynamics(dynamics: ArmDynamics, states: Array, torques: Array,
                       physical: Array) -> tuple[Array, Array]:
    """
    Return A and B of x' = A x + B u at points, by differences.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    states, torques : numpy.ndarray, shape (k, 2 n_t) and (k, n)
        Points.
    physical : numpy.ndarray
        `PhysicalParameters.physical`.

    Returns
    -------
    A, B : numpy.ndarray, shape (k, 2 n_t, 2 n_t) and (k, 2 n_t, n)

    """
    count, size, n = len(states), states.shape[1], torques.shape[1]
    moves = _STEP * np.vstack([np.eye(size), -np.eye(size)])
    moved = (states + moves[:, None]).reshape(-1, size)
    rates = dynamics.forward_dynamics(moved, np.tile(torques, (2 * size, 1)), physical)
    ahead, behind = rates.reshape(2, size, count, size)
    # accelerations are linear in the torques: any difference will do
    pushed = np.concatenate([torques[None], torques + np.eye(n)[:, None]]).reshape(-1, n)
    forced = dynamics.forward_dynamics(np.tile(states, (n + 1, 1)), pushed, physical)
    forced = forced.reshape(n + 1, count, size)
    return (((ahead - behind) / (2 * _STEP)).transpose(1, 2, 0),
            (forced[1:] - forced[0]).transpose(1, 2, 0))


def hold_inputs(A: Array, B: Array, step: float) -> tuple[Array, Array]:
    """
    Return F and G of x(t + step) = F x + G u for a held u.

    Parameters
    ----------
    A, B : numpy.ndarray, shape (..., m, m) and (..., m, n)
        Of x' = A x + B u.
    step : float
        [s].

    """
    size, inputs = B.shape[-2:]
    system = np.zeros((*A.shape[:-2], size + inputs, size + inputs))
    system[..., :size, :size], system[..., :size, size:] = A, B
    scale = _balance(system)
    held = _exponential(system * (step * scale / scale[:, None])) * (scale[:, None] / scale)
    return held[..., :size, :size], held[..., :size, size:]


def _balance(matrices: Array) -> Array:
    """Return powers of 2 (m,) by which unknowns are scaled so that rows and columns are alike."""
    from scipy.linalg import matrix_balance  # see `ArmDynamics.prepare`

    size = matrices.shape[-1]
    largest = np.abs(matrices).reshape(-1, size, size).max(axis=0, initial=0.0)
    _, (scale, _) = matrix_balance(largest, permute=False, separate=True)
    return np.asarray(scale, dtype=np.float64)


def _exponential(matrices: Array) -> Array:
    """Return exponentials by their series."""
    largest = float(np.abs(matrices).sum(axis=-1).max(initial=0.0))
    squarings = max(0, int(np.ceil(np.log2(2 * largest + 1))))
    one = np.eye(matrices.shape[-1])
    small, result = matrices / 2**squarings, one
    for term in range(_TERMS, 0, -1):
        result = one + small @ result / term
    for _ in range(squarings):
        result = result @ result
    return result
