"""
An interior-point method step by step, where its own schedule leads to nothing.

What is settled for one problem and its mu is the start of the next one of a family: of one that is
nearer where a step fails, of one that is further away where it does not.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

from flex_planner.base.progress import Monitor
from flex_planner.collocation.interior_point import (
    BarrierOutcome,
    BarrierProblem,
    BarrierSchedule,
    solve_barrier,
)

# a first step, by how much it grows where it leads on, and the shortest that is tried
_FIRST, _LONGER, _SHORTEST = 0.15, 1.3, 0.01
_TOLERANCE, _PATIENCE = 1e-2, 25

Family: TypeAlias = Callable[[float], tuple[BarrierProblem, float]]
"""From a share, 0 to 1, to a problem and its mu."""


def walk_barrier(family: Family, met: BarrierOutcome, monitor: Monitor) -> BarrierOutcome:
    """
    Follow a family of problems on one mesh.

    Parameters
    ----------
    family : callable
        Problems with equal unknowns.
    met : BarrierOutcome
        Settled for the first of them.
    monitor : Monitor
        Told of every iteration.

    Returns
    -------
    BarrierOutcome
        Settled for the last one; not converged where that is the last of them that was met.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    share, step, made = 0.0, _FIRST, met.iterations
    while share < 1:
        ahead = min(1.0, share + step)
        found = settle(*family(ahead), met, monitor)
        made += found.iterations
        if found.converged:
            share, step, met = ahead, _LONGER * step, found
        elif step < _SHORTEST:
            return replace(met, converged=False, iterations=made, message=found.message)
        else:
            step /= 2
    return replace(met, iterations=made)


def lower_slowly(problem: BarrierProblem, met: BarrierOutcome, last: float,
                 monitor: Monitor) -> BarrierOutcome:
    """Lower mu to its end by `walk_barrier`."""
    return walk_barrier(lambda share: (problem, met.mu ** (1 - share) * last**share), met,
                        monitor)


def settle(problem: BarrierProblem, mu: float, near: BarrierOutcome, monitor: Monitor,
           tolerance: float = _TOLERANCE, patience: int = _PATIENCE) -> BarrierOutcome:
    """Return what a problem comes to at one mu, from what is near."""
    schedule = BarrierSchedule(first=mu, last=mu, tolerance=tolerance, max_iterations=patience)
    return solve_barrier(problem, near.solution, near.y, schedule, monitor)
