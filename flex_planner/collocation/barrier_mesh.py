"""
A mesh that follows mu: an interior-point method on meshes that become finer where limits are met.

Between its points a motion may still pass a limit, and where a multiplier rises by a factor from
one point to the next, polynomials do not show how it does.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.interior_point import (
    BarrierOutcome,
    BarrierProblem,
    BarrierSchedule,
    solve_barrier,
)
from flex_planner.collocation.solution import CollocationSolution
import numpy as np
from numpy.typing import NDArray

# mu falls by this factor from mesh to mesh
_FALL = 0.01
# meshes for one mu, at most
_MOST_MESHES = 12
# a slack that changes by more than this factor from point to point (its logarithm), where its
# multiplier is more than this share of the largest
_STEEPEST, _MATTERS = 1.5, 1e-3
# positions between the points of an interval, for each of them
_BETWEEN = 4
# iterations before a mesh is taken to be too coarse to settle on, if corrections are smaller than
# this; products of slacks and multipliers are then off mu by more than this factor (its logarithm)
_STALLED, _NEARLY, _OFF = 30, 0.1, np.log(3.0)

Slacks = Callable[[Array], Array]
"""From unknowns (k, m) to slacks (k, n_c)."""


def follow_barrier(problem: BarrierProblem, guess: CollocationSolution, y: Array,
                   schedule: BarrierSchedule, monitor: Monitor, *, slacks: Slacks,
                   count: int, most_intervals: int) -> BarrierOutcome:
    """
    Lower mu from its start to its end on meshes that follow it.

    Parameters
    ----------
    problem : BarrierProblem
        What to solve.
    guess : CollocationSolution
        Start of z.
    y : numpy.ndarray, shape (N, s, n_y)
        Start of the others, slacks and multipliers > 0.
    schedule : BarrierSchedule
        Of mu; `max_iterations` of each mesh.
    monitor : Monitor
        Told of every iteration.
    slacks : callable
        Of the limits that are to hold between the points, too.
    count : int
        How many those are, n_c; in y they are the last slacks and the last multipliers.
    most_intervals : int
        Of a mesh; where it is not enough the outcome has not converged.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    solution, made, first, mu = guess, 0, schedule.first, schedule.first
    while True:
        for _ in range(_MOST_MESHES):
            met = _settle(problem, solution, y, replace(schedule, first=first, last=mu), monitor,
                          count)
            made += met.iterations
            met = replace(met, iterations=made)
            cut = (_find_cuts(problem, met, slacks, count) if met.converged
                   else _find_unsettled(met, problem.free, count))
            solution, y, first = met.solution, met.y, met.mu
            if not cut.any():
                break
            if solution.intervals + int(cut.sum()) > most_intervals:
                return replace(met, converged=False, message=(
                    f'the mesh would need more than {most_intervals} intervals'))
            solution, y = cut_mesh(problem, solution, y, cut)
        if mu <= schedule.last or not met.converged:
            return met
        mu = max(schedule.last, _FALL * mu)


def _settle(problem: BarrierProblem, guess: CollocationSolution, y: Array,
            schedule: BarrierSchedule, monitor: Monitor, count: int) -> BarrierOutcome:
    """Lower mu on one mesh; where a finer one would settle sooner, not to the last iteration."""
    met = solve_barrier(problem, guess, y, replace(
        schedule, max_iterations=min(_STALLED, schedule.max_iterations)), monitor)
    left = schedule.max_iterations - met.iterations
    if met.converged or left <= 0 or _find_unsettled(met, problem.free, count).any():
        return met
    more = solve_barrier(problem, met.solution, met.y, replace(
        schedule, first=met.mu, max_iterations=left), monitor)
    return replace(more, iterations=met.iterations + more.iterations)


def _find_unsettled(met: BarrierOutcome, free: int, count: int) -> NDArray[np.bool_]:
    """Return the intervals whose multipliers go to and fro, shape (N,); none if all does."""
    if not met.correction <= _NEARLY:
        return np.zeros(met.solution.intervals, dtype=bool)
    middle = free + (met.y.shape[-1] - free) // 2
    products = met.y[..., middle - count:middle] * met.y[..., -count:]
    off = np.abs(np.log(products / met.mu)).max(axis=(1, 2)) > _OFF
    unsettled: NDArray[np.bool_] = off & (met.solution.steps > 0)
    return unsettled


def _find_cuts(problem: BarrierProblem, met: BarrierOutcome, slacks: Slacks,
               count: int) -> NDArray[np.bool_]:
    """Return which intervals are to be cut in two, shape (N,)."""
    solution, y = met.solution, met.y
    intervals, stages, size = solution.stages.shape
    between = np.linspace(0, 1, _BETWEEN * stages + 1, dtype=np.float64)
    values = slacks(solution.values_at(between).reshape(-1, size))
    passed = (values < 0).reshape(intervals, -1).any(axis=1)
    middle = problem.free + (y.shape[-1] - problem.free) // 2
    sigma, lam = y[..., middle - count:middle], y[..., -count:]
    steep = np.abs(np.diff(np.log(sigma), axis=1)).max(axis=1) > _STEEPEST
    matters = lam.max(axis=1) > _MATTERS * lam.max(axis=(0, 1))
    cuts: NDArray[np.bool_] = (passed | (steep & matters).any(axis=1)) & (solution.steps > 0)
    return cuts


def cut_mesh(problem: BarrierProblem, solution: CollocationSolution, y: Array,
             cut: NDArray[np.bool_]) -> tuple[CollocationSolution, Array]:
    """
    Return z and y on a mesh with some intervals cut in two.

    Parameters
    ----------
    problem : BarrierProblem
        Says which entries of y may have any sign.
    solution : CollocationSolution
        On N intervals.
    y : numpy.ndarray, shape (N, s, n_y)
        The other unknowns.
    cut : numpy.ndarray of bool, shape (N,)
        Which are cut.

    """
    middles = ((solution.mesh[:-1] + solution.mesh[1:]) / 2)[cut]
    finer = solution.on_mesh(np.sort(np.concatenate([solution.mesh, middles])))
    before, after = solution.stage_times().ravel(), finer.stage_times().ravel()
    columns = []
    for j, column in enumerate(y.reshape(-1, y.shape[-1]).T):
        positive = j >= problem.free  # by its logarithm, so that it stays so
        values = np.interp(after, before, np.log(column) if positive else column)
        columns.append(np.exp(values) if positive else values)
    return finer, np.stack(columns, axis=-1).reshape(*finer.stages.shape[:2], -1)
