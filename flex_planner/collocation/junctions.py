"""
Conditions inside the span of a problem, at junctions: mesh nodes that come twice.

Between the two nodes is an interval of no length. In the place of its step stand m rows of z
before and after: most say that an unknown goes on as it was, the others that something holds
there, for which other unknowns may jump. So the matrix keeps its band, whatever the conditions.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from flex_planner.base.validation import Array
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.solution import CollocationSolution
import numpy as np
from numpy.typing import NDArray

# nodes nearer to a junction than this share of the span give way to it
_CLOSEST = 1e-9


class AnyProblem(Protocol):
    """A problem that may have conditions inside its span, or none."""

    @property
    def size(self) -> int:
        """Return the number of unknowns, m."""


class JunctionProblem(BoundaryValueProblem, Protocol):
    """
    A boundary-value problem with conditions at given times inside its span.

    A problem without `junctions` has none.

    Attributes
    ----------
    junctions : numpy.ndarray, shape (J,)
        Times of the conditions, increasing.

    """

    @property
    def junctions(self) -> Array:
        """Return the times of the conditions, shape (J,)."""

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what does not hold (m,) between z before and after, and its rows (m, 2 m)."""


@dataclass(frozen=True, slots=True, eq=False)
class JunctionRows:
    """
    The linearised conditions at the junctions of a mesh.

    Attributes
    ----------
    intervals : numpy.ndarray of int, shape (J,)
        Those of no length.
    rows : numpy.ndarray, shape (J, m, 2 m)
        By z before and after.

    """

    intervals: NDArray[np.int64]
    rows: Array


NO_JUNCTIONS = JunctionRows(np.zeros(0, dtype=np.int64), np.zeros((0, 1, 2)))


def junction_times(problem: AnyProblem) -> Array:
    """Return the times (J,) at which a problem has conditions inside its span."""
    times: Array = getattr(problem, 'junctions', np.zeros(0))
    return times


def join_at(problem: AnyProblem, junction: int, before: Array,
            after: Array) -> tuple[Array, Array]:
    """Return what does not hold (m,) at a junction of a problem that has some, and its rows."""
    found: tuple[Array, Array] = problem.join(  # type: ignore[attr-defined]
        junction, before, after)
    return found


def empty_rows(problem: AnyProblem, solution: CollocationSolution) -> JunctionRows:
    """
    Return memory for the rows of a problem on the mesh of a solution.

    Raises
    ------
    ValueError
        If the mesh has not one double node for each junction, see `place_junctions`.

    """
    count = junction_times(problem).size
    if not count:
        return NO_JUNCTIONS
    intervals = np.flatnonzero(solution.steps == 0).astype(np.int64)
    if intervals.size != count:
        raise ValueError(f'the mesh has {intervals.size} double nodes, but must have {count}')
    return JunctionRows(intervals, np.zeros((count, problem.size, 2 * problem.size)))


def evaluate_junctions(problem: AnyProblem, solution: CollocationSolution,
                       gaps: Array) -> JunctionRows:
    """Put what does not hold at the junctions into the gaps (N, m); return the rows."""
    found = empty_rows(problem, solution)
    for j, k in enumerate(found.intervals):
        gaps[k], found.rows[j] = join_at(problem, j, solution.nodes[k], solution.nodes[k + 1])
    return found


def place_junctions(problem: AnyProblem,
                    solution: CollocationSolution) -> CollocationSolution:
    """Return a solution with the double nodes that a problem needs, and no others."""
    times, mesh = junction_times(problem), solution.mesh
    there = mesh[1:][solution.steps == 0]
    if there.size == times.size and (there == times).all():
        return solution
    return solution.on_mesh(double_nodes(mesh, times))


def double_nodes(mesh: Array, times: Array) -> Array:
    """
    Return a mesh in which times inside it come twice, and all others once.

    Parameters
    ----------
    mesh : numpy.ndarray, shape (N + 1,)
        Not decreasing.
    times : numpy.ndarray, shape (J,)
        Increasing, inside the mesh.

    """
    single = np.unique(mesh)
    if not times.size:
        return single
    least = _CLOSEST * (single[-1] - single[0])
    apart = np.abs(single[:, None] - times).min(axis=1) > least
    apart[[0, -1]] = True
    doubled: Array = np.sort(np.concatenate([single[apart], times, times]))
    return doubled
