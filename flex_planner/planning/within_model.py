"""
The plan whose links bend no further than the model of the arm holds.

Where the motion of least cost bends a link beyond that, a motion that does not is found as one
within a limit on the way is.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.collocation import Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.bending import keeps_model, limits_of_model
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_within_limits import check_ends, keep_limits


def bound_bending(problem: MotionProblem) -> MotionProblem | None:
    """Return a motion with limits on how far its links bend; None if it cannot have them."""
    limits = limits_of_model(problem.task.arm)
    if not limits or keeps_model(problem.task):
        return None
    bounded = problem.with_changes(path_constraints=(*problem.task.path_constraints, *limits))
    return None if check_ends(bounded) else bounded


def bound_by_limits(problem: MotionProblem, plan: Plan) -> MotionProblem | None:
    """
    Return the motion with the limits that a plan of it without them has passed.

    Parameters
    ----------
    problem : MotionProblem
        Of the task.
    plan : Plan
        With another payload or duration.

    Returns
    -------
    MotionProblem or None
        None if the plan keeps its limits, or none can be given.

    """
    if plan.status is PlanStatus.LIMIT_VIOLATED:
        return problem
    return bound_bending(problem) if plan.status is PlanStatus.BENT_TOO_FAR else None


def keep_model(free: Plan, solver: Solver, effort: SearchEffort) -> Plan:
    """
    Return a plan whose links bend no further than their model holds.

    Parameters
    ----------
    free : Plan
        Planned without a limit on bending.
    solver : Solver
        Its monitor may interrupt the work.
    effort : SearchEffort
        Whether other kinds of motion are tried, too.

    Returns
    -------
    Plan
        The free one if it keeps to its model, or if no motion that does was found.

    """
    if free.status is not PlanStatus.BENT_TOO_FAR:
        return free
    bounded = bound_bending(free.problem)
    if bounded is None:
        return free
    plan = keep_limits(replace(free, problem=bounded, task=bounded.task), solver, effort)
    return plan if plan.solved else free
