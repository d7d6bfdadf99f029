"""
Limits of an arm with links or joints so stiff that they are searched as rigid, see `StiffLinks`.

What their vibrations cost in J, over the price of the limit, is what the limit of the arm as it is
differs by: next to the limit, where J is steep, far less than a plan may differ in J.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from flex_planner.capacity.results import LimitResult
from flex_planner.collocation import Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.stiff_links import find_stiff_links
import numpy as np

Found = TypeVar('Found', bound=LimitResult)

# of the width of the bracket: what the limit of the arm as it is may differ by
_SHIFT = 0.1


def search_as_rigid(problem: MotionProblem, solver: Solver,
                    search: Callable[[Task], Found]) -> Found | None:
    """
    Return the limit of an arm whose stiff links are taken as rigid, its plan that of the arm.

    Parameters
    ----------
    problem : MotionProblem
        Of the arm as it is.
    solver : Solver
        Of the plan's certificate.
    search : callable
        From the task of the arm with rigid links to its limit.

    Returns
    -------
    LimitResult or None
        None without stiff links, or if its plan is none of the arm as it is. What is proved of
        rigid links is not of others: the caller bounds the arm as it is.

    """
    stiff = find_stiff_links(problem, solver)
    if stiff is None:
        return None
    found = search(stiff.task())
    plan = None if found.plan is None else stiff.lift(found.plan, solver, _negligible(found))
    if found.plan is not None and plan is None:
        return None
    if found.status is PlanStatus.INFEASIBLE:
        found = replace(found, status=PlanStatus.NOT_FOUND,
                        message=f'{found.message}, proved for rigid links')
    return replace(found, task=problem.task, plan=plan)


def _negligible(found: LimitResult) -> float | None:
    """Return what vibrations may cost in J; None where no price is known."""
    priced = [one for one in found.extremals if one.price]
    width = found.bracket_width
    return _SHIFT * width * priced[-1].price if priced and np.isfinite(width) else None
