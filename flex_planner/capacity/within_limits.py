"""
The largest payload and the shortest duration of motions that limits on the way bend.

Without such limits a search follows a price, see `limit_search`. Where its motion leaves them, the
payload is found with the limits as a barrier, and a motion with a little less is planned and
certified. Where that fails payloads are tried, heavier and heavier ones, and so are durations,
shorter and shorter ones, each from the motion before.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
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
from flex_planner.planning.plan_within_limits import (
    plan_from,
    plan_from_barrier,
    plan_smoothly,
)
from flex_planner.planning.strategies.free_parameters import FreeParameter, PAYLOAD
from flex_planner.planning.strategies.homotopies import drop_weights
from flex_planner.planning.strategies.interior_point import applies
from flex_planner.planning.strategies.payload_within_limits import (
    reach_largest_payload,
    refine_limit,
)
from flex_planner.planning.strategies.reached_limit import ReachedLimit
import numpy as np

# shares by which a value is eased from what was reached, until a motion is certified: the first
# as little as the accuracy allows
_EASED = (0.0005, 0.001, 0.003, 0.01, 0.03, 0.1)
# costates of a payload that is nearly endless in price, as those of a least effort
_COSTATES = 1e-3
# slack of a limit that bends a motion, in its scale
_TOUCHED = 0.01
# of a motion so near the limit
_MOST_INTERVALS = 600
# first durations by that of the free motion, and the most tries
_LONGER, _MOST_TRIES = (1.05, 1.2, 1.5, 2.0, 4.0), 30


def carry_within_limits(problem: MotionProblem, solver: Solver, accuracy: float,
                        free: MaxPayload, starts: Iterable[CollocationSolution] = (),
                        ) -> MaxPayload | None:
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
    reached = [found for near in nears if (found := reach_largest_payload(
        drop_weights(problem), slacks, solver, near, accuracy)) is not None]
    for one in sorted(reached, key=lambda one: -one.value):
        certified = certify_reached(PAYLOAD, problem, one, accuracy, solver)
        if certified is not None:
            return _conclude(free, *certified, accuracy)
    if first is None or not first.solved:
        return None
    return carry_more(problem.task, first, solver, accuracy, free)


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


def certify_reached(parameter: FreeParameter, problem: MotionProblem, reached: ReachedLimit,
                    accuracy: float,
                    solver: Solver) -> tuple[ReachedLimit, float, Plan] | None:
    """
    Return what was reached, and that or a value a little easier with its plan; None without.

    Parameters
    ----------
    parameter, problem, accuracy, solver
        As of `certify_near`.
    reached : ReachedLimit
        Where the barrier's end is known a plan begins with its slacks and multipliers, on its
        mesh; where torques switch too often for one, the motion is as the barrier has it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    def plan_at(limit: MotionProblem, slacks: PathSlacks) -> Plan | None:
        return plan_from_barrier(limit, slacks, reached.lower_price(limit), solver)

    def certify(*shares: float) -> tuple[float, Plan] | None:
        return certify_eased(parameter, problem, reached.value, plan_at, shares)

    if reached.met is None:
        found = certify_near(parameter, problem, reached.value, reached.motion, accuracy, solver)
    else:
        found = certify(accuracy / (3 * reached.value))
        smooth = None if found else _certify_smooth(problem, reached, solver)
        if smooth is not None:
            return smooth
        found = found or certify(*_EASED)
    return None if found is None else (reached, *found)


def _certify_smooth(problem: MotionProblem, reached: ReachedLimit,
                    solver: Solver) -> tuple[ReachedLimit, float, Plan] | None:
    """Return payload and plan of the motion as the barrier has it on a finer mesh, or None."""
    slacks = None if problem.layout.torques else slacks_of(problem)
    if slacks is None:
        return None
    finer = refine_limit(drop_weights(problem), relieve_ends(problem, slacks), reached, solver)
    if finer is None:
        return None

    def plan_there(limit: MotionProblem, slacks: PathSlacks) -> Plan | None:
        return plan_smoothly(limit, slacks, finer.unloaded(), solver)

    found = certify_eased(PAYLOAD, problem, finer.value, plan_there, (0.0,))
    return None if found is None else (finer, *found)


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

    return certify_eased(parameter, problem, value, plan_at, (accuracy / (3 * value), *_EASED))


def certify_eased(parameter: FreeParameter, problem: MotionProblem, value: float,
                  plan_at: Callable[[MotionProblem, PathSlacks], Plan | None],
                  shares: Iterable[float]) -> tuple[float, Plan] | None:
    """
    Return the first of some values, easier and easier, with a plan; None without one.

    Parameters
    ----------
    parameter, problem, value
        As of `certify_near`.
    plan_at : callable
        From the problem with a value and its slacks to a certified plan, or None.
    shares : iterable of float
        By which the value is eased, one after the other.

    """
    for share in shares:
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
