"""Limits of an arm with links so stiff that they are searched as rigid, see `StiffLinks`."""

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

Found = TypeVar('Found', bound=LimitResult)


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
    plan = None if found.plan is None else stiff.lift(found.plan, solver)
    if found.plan is not None and plan is None:
        return None
    if found.status is PlanStatus.INFEASIBLE:
        found = replace(found, status=PlanStatus.NOT_FOUND,
                        message=f'{found.message}, proved for rigid links')
    return replace(found, task=problem.task, plan=plan)
