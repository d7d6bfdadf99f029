"""
The largest payload and the shortest duration of motions that limits on the way bend.

Without such limits a search follows a price, see `limit_search`. Where its motion leaves them, the
payload is found with the limits as a barrier, and a motion with a little less is planned and
certified. Where that fails payloads are tried, heavier and heavier ones, and so are durations,
shorter and shorter ones, each from the motion before.

"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from flex_planner.base.progress import StoppedError
from flex_planner.capacity.certify_reached import certify_reached
from flex_planner.capacity.results import MaxPayload, MinDuration
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.constrained_motion import relieve_ends, slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.task import MAX_DURATION, Task
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.strategies.free_parameters import PAYLOAD
from flex_planner.planning.strategies.homotopies import drop_weights
from flex_planner.planning.strategies.interior_point import applies
from flex_planner.planning.strategies.payload_within_limits import (
    reach_from_easier_arm,
    reach_largest_payload,
)
from flex_planner.planning.strategies.reached_limit import ReachedLimit
import numpy as np

# slack of a limit that bends a motion, in its scale
_TOUCHED = 0.01
# first durations by that of the free motion, and the most tries
_LONGER, _MOST_TRIES = (1.05, 1.2, 1.5, 2.0, 4.0), 30


def carry_within_limits(problem: MotionProblem, solver: Solver, accuracy: float,
                        free: MaxPayload, starts: Iterable[CollocationSolution] = (), *,
                        ringing: bool = False) -> MaxPayload | None:
    """
    Return the largest payload within the limits on the way.

    Parameters
    ----------
    problem : MotionProblem
        Of the task.
    solver : Solver
        Its monitor may interrupt the search.
    accuracy : float
        To which the limit is wanted [kg].
    free : MaxPayload
        The outcome without them, whose motion leaves them.
    starts : iterable of CollocationSolution
        Motions to start from, besides a straight line, where a plan with the payload of the task
        is not to be waited for.
    ringing : bool
        Whether torques switch too often for Newton's method.

    Returns
    -------
    MaxPayload or None
        None where the method does not apply or finds nothing.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    slacks = slacks_of(problem)
    if slacks is None or not applies(problem, solver):
        return None
    slacks, first, known = relieve_ends(problem, slacks), None, [*starts]
    solver.monitor.phase = 'largest payload within the limits'
    nears: Iterable[CollocationSolution | None] = (*known, None)
    if not known:
        first = plan_path(problem.task, model=problem.model, solver=solver, search='fast')
        solver.monitor.check()
        nears = known_motions(first)
    for one in _reach(drop_weights(problem), slacks, solver, nears, accuracy):
        certified = certify_reached(PAYLOAD, problem, one, accuracy, solver, ringing=ringing)
        if certified is not None:
            return _conclude(free, *certified, accuracy)
    if first is None or not (first.solved and np.isfinite(free.local_upper)):
        return None
    return carry_more(problem.task, first, solver, accuracy, free)


def _reach(problem: MotionProblem, slacks: PathSlacks, solver: Solver,
           nears: Iterable[CollocationSolution | None], accuracy: float) -> list[ReachedLimit]:
    """Return the limits that some motions lead to, the heaviest payload first."""
    reached = [found for near in nears if (found := reach_largest_payload(
        problem, slacks, solver, near, accuracy)) is not None]
    if not reached:
        easier = reach_from_easier_arm(problem, slacks, solver, accuracy)
        reached = [] if easier is None else [easier]
    return sorted(reached, key=lambda one: -one.value)


def is_touched(plan: Plan) -> bool:
    """Return whether a limit on the way bends the motion of a plan."""
    return any(one.slack < _TOUCHED for one in plan.constraints)


