"""What it costs to forgive errors of the model: effort against the worst residual vibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, vector
from flex_planner.collocation import Solver
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.differing_plans import DifferingArms
from flex_planner.planning.robust.objective import Robustness
from flex_planner.planning.robust.weighed_plan import WeighedPlan
import numpy as np

WEIGHTS = tuple(float(weight) for weight in np.geomspace(0.1, 100, 7))
_MOST_WEIGHT = 1e9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EffortFront:
    """
    Motions of one task with the energy of differing arms weighed more and more.

    Attributes
    ----------
    weights : numpy.ndarray, shape (k,)
        Ascending from 0, which is the plain plan [1/J].
    costs : numpy.ndarray, shape (k,)
        J of eq. (6), without what the weight adds.
    residuals : numpy.ndarray, shape (k,)
        Largest residual bending of the arms that were simulated, see `RobustSearch` [m].
    nominal : numpy.ndarray, shape (k,)
        That of the arm of the model [m].

    """

    weights: Array
    costs: Array
    residuals: Array
    nominal: Array

    @property
    def growth(self) -> Array:
        """Return by which share each costs more than the plain plan, shape (k,)."""
        growth: Array = self.costs / self.costs[0] - 1
        return growth


def trace_effort_front(plan: Plan, robustness: Robustness,
                       weights: Sequence[float] = WEIGHTS, *, solver: Solver | None = None,
                       monitor: Monitor | None = None) -> EffortFront:
    """
    Return what less and less residual vibration costs.

    Parameters
    ----------
    plan : Plan
        Certified, of an arm with flexible links.
    robustness : Robustness
        The errors and the controller; its `max_residual` does not matter.
    weights : sequence of float
        Ascending, > 0 and at most 1e9 [1/J]. The front ends before the first whose motion is not
        found.
    solver : Solver, optional
        Of boundary-value problems.
    monitor : Monitor, optional
        Receives progress, and may cancel; that of the solver if not given.

    Raises
    ------
    InvalidValueError
        If a weight breaks its bound.
    InvalidTaskError
        If the robustness does not go with the task.
    StoppedError
        If the monitor stopped it.
    ValueError
        If the plan is not certified.

    """
    if not plan.certified:
        raise ValueError(f'the plan is not certified: {plan.message}')
    robustness.check(plan.task)
    given = vector('weights', np.atleast_1d(np.asarray(weights, dtype=float)), len(weights),
                   above=0, at_most=_MOST_WEIGHT, unit='1/J')
    if (np.diff(given) <= 0).any():
        raise InvalidValueError('weights', list(weights), 'ascending')
    watched = (solver or Solver()).watched_by(monitor)
    found = [WeighedPlan.plain(plan, DifferingArms(plan, robustness), watched)]
    for weight in given:
        watched.monitor.phase = f'weight {weight:.3g}'
        following = found[-1].solve(found[-1].linearise(), float(weight), watched)
        if following is None:
            break
        found.append(following)
    return EffortFront(
        weights=np.array([one.weight for one in found]),
        costs=np.array([one.plan.cost for one in found]),
        residuals=np.array([one.residuals.max() for one in found]),
        nominal=np.array([one.carried_out.residual((0.0, 0.0)) for one in found]))
