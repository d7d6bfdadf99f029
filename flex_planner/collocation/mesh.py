"""Where the mesh needs more nodes: defects of the polynomial and meshes that level them."""

from __future__ import annotations

from flex_planner.collocation.newton import magnitudes
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.solution import CollocationSolution
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# between the collocation points, where the defect vanishes
_PROBES = np.array([0.02, 0.3, 0.7, 0.98])
_MOST_REFINED = 6.0


def defects(problem: BoundaryValueProblem, solution: CollocationSolution) -> Array:
    """
    Return how far each interval's polynomial is from solving z' = F, shape (N,).

    Per interval: step times root mean square of ``z' - F(t, z)``, of the worst unknown, in
    units of the unknown's magnitude. Falls with the power s + 1 of the step, so it
    overestimates the error at the nodes, which falls with 2 s.

    """
    times = (solution.mesh[:-1, None] + solution.steps[:, None] * _PROBES).ravel()
    defect = solution.rate(times) - problem.rate(times, solution(times))
    squares = defect.reshape(solution.intervals, _PROBES.size, -1) ** 2
    sizes = np.sqrt(squares.mean(axis=1)) * solution.steps[:, None]
    worst: Array = (sizes / magnitudes(problem, solution)).max(axis=1)
    return np.nan_to_num(worst, nan=np.inf)  # F may be undefined between the points


def levelled(solution: CollocationSolution, defect: Array, tolerance: float, *, fewest: int,
             most: int) -> Array:
    """
    Return a mesh on which every interval is expected to have the same, tolerable defect.

    Parameters
    ----------
    solution : CollocationSolution
        On the present mesh.
    defect : numpy.ndarray, shape (N,)
        From :func:`defects`.
    tolerance : float
        Largest defect wanted.
    fewest, most : int
        Bounds of the number of intervals.

    """
    needed = (defect / (0.3 * tolerance)) ** (1 / (solution.rule.stages + 1))
    needed = np.clip(needed, 1 / _MOST_REFINED, _MOST_REFINED)
    padded = np.pad(needed, 1, mode='edge')
    needed = np.maximum(needed, (padded[:-2] + padded[2:]) / 2)
    total = np.concatenate([[0.0], np.cumsum(needed)])
    count = int(np.clip(np.ceil(total[-1]), fewest, most))
    mesh: Array = np.interp(np.linspace(0, total[-1], count + 1), total, solution.mesh)
    return mesh
