"""The arm at rest, and how it rings: static deflection, holding torque, natural frequencies."""

from __future__ import annotations

from flex_planner.arms.joint_units import units_of
from flex_planner.arms.kinematics import link_deflections, tip_jacobian, twist_levers
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import InvalidTaskError, NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
import numpy as np

_MAX_ITERATIONS = 50
_LEAST_INERTIA = 1e-14  # of a motion relative to those of single coordinates; rounding is 1e-16


def equilibrium(dynamics: ArmDynamics, positions: Array,
                parameters: PhysicalParameters) -> tuple[Array, Array]:
    """
    Return the arm at rest with its joints held.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    positions : numpy.ndarray, shape (n,)
        Joint angles [rad].
    parameters : PhysicalParameters
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
    n, p = dynamics.arm.n_joints, parameters.physical
    q = np.concatenate([positions, np.zeros(dynamics.arm.n_passive)])
    for _ in range(_MAX_ITERATIONS):
        force, stiffness = dynamics.static_forces(q[None], p)
        if not dynamics.arm.n_passive:
            return q, force[0]
        try:
            change = np.linalg.solve(stiffness[0, n:, n:], force[0, n:])
        except np.linalg.LinAlgError:  # about to buckle
            break
        q[n:] -= change
        if np.abs(change).max() <= 1e-13 * dynamics.arm.reach:
            if np.linalg.eigvalsh(stiffness[0, n:, n:])[0] <= 0:
                break  # balanced, but it would buckle
            return q, dynamics.static_forces(q[None], p)[0][0, :n]
    units = [units_of(joint) for joint in dynamics.arm.joints]
    shown = ', '.join(f'{unit.scale * value:.4g}'
                      for unit, value in zip(units, positions, strict=True))
    unit = ', '.join(dict.fromkeys(unit.position for unit in units))
    raise NoEquilibriumError('no static equilibrium was found at joint angles '
                             f'({shown}) {unit}: the links are too soft for their load')


def natural_modes(dynamics: ArmDynamics, coordinates: Array, parameters: PhysicalParameters, *,
                  locked: bool) -> tuple[Array, Array]:
    """
    Return the small vibrations of the arm about a posture, without damping.

    Parameters
    ----------
    dynamics : ArmDynamics
        n_t coordinates, n_f of them modal.
    coordinates : numpy.ndarray, shape (n_t,)
        An equilibrium.
    parameters : PhysicalParameters
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

    Raises
    ------
    InvalidTaskError
        See `check_inertia`.

    """
    from scipy.linalg import eigh  # see `ArmDynamics.prepare`

    first, p = dynamics.arm.n_joints if locked else 0, parameters.physical
    x = np.concatenate([coordinates, np.zeros_like(coordinates)])[None]
    mass = dynamics.mass_and_energy(x, p)[0][0, first:, first:]
    stiffness = dynamics.static_forces(coordinates[None], p)[1][0, first:, first:]
    if not mass.size:
        return np.zeros(0), np.zeros((0, 0))
    check_inertia(mass)
    squares, vectors = eigh(stiffness, mass)
    # a free joint has no stiffness: rounding makes its square slightly negative
    squares[np.abs(squares) < 1e-10 * np.abs(squares).max(initial=0)] = 0
    return np.sqrt(np.where(squares < 0, np.nan, squares)), vectors


def check_inertia(mass: Array) -> None:
    """
    Check that a mass matrix is positive definite beyond rounding.

    Raises
    ------
    InvalidTaskError
        If what moves is so unequal that the inertia of the lightest part is lost.

    """
    scale = np.sqrt(np.diag(mass))
    least = np.linalg.eigvalsh(mass / np.outer(scale, scale))[0] if (scale > 0).all() else 0.0
    if not least > _LEAST_INERTIA:
        raise InvalidTaskError('the links, nodes and the payload are so unequal in mass or length '
                               'that the inertia of the lightest is lost in rounding: nothing can '
                               'be computed with them')


def residual_vibration(dynamics: ArmDynamics, state: Array, rest: Array,
                       parameters: PhysicalParameters) -> float:
    """
    Return how far the links still bend after the joints are locked [m].

    The largest distance of any point of a link from its place at rest, or of the stretched arm's
    tip by the twist of an elastic joint, with all modes of the locked arm in phase: what the free
    vibration may reach but not exceed. Of a spatial arm, whose links may twist, that of its tip
    counts, too. What stops joints that still turn acts on them alone, so
    the momenta of the modes stay as they are, and their rates jump.

    Parameters
    ----------
    dynamics : ArmDynamics
        n_t coordinates.
    state : numpy.ndarray, shape (2 n_t,)
        When the joints are locked.
    rest : numpy.ndarray, shape (n_t,)
        Equilibrium.
    parameters : PhysicalParameters
        Payload and stiffness.

    """
    arm = dynamics.arm
    n, n_t = arm.n_joints, arm.n_coordinates
    if not arm.n_passive:
        return 0.0
    frequencies, vectors = natural_modes(dynamics, rest, parameters, locked=True)
    mass = dynamics.mass_and_energy(state[None], parameters.physical)[0][0, n:]
    momenta = mass @ state[n_t:]
    displacement = np.linalg.solve(vectors, state[n:n_t] - rest[n:])
    rate = np.linalg.solve(vectors, np.linalg.solve(mass[:, n:], momenta))
    amplitude = np.hypot(displacement, rate / frequencies)
    twisting = np.abs(vectors[:len(arm.elastic_joints)]) @ amplitude
    away = [*(np.abs(link_deflections(arm, link, vectors)) @ amplitude
              for link in range(n) if arm.links[link].modes),
            twisting * twist_levers(arm)]
    if isinstance(arm, SpatialArm):
        moved = np.linalg.norm(tip_jacobian(arm, rest)[:, n:] @ vectors, axis=0)
        away.append(np.array([moved @ amplitude]))
    return float(np.concatenate(away).max())
