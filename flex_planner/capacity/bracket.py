"""When a continuation in price has come near enough to its limit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flex_planner.collocation import Solver
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.limit_strategies import collect_until, is_steady
import numpy as np

_FINEST = 1e-6
# of motions along the continuation, by accuracy of the value [1/kg, 1/s]
_EXACTNESS = 10.0
# share of the value that the gap of a restart should be
_RESTART = 0.01


def continuation_solver(solver: Solver, accuracy: float) -> Solver:
    """Return the solver of motions along a continuation whose limit is wanted to an accuracy."""
    return solver.coarse(_EXACTNESS * accuracy)


def bracket_width(accuracy: float, value: float) -> float:
    """Return the largest width of a bracket: motions nearer to their limit are out of reach."""
    return max(accuracy, _FINEST * value)


def collect_to_limit(extremals: Iterable[Extremal], accuracy: float,
                     kept: list[Extremal] | None = None) -> list[Extremal]:
    """Return the extremals up to one that is near the limit, see `collect_until`."""
    return collect_until(extremals, lambda met: is_near_limit(met, accuracy), kept)


def is_near_limit(extremals: Sequence[Extremal], accuracy: float) -> bool:
    """Return whether the last value is the limit, to an accuracy."""
    last = extremals[-1]
    if not last.price:
        return False
    wide = bracket_width(accuracy, last.value)
    if np.isfinite(last.gap):
        return last.gap <= wide
    # a motor without limit is never full
    return is_steady(list(extremals), wide / (10 * last.value))


def restart_point(extremals: Sequence[Extremal]) -> Extremal | None:
    """Return the last motion that leaves some gap: a start for searches of its kind."""
    apart = [one for one in extremals if one.gap >= _RESTART * one.value]
    return apart[-1] if apart else next(iter(extremals), None)
