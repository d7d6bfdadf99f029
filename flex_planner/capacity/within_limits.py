"""
The largest payload and the shortest duration of motions that limits on the way bend.

Without such limits a search follows a price, see `limit_search`. Where its motion leaves them, the
payload is found with the limits as a barrier, and a motion with a little less is planned and
certified. Where that fails payloads are tried, heavier and heavier ones, and so are durations,
shorter and shorter ones, each from the motion before.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import StoppedError
from flex_planner.capacity.results import MaxPayload, MinDuration
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.constrained_motion import relieve_ends, slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.task import MAX_DURATION, Task
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.plan_within_limits import plan_from
from flex_planner.planning.strategies.free_parameters import FreeParameter, PAYLOAD
from flex_planner.planning.strategies.homotopies import drop_weights
from flex_planner.planning.strategies.interior_point import applies
from flex_planner.planning.strategies.payload_within_limits import reach_largest_payload
import numpy as np

# shares by which a value is eased from what was reached, until a motion is certified: the first
# as little as the accuracy allows
_EASED = (0.0005, 0.001, 0.003, 0.01, 0.03, 0.1)
# costates of a payload that is nearly endless in price, as those of a least effort
_COSTATES = 1e-3
# of a motion so near the limit
_MOST_INTERVALS = 600
# first durations by that of the free motion, and the most tries
_LONGER, _MOST_TRIES = (1.05, 1.2, 1.5, 2.0, 4.0), 30


def carry_within_limits(problem: MotionProblem, solver: Solver, accuracy: float,
                        free: MaxPayload) -> MaxPayload | None:
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
    slacks = relieve_ends(problem, slacks)
    solver.monitor.phase = 'largest payload within the limits'
    first = plan_path(problem.task, model=problem.model, solver=solver, search='fast')
    solver.monitor.check()
    reached = [found for near in known_motions(first) if (found := reach_largest_payload(
        drop_weights(problem), slacks, solver, near)) is not None]
    for payload, gap, motion in sorted(reached, key=lambda one: -one[0]):
        certified = certify_near(PAYLOAD, problem, payload, motion, accuracy, solver)
        if certified is None:
            continue
        lighter, plan = certified
        near = payload + gap - lighter <= accuracy
        return replace(
            free, status=PlanStatus.SOLVED if near else PlanStatus.NOT_CONVERGED, plan=plan,
            payload=lighter, local_upper=payload + gap, within_limits=True, message=(
                f'{lighter:.6g} kg can be carried within the limits on the way, and a motion with '
                f'more than {lighter:.6g} kg was not certified, though about {payload:.6g} kg '
                'seem possible'))
    return carry_more(problem.task, first, solver, accuracy, free) if first.solved else None


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


def certify_near(parameter: FreeParameter, problem: MotionProblem, value: float,
                 motion: CollocationSolution, accuracy: float,
                 solver: Solver) -> tuple[float, Plan] | None:
    """
    Return a value a little easier than what was reached, and its certified plan; None without.

    Parameters
    ----------
    parameter : FreeParameter
        ``PAYLOAD``, which is at least that of the problem, or ``DURATION``.
    problem : MotionProblem
        Of the task.
    value : float
        Payload or duration that was reached [kg, s].
    motion : CollocationSolution
        With that value.
    accuracy : float
        To which the limit is wanted [kg, s].
    solver : Solver
        Its monitor may interrupt the work.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    quick = solver.with_settings(max_intervals=min(_MOST_INTERVALS, solver.settings.max_intervals))

    def plan_at(limit: MotionProblem, slacks: PathSlacks) -> Plan | None:
        costates = np.ones(problem.size)
        costates[problem.layout.costates] = _COSTATES
        near = CollocationSolution(motion.mesh, motion.nodes * costates,
                                   motion.stages * costates, motion.rule)
        return plan_from(limit, slacks, near.stretched(limit.task.duration / motion.mesh[-1]),
                         quick)

    return certify_eased(parameter, problem, value, plan_at, accuracy)


def certify_eased(parameter: FreeParameter, problem: MotionProblem, value: float,
                  plan_at: Callable[[MotionProblem, PathSlacks], Plan | None],
                  accuracy: float) -> tuple[float, Plan] | None:
    """
    Return the first of some values, easier and easier, with a plan; None without one.

    Parameters
    ----------
    parameter, problem, value, accuracy
        As of `certify_near`.
    plan_at : callable
        From the problem with a value and its slacks to a certified plan, or None.

    """
    for share in (accuracy / (3 * value), *_EASED):
        eased = parameter.ease(value, share)
        if parameter is PAYLOAD and eased < problem.task.payload_mass:
            return None
        try:
            limit = parameter.with_value(problem, eased)
            slacks = slacks_of(limit)
            plan = None if slacks is None else plan_at(limit, relieve_ends(limit, slacks))
        except FlexPlannerError:  # too heavy to hold
            continue
        if plan is not None:
            return eased, plan
    return None