def _conclude(free: MaxPayload, reached: ReachedLimit, payload: float, plan: Plan,
              accuracy: float) -> MaxPayload:
    """Return the outcome with a certified payload near the one that was reached."""
    upper = reached.value + reached.gap
    where = ' within the limits on the way' if is_touched(plan) else ''
    return replace(
        free, status=(PlanStatus.SOLVED if upper - payload <= accuracy
                      else PlanStatus.NOT_CONVERGED), plan=plan,
        payload=payload, local_upper=upper, within_limits=True, message=(
            f'{payload:.6g} kg can be carried{where}, and a motion with more than '
            f'{payload:.6g} kg was not certified, though about {upper:.6g} kg seem possible'))


def hurry_within_limits(task: Task, solver: Solver, accuracy: float,
                        free: MinDuration) -> MinDuration | None:
    """
    Return the shortest duration found within the limits on the way.

    Parameters
    ----------
    task : Task
        The motion.
    solver : Solver
        Its monitor may interrupt the search.
    accuracy : float
        To which the limit is wanted [s].
    free : MinDuration
        The outcome without them; its plan is the fastest motion, which leaves the limits.

    Returns
    -------
    MinDuration or None
        None where no motion is found.

    """
    if free.plan is None or not applies(free.plan.problem, solver):
        return None
    failed, plan = free.plan.task.duration, None
    for factor in _LONGER:
        duration = min(factor * free.plan.task.duration, MAX_DURATION)
        plan = _plan_in(task, duration, free.plan, solver)
        if plan is not None:
            break
        failed = duration
    if plan is None:
        return None
    for _ in range(_MOST_TRIES):
        if plan.task.duration - failed <= accuracy:
            break
        duration = (plan.task.duration + failed) / 2
        shorter = _plan_in(task, duration, plan, solver)
        failed, plan = (duration, plan) if shorter is None else (failed, shorter)
    near = plan.task.duration - failed <= accuracy
    return replace(
        free, status=PlanStatus.SOLVED if near else PlanStatus.NOT_CONVERGED, plan=plan,
        duration=plan.task.duration, local_lower=failed, within_limits=True, message=(
            f'{plan.task.duration:.6g} s are enough within the limits on the way, certified; no '
            f'motion of this kind was found in {failed:.6g} s'))


def _plan_in(task: Task, duration: float, near: Plan, solver: Solver) -> Plan | None:
    """Return a certified plan within the limits that takes so long, None without one."""
    return _plan_near(replace(task, duration=duration, time_weight=0.0), near, solver)


def _plan_near(task: Task, near: Plan, solver: Solver) -> Plan | None:
    """Return a certified plan within the limits from one of a similar task, None without one."""
    plan = plan_path(task, model=near.model, solver=solver, start_from=near, search='fast')
    solver.monitor.check()
    return plan if plan.solved else None


def known_motions(plan: Plan) -> Iterator[CollocationSolution | None]:
    """Yield motions within the limits that a search may start from; None for a straight line."""
    if plan.solved and plan.solution is not None:
        yield plan.solution
        for kind in plan.kinds[1:]:
            if kind.motion.solution.nodes.shape[1] == plan.problem.size:
                yield kind.motion.solution
    yield None


def carry_more(task: Task, plan: Plan, solver: Solver, accuracy: float,
               free: MaxPayload) -> MaxPayload:
    """Return the outcome with the heaviest payload of those tried, from a plan with a lighter."""
    failed, status = free.local_upper, PlanStatus.NOT_CONVERGED
    try:
        for _ in range(_MOST_TRIES):
            if failed - plan.task.payload_mass <= accuracy:
                break
            payload = (plan.task.payload_mass + failed) / 2
            heavier = _plan_near(replace(task, payload_mass=payload), plan, solver)
            failed, plan = (payload, plan) if heavier is None else (failed, heavier)
    except StoppedError as error:
        status = STOP_STATUS[error.reason]
        if status is PlanStatus.CANCELED:
            raise
    carried = plan.task.payload_mass
    return replace(
        free, status=status, plan=plan, payload=carried, local_upper=failed, within_limits=True,
        message=(f'{carried:.6g} kg can be carried within the limits on the way; no motion with '
                 f'{failed:.6g} kg was found from there, which does not show that there is none'))
