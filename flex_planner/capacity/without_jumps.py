"""
The largest payload and the shortest duration of motions whose torques have no jumps.

First the limit of motions whose torques may jump is found: what those cannot do no others can. A
price on rates alone does not change the limit, it only shapes the plan, so that a motion with a
little less is planned there. Bounds of rates do: the limit is then found with them and the motors'
limits as a barrier, and a motion with a little less is planned and certified.

"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from flex_planner.capacity.certify_reached import certify_reached
from flex_planner.capacity.results import LimitResult, MaxPayload, MinDuration
from flex_planner.capacity.within_limits import (
    carry_more,
    hurry_within_limits,
    known_motions,
)
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.smooth_torques import add_torques
from flex_planner.planning.strategies.free_parameters import DURATION, FreeParameter, PAYLOAD
from flex_planner.planning.strategies.interior_point import applies
from flex_planner.planning.strategies.limit_without_jumps import reach_limit_without_jumps
from flex_planner.planning.strategies.reached_limit import ReachedLimit
import numpy as np

# of the shortest duration of torques that may jump, from which a search sets out
_SLOWER = 1.2


def carry_without_jumps(task: Task, free: MaxPayload, solver: Solver,
                        accuracy: float) -> MaxPayload:
    """
    Return the largest payload found with torques that have no jumps.

    Parameters
    ----------
    task : Task
        Whose rates of torques have a price or bounds.
    free : MaxPayload
        The outcome for torques that may jump.
    solver : Solver
        Its monitor may interrupt the search.
    accuracy : float
        To which the limit is wanted [kg].

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    if free.plan is None or not free.plan.solved:
        return replace(free, task=task)
    bounded = _with_known_limits(task, free, free.plan)
    solver.monitor.phase = 'payload of torques without jumps'
    first = plan_path(bounded, model=free.plan.model, solver=solver, search='fast')
    solver.monitor.check()
    problem = MotionProblem(first.model, bounded, task_parameters(bounded))
    found = _certify_best(PAYLOAD, problem, _reach(
        PAYLOAD, problem, free.plan, known_motions(first), solver, accuracy), solver, accuracy)
    if found is None:
        nothing = replace(free, task=task, payload=0.0, plan=None, held=False,
                          status=first.status, message=first.message)
        return nothing if not first.solved else replace(
            carry_more(bounded, first, solver, accuracy, free), task=task, held=False)
    reached, payload, plan = found
    upper = min(reached.value + reached.gap, free.local_upper)
    return replace(
        free, task=task, status=_status(upper - payload, accuracy), plan=plan, payload=payload,
        local_upper=upper, held=False, limiting_joint=None, within_limits=_is_estimate(task, free),
        message=(f'{payload:.6g} kg can be carried by torques without jumps, certified; '
                 f'{_say_end(task, f"{upper:.6g} kg", "more")}'))


def hurry_without_jumps(task: Task, free: MinDuration, solver: Solver,
                        accuracy: float) -> MinDuration:
    """
    Return the shortest duration found with torques that have no jumps.

    Parameters
    ----------
    task, free, solver
        As of `carry_without_jumps`.
    accuracy : float
        To which the limit is wanted [s].

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    if free.plan is None or not free.plan.solved:
        return replace(free, task=task)
    bounded = replace(_with_known_limits(task, free, free.plan), time_weight=0.0)
    slower = replace(bounded, duration=_SLOWER * free.duration)
    problem = MotionProblem(free.plan.model, slower, task_parameters(slower))
    solver.monitor.phase = 'duration of torques without jumps'
    found = _certify_best(DURATION, problem, _reach(
        DURATION, problem, free.plan, [None], solver, accuracy), solver, accuracy)
    if found is None:
        longer = hurry_within_limits(bounded, solver, accuracy, free)
        return replace(longer, task=task) if longer is not None else replace(
            free, task=task, plan=None, duration=np.inf, status=PlanStatus.NOT_FOUND,
            message='no motion whose torques have no jumps was found, which does not show that '
                    'there is none')
    reached, duration, plan = found
    lower = max(reached.value - reached.gap, free.local_lower)
    return replace(
        free, task=task, status=_status(duration - lower, accuracy), plan=plan, duration=duration,
        local_lower=lower, within_limits=_is_estimate(task, free), message=(
            f'{duration:.6g} s are enough for torques without jumps, certified; '
            f'{_say_end(task, f"{lower:.6g} s", "less")}'))


def _reach(parameter: FreeParameter, problem: MotionProblem, free: Plan,
           starts: Iterable[CollocationSolution | None], solver: Solver,
           accuracy: float) -> Iterator[ReachedLimit]:
    """Yield motions near the limit."""
    if not _has_bounds(problem.task):  # the limit is that of torques which may jump
        value = parameter.value(free.problem)
        assert free.solution is not None
        yield ReachedLimit(value=value, gap=np.inf, motion=add_torques(
            parameter.with_value(problem, value), free.problem, free.solution))
    elif applies(problem, solver):
        for near in starts:
            found = reach_limit_without_jumps(parameter, problem, solver, accuracy, near)
            if found is not None and parameter.is_possible(found.value):
                yield found


def _certify_best(parameter: FreeParameter, problem: MotionProblem,
                  reached: Iterator[ReachedLimit], solver: Solver,
                  accuracy: float) -> tuple[ReachedLimit, float, Plan] | None:
    """Return the motion nearest to the limit near which one is certified, and that one."""
    best = sorted(reached, key=lambda one: one.value, reverse=parameter is PAYLOAD)
    for one in best:
        certified = certify_reached(parameter, problem, one, accuracy, solver)
        if certified is not None:
            return certified
    return None


def _with_known_limits(task: Task, free: LimitResult, plan: Plan) -> Task:
    """Return a task with the limits on how far links bend, too, where they bend the motion."""
    limits = plan.task.path_constraints if free.within_limits else task.path_constraints
    return replace(task, path_constraints=limits, goal_positions=plan.task.goal_positions)


def _has_bounds(task: Task) -> bool:
    """Return whether rates of torques are bounded."""
    return bool(np.isfinite(task.torque_rate_bounds).any())


def _is_estimate(task: Task, free: LimitResult) -> bool:
    """Return whether the other end of the bracket is no bound."""
    return free.within_limits or _has_bounds(task)


def _status(width: float, accuracy: float) -> PlanStatus:
    """Return whether a bracket is as narrow as it is wanted."""
    return PlanStatus.SOLVED if width <= accuracy else PlanStatus.NOT_CONVERGED


def _say_end(task: Task, end: str, more: str) -> str:
    """Say what is known of the limit."""
    if _has_bounds(task):
        return (f'a motion with {more} was not certified, and the search ended near {end}, which '
                'is an estimate and no proof')
    return f'this kind of motion ends at {end} even where torques may jump'
