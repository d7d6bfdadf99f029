"""A straight beam in space of Hermite elements, of which a link's `ElementModel` is made."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.elements import ElementModel
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.base.validation import Array
import numpy as np

# unknowns of an element's two nodes: along and twisting, in the plane of y, in that of z
ALONG, TWIST, FIRST, SECOND = [0, 6], [3, 9], [1, 5, 7, 11], [2, 4, 8, 10]


def element(beam: SpatialBeam, h: float) -> tuple[Array, Array]:
    """Return mass and stiffness of an element along x, (12, 12); it does not stretch easily."""
    M, K = np.zeros((12, 12)), np.zeros((12, 12))
    pair, spring = np.array([[2, 1], [1, 2]]) * h / 6, np.array([[1, -1], [-1, 1]]) / h
    M[np.ix_(ALONG, ALONG)], K[np.ix_(ALONG, ALONG)] = beam.linear_density * pair, 1e7 * spring
    M[np.ix_(TWIST, TWIST)] = beam.polar_inertia * pair
    K[np.ix_(TWIST, TWIST)] = beam.torsional_rigidity * spring
    across = beam.linear_density * h / 420 * np.array([
        [156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
        [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])
    bends = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                      [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]) / h**3
    # a node that turns about y goes down along z
    for plane, sign, rigidity in zip((FIRST, SECOND), (1, -1), beam.flexural_rigidity,
                                     strict=True):
        signs = np.diag([1, sign, 1, sign])
        M[np.ix_(plane, plane)] = signs @ across @ signs
        K[np.ix_(plane, plane)] = rigidity * signs @ bends @ signs
    return M, K


def beam_arrays(beam: SpatialBeam, length: float, count: int, turn: Array) -> dict[str, Any]:
    """Return the arrays of an `ElementModel` of a beam whose axes are the columns of a turn."""
    x = np.linspace(0, length, count + 1)
    M, K = np.zeros((2, 6 * x.size, 6 * x.size))
    for i in range(count):
        part = slice(6 * i, 6 * i + 12)
        for whole, own in zip((M, K), element(beam, length / count), strict=True):
            whole[part, part] += own
    modes = np.zeros((x.size, 6, beam.count))
    modes[:, :3] = beam.displace(length, x)
    first, bending = beam.modes[0], sum(beam.modes)
    modes[:, 5, :first] = beam.bend(length, 0).slope(x)
    modes[:, 4, first:bending] = -beam.bend(length, 1).slope(x)
    modes[:, 3, bending:] = beam.twist(length).turn(x)
    turns = np.kron(np.eye(2 * x.size), turn)
    return {'nodes': np.outer(x, turn[:, 0]), 'mass': turns @ M @ turns.T,
            'stiffness': turns @ K @ turns.T, 'root_nodes': [0], 'tip_nodes': [count],
            'modes': turns @ modes.reshape(-1, beam.count), 'line_nodes': range(1, count)}


def beam_model(beam: SpatialBeam, length: float, count: int, turn: Array) -> ElementModel:
    """Return a beam of so many elements."""
    return ElementModel(**beam_arrays(beam, length, count, turn))
