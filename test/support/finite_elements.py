"""
Natural frequencies of an arm by finite elements: frames in the plane, nothing in common with ours.

Every link is a row of Hermite beam elements with displacements along the axes of the plane, so
there are neither link frames nor assumed modes. That links do not stretch is a constraint.

"""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Link
from flex_planner.base.validation import Array
import numpy as np
from scipy.linalg import eigh, null_space


def element(link: Link, h: float, angle: float) -> tuple[Array, Array]:
    """Return stiffness and mass of a beam element of length h: (u_x, u_y, rotation) twice."""
    EI, rho = link.flexural_rigidity, link.linear_density
    K, M = np.zeros((6, 6)), np.zeros((6, 6))
    along, across = np.ix_([0, 3], [0, 3]), np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    M[along] = rho * h / 6 * np.array([[2, 1], [1, 2]])
    K[across] = EI / h**3 * np.array([[12, 6*h, -12, 6*h], [6*h, 4*h**2, -6*h, 2*h**2],
                                      [-12, -6*h, 12, -6*h], [6*h, 2*h**2, -6*h, 4*h**2]])
    M[across] = rho * h / 420 * np.array([
        [156, 22*h, 54, -13*h], [22*h, 4*h**2, 13*h, -3*h**2],
        [54, 13*h, 156, -22*h], [-13*h, -3*h**2, -22*h, 4*h**2]])
    c, s = np.cos(angle), np.sin(angle)
    turn = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    return turn.T @ K @ turn, turn.T @ M @ turn


def assemble(arm: Arm, positions: Array, payload: tuple[float, float], locked: bool,
             elements: int) -> tuple[Array, Array, Array]:
    """Return stiffness, mass and the stretch of every element for all unknowns of the arm."""
    size = 3 + arm.n_joints * (3 * elements + 1)
    K, M, stretch = np.zeros((size, size)), np.zeros((size, size)), []
    place, rotation, count = [0, 1], 2, 3  # unknowns of the present joint
    angle = 0.0
    for i, link in enumerate(arm.links):
        angle += positions[i]
        M[place, place] += arm.nodes[i].mass
        M[rotation, rotation] += arm.nodes[i].inertia
        for _ in range(elements):
            ends = [*place, rotation, count, count + 1, count + 2]
            for whole, part in zip((K, M), element(link, link.length / elements, angle),
                                   strict=True):
                whole[np.ix_(ends, ends)] += part
            stretch.append(np.zeros(size))
            stretch[-1][[*place, count, count + 1]] = np.kron(
                [-1, 1], [np.cos(angle), np.sin(angle)])
            place, rotation, count = [count, count + 1], count + 2, count + 3
        if not locked and i < arm.n_joints - 1:
            rotation, count = count, count + 1
    M[place, place] += arm.nodes[-1].mass + payload[0]
    M[rotation, rotation] += arm.nodes[-1].inertia + payload[1]
    return K[:count, :count], M[:count, :count], np.array(stretch)[:, :count]


def frequencies(arm: Arm, positions: Array, *, payload: tuple[float, float] = (0.0, 0.0),
                locked: bool, elements: int = 16) -> Array:
    """Return angular frequencies about a posture without gravity, ascending [rad/s]."""
    K, M, stretch = assemble(arm, positions, payload, locked, elements)
    held = 3 if locked else 2
    free = null_space(stretch[:, held:])
    squares = eigh(free.T @ K[held:, held:] @ free, free.T @ M[held:, held:] @ free,
                   eigvals_only=True)
    found: Array = np.sqrt(np.maximum(squares, 0))
    return found
