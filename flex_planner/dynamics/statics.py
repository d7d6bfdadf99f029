"""The arm at rest, and how it rings: static deflection, holding torque, natural frequencies."""

from __future__ import annotations

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel, Parameters
import numpy as np
from scipy.linalg import eigh

_MAX_ITERATIONS = 50
_STATIONS = 41


def equilibrium(model: ArmModel, positions: Array,
                parameters: Parameters) -> tuple[Array, Array]:
    """
    Return the arm at rest with its joints held.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    positions : numpy.ndarray, shape (n,)
        Joint angles [rad].
    parameters : Parameters
        Payload and stiffness.

    Returns
    -------
    coordinates : numpy.ndarray, shape (n_t,)
        With the static deflection.
    torque : numpy.ndarray, shape (n,)
        That holds it [N m].

    Raises
    ------
    NoEquilibriumError
        If the links are so soft that no stable one is found.

    """
    n, p = model.arm.n_joints, parameters.stacked()
    q = np.concatenate([positions, np.zeros(model.arm.n_modes)])
    for _ in range(_MAX_ITERATIONS):
        force, stiffness = model.static_forces(q[None], p)
        if not model.arm.n_modes:
            return q, force[0]
        change = np.linalg.solve(stiffness[0, n:, n:], force[0, n:])
        q[n:] -= change
        if np.abs(change).max() <= 1e-13 * model.arm.reach:
            if np.linalg.eigvalsh(stiffness[0, n:, n:])[0] <= 0:
                break  # balanced, but it would buckle
            return q, model.static_forces(q[None], p)[0][0, :n]
    degrees = ', '.join(f'{angle:.4g}' for angle in np.degrees(positions))
    raise NoEquilibriumError('no static equilibrium was found at joint angles '
                             f'({degrees}) deg: the links are too soft for their load')


def natural_modes(model: ArmModel, coordinates: Array, parameters: Parameters, *,
                  locked: bool) -> tuple[Array, Array]:
    """
    Return the small vibrations of the arm about a posture, without damping.

    Parameters
    ----------
    model : ArmModel
        n_t coordinates, n_f of them modal.
    coordinates : numpy.ndarray, shape (n_t,)
        An equilibrium.
    parameters : Parameters
        Payload and stiffness.
    locked : bool
        Whether the joints are held still; otherwise they are free and the first frequencies are
        those of the swinging arm, or zero.

    Returns
    -------
    frequencies : numpy.ndarray, shape (n_f,) or (n_t,)
        Angular, ascending [rad/s]; NaN where the equilibrium is unstable.
    vectors : numpy.ndarray, shape (n_f, n_f) or (n_t, n_t)
        Columns are displacements, orthonormal in the mass matrix.

    """
    first, p = model.arm.n_joints if locked else 0, parameters.stacked()
    x = np.concatenate([coordinates, np.zeros_like(coordinates)])[None]
    mass = model.mass_and_energy(x, p)[0][0, first:, first:]
    stiffness = model.static_forces(coordinates[None], p)[1][0, first:, first:]
    if not mass.size:
        return np.zeros(0), np.zeros((0, 0))
    squares, vectors = eigh(stiffness, mass)
    # a free joint has no stiffness: rounding makes its square slightly negative
    squares[np.abs(squares) < 1e-10 * np.abs(squares).max(initial=0)] = 0
    return np.sqrt(np.where(squares < 0, np.nan, squares)), vectors


def residual_vibration(model: ArmModel, state: Array, rest: Array,
                       parameters: Parameters) -> float:
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
    parameters : Parameters
        Payload and stiffness.

    """
    arm = model.arm
    n, n_t = arm.n_joints, arm.n_coordinates
    if not arm.n_modes:
        return 0.0
    frequencies, vectors = natural_modes(model, rest, parameters, locked=True)
    displacement = np.linalg.solve(vectors, state[n:n_t] - rest[n:])
    rate = np.linalg.solve(vectors, state[n_t + n:])
    amplitude = np.hypot(displacement, rate / frequencies)
    return max(float((np.abs(_bending(model, link, vectors)) @ amplitude).max())
               for link in range(n) if arm.links[link].modes)


def _bending(model: ArmModel, index: int, vectors: Array) -> Array:
    """Return the deflections of a link's stations in each mode, shape (stations, n_f)."""
    link, part = model.arm.links[index], model.arm.modal_slices[index]
    stations = np.linspace(0, link.length, _STATIONS, dtype=float)
    shapes = link.mode_shapes().shape(stations)
    n = model.arm.n_joints
    bending: Array = shapes @ vectors[part.start - n:part.stop - n]
    return bending
