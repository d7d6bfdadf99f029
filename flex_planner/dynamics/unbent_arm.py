"""
The straight arm by NumPy alone: mass matrix, stiffness, and how it rings with its joints free.

For estimates of arms that nobody has compiled, such as the same arm with more modes. Written apart
from :mod:`flex_planner.dynamics.build_chain`, which it agrees with where the links are not bent.
Neither gravity nor damping is in it.

"""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Link
from flex_planner.arms.planar_only import require_planar
from flex_planner.base.validation import Array
import numpy as np


def mass_matrix(arm: Arm, positions: Array, payload_mass: float,
                payload_inertia: float) -> Array:
    """
    Return the mass matrix of the arm with straight links.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    positions : numpy.ndarray, shape (n,)
        Joint angles [rad].
    payload_mass, payload_inertia : float
        At the tip [kg, kg m^2].

    Returns
    -------
    numpy.ndarray, shape (n_t, n_t)
        M of eq. (3) at zero modal displacements.

    Raises
    ------
    PlanarOnlyError
        If the arm is a spatial one.

    """
    require_planar(arm, 'estimates of straight arms')
    n_t = arm.n_coordinates
    mass: Array = np.zeros((n_t, n_t))
    base: Array = np.zeros((2, n_t))  # rows over rates: velocity where the link begins
    turning: Array = np.zeros(n_t)  # rate of its frame
    slope: Array = np.zeros(n_t)
    for i, (link, modal) in enumerate(zip(arm.links, arm.modal_slices, strict=True)):
        mass[i, i] += arm.joints[i].motor.reflected_inertia
        turning = turning + slope
        turning[i] += 1
        if i in arm.elastic_joints:
            turning[arm.n_joints + arm.elastic_joints.index(i)] += 1
        angle = positions[:i + 1].sum()
        along, across = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        mass += _link_mass(link, modal, base, across @ base, turning)
        # of a rigid link whose centre of mass is beside its axis
        aside = link.first_moment[1] * np.outer(along @ base, turning)
        mass -= aside + aside.T
        mass += arm.nodes[i].inertia * np.outer(turning, turning)
        shapes = link.mode_shapes()
        deflection, slope = np.zeros(n_t), np.zeros(n_t)
        deflection[modal], slope[modal] = shapes.tip_deflection, shapes.tip_slope
        base = base + np.outer(across, link.length * turning + deflection)
        end, spin = arm.end_body(i), turning + slope
        mass += end.mass * base.T @ base + end.inertia * np.outer(spin, spin)
    return mass + _payload_mass(arm, positions.sum(), base, turning + slope, payload_mass,
                                payload_inertia)


def _payload_mass(arm: Arm, angle: float, tip: Array, turning: Array, mass: float,
                  inertia: float) -> Array:
    """Return the part of a payload whose centre of mass may be off the tip."""
    along, across = arm.payload_com
    c, s = np.cos(angle), np.sin(angle)
    moves = tip + np.outer([-s * along - c * across, c * along - s * across], turning)
    part: Array = mass * moves.T @ moves + inertia * np.outer(turning, turning)
    return part


def _link_mass(link: Link, modal: slice, base: Array, lift: Array, turning: Array) -> Array:
    """
    Return the part of one link, eq. (21).

    Rows over the coordinates' rates: `base` and `lift` are the velocity of the link's base, in the
    plane and across the link, `turning` is the rate of its frame.

    """
    rho, shapes = link.linear_density, link.mode_shapes()
    area, moment = np.zeros_like(turning), np.zeros_like(turning)
    area[modal], moment[modal] = rho * shapes.area, rho * shapes.moment
    mixed = np.outer(lift, link.first_moment[0] * turning + area) + np.outer(turning, moment)
    part: Array = (link.mass * base.T @ base + mixed + mixed.T
                   + link.rotary_inertia * np.outer(turning, turning))
    part[modal, modal] += rho * shapes.gram
    return part


def bending_stiffness(arm: Arm) -> Array:
    """Return the stiffness of links, eq. (23), and twists, (n_t, n_t); zero at the joints."""
    stiffness = np.zeros((arm.n_coordinates, arm.n_coordinates))
    for place, i in enumerate(arm.elastic_joints, arm.n_joints):
        elasticity = arm.joints[i].elasticity
        stiffness[place, place] = elasticity.stiffness if elasticity else 0.0
    for link, modal in zip(arm.links, arm.modal_slices, strict=True):
        if link.modes:
            stiffness[modal, modal] = link.flexural_rigidity * link.mode_shapes().stiffness
    return stiffness


def free_vibrations(mass: Array, stiffness: Array, n_joints: int) -> tuple[Array, Array]:
    """
    Return the vibrations of an arm whose joints are free to turn.

    Parameters
    ----------
    mass, stiffness : numpy.ndarray, shape (n_t, n_t)
        Of `mass_matrix` and `bending_stiffness`; n_f coordinates are modal.
    n_joints : int
        n: so many directions have no stiffness and are left out.

    Returns
    -------
    frequencies : numpy.ndarray, shape (n_f,)
        Angular, ascending [rad/s].
    vectors : numpy.ndarray, shape (n_t, n_f)
        Columns are displacements, orthonormal in the mass matrix.

    """
    # SciPy's `eigh` takes both matrices, but a tenth of a second to import
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    return np.sqrt(squares[n_joints:]), (inverse.T @ vectors)[:, n_joints:]
