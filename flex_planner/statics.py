"""The arm at rest, and how it rings: static deflection, holding torque, frequencies."""

from __future__ import annotations

from flex_planner.model import ArmModel
from flex_planner.validation import Array
import numpy as np
from scipy.linalg import block_diag, eigh

_MAX_ITERATIONS = 100


def modal_stiffness(model: ArmModel, rigidity: Array) -> Array:
    """Return the bending stiffness of the modal coordinates, shape (n_f, n_f) [N/m]."""
    blocks = [EI * link.mode_shapes().stiffness
              for EI, link in zip(rigidity, model.arm.links, strict=True) if link.modes]
    return np.atleast_2d(block_diag(*blocks)) if blocks else np.zeros((0, 0))


def equilibrium(model: ArmModel, positions: Array, p: Array) -> tuple[Array, Array]:
    """
    Return the arm at rest with its joints held.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    positions : numpy.ndarray, shape (n,)
        Joint angles [rad].
    p : numpy.ndarray
        Stacked `Parameters`.

    Returns
    -------
    coordinates : numpy.ndarray, shape (n_t,)
        With the static deflection.
    torque : numpy.ndarray, shape (n,)
        That holds it [N m].

    Raises
    ------
    ArithmeticError
        If the links are so soft that no equilibrium is found.

    """
    arm = model.arm
    n = arm.n_joints
    x = np.zeros((1, 2 * arm.n_coordinates))
    x[0, :n] = positions
    still = np.zeros((1, arm.n_coordinates))
    stiffness = modal_stiffness(model, p[1:1 + n])
    for _ in range(_MAX_ITERATIONS):
        force = model.inverse_dynamics(x, still, p)[0]
        if not arm.n_modes:
            return x[0, :n].copy(), force[:n]
        change = np.linalg.solve(stiffness, force[n:])
        x[0, n:arm.n_coordinates] -= change
        if np.abs(change).max() <= 1e-14 * arm.reach:
            return x[0, :arm.n_coordinates].copy(), model.inverse_dynamics(x, still, p)[0, :n]
    raise ArithmeticError('no static equilibrium found: the links are too soft for their load')


def clamped_modes(model: ArmModel, coordinates: Array, p: Array) -> tuple[Array, Array]:
    """
    Return the vibration of the arm with locked joints.

    Parameters
    ----------
    model : ArmModel
        n_f modal coordinates.
    coordinates : numpy.ndarray, shape (n_t,)
        Posture about which it vibrates.
    p : numpy.ndarray
        Stacked `Parameters`.

    Returns
    -------
    frequencies : numpy.ndarray, shape (n_f,)
        Angular, ascending [rad/s].
    vectors : numpy.ndarray, shape (n_f, n_f)
        Columns are modal displacements, orthonormal in the mass matrix.

    """
    n = model.arm.n_joints
    x = np.concatenate([coordinates, np.zeros_like(coordinates)])[None]
    mass = model.mass_and_energy(x, p)[0][0, n:, n:]
    squares, vectors = eigh(modal_stiffness(model, p[1:1 + n]), mass)
    return np.sqrt(squares), vectors


def residual_vibration(model: ArmModel, state: Array, rest: Array, p: Array) -> float:
    """
    Return how far the links still bend after the joints are locked [m].

    The largest distance of any point of a link from its place at rest, with all modes of the
    locked arm in phase: what the free vibration may reach but not exceed.

    Parameters
    ----------
    model : ArmModel
        n_t coordinates.
    state : numpy.ndarray, shape (2 n_t,)
        When the joints are locked.
    rest : numpy.ndarray, shape (n_t,)
        Equilibrium.
    p : numpy.ndarray
        Stacked `Parameters`.

    """
    arm = model.arm
    n, n_t = arm.n_joints, arm.n_coordinates
    if not arm.n_modes:
        return 0.0
    frequencies, vectors = clamped_modes(model, rest, p)
    x = np.concatenate([rest, np.zeros(n_t)])[None]
    mass = model.mass_and_energy(x, p)[0][0, n:, n:]
    to_normal = vectors.T @ mass
    displacement = to_normal @ (state[n:n_t] - rest[n:])
    rate = to_normal @ state[n_t + n:]
    amplitude = np.hypot(displacement, rate / frequencies)
    reach = [_bending(link.mode_shapes().shape(np.linspace(0, link.length, 41, dtype=float)),
                      vectors[part.start - n:part.stop - n], amplitude)
             for link, part in zip(arm.links, arm.modal_slices, strict=True) if link.modes]
    return max(reach)


def _bending(shapes: Array, vectors: Array, amplitude: Array) -> float:
    """Return the largest deflection of one link."""
    return float((np.abs(shapes @ vectors) @ amplitude).max())
