"""
Minimum duration of a motion, and the maximum payload for many durations.

Both are the same front seen from its two sides: the less time there is, the less can be carried.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError, HoldingError, InvalidTaskError
from flex_planner.base.processes import helper_processes
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import number, vector
from flex_planner.capacity.extrapolation import Neighbours, step_ratio
from flex_planner.capacity.limit_search import LimitSearch
from flex_planner.capacity.max_payload import find_max_payload, stays
from flex_planner.capacity.results import describe_kinds, MaxPayload, MinDuration, say_lost_weights
from flex_planner.capacity.rigid_search import search_as_rigid
from flex_planner.capacity.within_limits import hurry_within_limits
from flex_planner.capacity.without_jumps import hurry_without_jumps
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import MAX_DURATION, Task
from flex_planner.planning.kinds.clusters import MOST_KINDS
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.proofs import bound_duration, guess_duration, prove_not_held
from flex_planner.planning.smooth_torques import STIFF_LINKS, without_torque_rates
from flex_planner.planning.stiff_links import find_stiff_links
from flex_planner.planning.strategies.extremals import SearchStart
from flex_planner.planning.strategies.free_parameters import DURATION
from flex_planner.planning.within_model import bound_by_limits
import numpy as np
from numpy.typing import ArrayLike

_MIN_ACCURACY, _MAX_ACCURACY = 1e-7, 100.0


def find_min_duration(task: Task, *, model: ArmModel | None = None,
                      solver: Solver | None = None, monitor: Monitor | None = None,
                      accuracy: float = 1e-4,
                      start_from: MinDuration | Neighbours | None = None,
                      search: SearchEffort | str = SearchEffort.NORMAL) -> MinDuration:
    """
    Find the shortest duration in which the arm can make a motion with the payload of the task.

    Parameters
    ----------
    task : Task
        The motion; its duration is a first guess.
    model, solver, monitor : optional
        As of `plan_path`.
    accuracy : float
        Largest width of the bracket, 1e-7 to 100, but not less than a millionth of the duration
        [s].
    start_from : MinDuration or Neighbours, optional
        A search of a similar task, tried first, or of two on a line, see `find_max_payload`.
    search : SearchEffort or str
        How many kinds of motion it looks for, see `find_max_payload`.

    Returns
    -------
    MinDuration
        Check `MinDuration.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If a motor has no limit, if the arm need not come to rest at the goal, or if there are via
        points.
    InvalidValueError
        If the accuracy breaks its bound.

    """
    effort = SearchEffort.of(search)
    helper_processes()  # what the environment says is refused before anything is solved
    number('accuracy', accuracy, at_least=_MIN_ACCURACY, at_most=_MAX_ACCURACY, unit='s')
    if not np.isfinite([joint.motor.standstill_torque for joint in task.arm.joints]).all():
        raise InvalidTaskError('a motor of the arm has no stall torque, so no duration is the '
                               'shortest')
    if task.via_points:
        raise InvalidTaskError('via_points must be empty: the shortest duration is that of a '
                               'motion without via points')
    if not task.ends_at_rest:
        raise InvalidTaskError('the shortest duration is that of a motion which ends at rest')
    if stays(task):
        raise InvalidTaskError('goal_positions are start_positions: an arm that stays where it is '
                               'needs no time')
    model = ArmModel.for_arm(task.arm, model)  # before a clock starts
    solver = (solver or Solver()).watched_by(monitor)
    began = solver.monitor.iteration, solver.monitor.elapsed
    fixed = replace(task, time_weight=0.0)
    try:
        problem = MotionProblem(model, fixed, task_parameters(fixed))
    except HoldingError as error:
        return MinDuration(task=task, status=PlanStatus.INFEASIBLE, proved_lower=np.inf,
                           message=str(prove_not_held(error, task.payload_mass)))
    if task.has_torque_rates:
        return _hurry_smoothly(problem, task, solver, accuracy, effort, start_from)
    problem = problem.with_changes(duration=guess_duration(problem))
    rigid = search_as_rigid(problem, solver, lambda stiff: find_min_duration(
        stiff, solver=solver, accuracy=accuracy, start_from=start_from, search=effort))
    if rigid is not None:
        return replace(rigid, task=task, proved_lower=bound_duration(problem))
    neighbours = start_from if isinstance(start_from, Neighbours) else Neighbours(
        near=start_from)
    limits = LimitSearch(DURATION, problem, solver, accuracy, effort)
    try:
        found = _search(task, limits, neighbours, accuracy)
    except StoppedError as error:
        found = _certified_so_far(limits, _result(task, limits, STOP_STATUS[error.reason],
                                                  str(error)))
    except FlexPlannerError as error:  # of a duration that was tried
        found = _certified_so_far(limits, _result(task, limits, PlanStatus.NOT_CONVERGED,
                                                  str(error)))
    found = replace(found, proved_lower=bound_duration(problem))
    return replace(found, iterations=solver.monitor.iteration - began[0],
                   planning_time=solver.monitor.elapsed - began[1])


def _hurry_smoothly(problem: MotionProblem, task: Task, solver: Solver, accuracy: float,
                    effort: SearchEffort,
                    start: MinDuration | Neighbours | None) -> MinDuration:
    """Return the outcome for torques without jumps, from that for torques that may jump."""
    began, jumping = (solver.monitor.iteration, solver.monitor.elapsed), without_torque_rates(task)
    plain = MotionProblem(problem.model, replace(jumping, time_weight=0.0), problem.parameters)
    if find_stiff_links(plain, solver):
        return MinDuration(task=task, status=PlanStatus.NOT_FOUND, message=STIFF_LINKS)
    free = find_min_duration(jumping, model=problem.model, solver=solver, accuracy=accuracy,
                             start_from=start, search=effort)
    try:
        found = hurry_without_jumps(task, free, solver, accuracy)
    except StoppedError as error:
        found = replace(free, task=task, status=STOP_STATUS[error.reason], message=str(error),
                        plan=None, duration=np.inf)
    return replace(found, iterations=solver.monitor.iteration - began[0],
                   planning_time=solver.monitor.elapsed - began[1])


def _search(task: Task, search: LimitSearch, neighbours: Neighbours,
            accuracy: float) -> MinDuration:
    """Follow the price of time to the limit, then plan there."""
    point = None if neighbours.near is None else neighbours.near.restart_point
    failure = search.follow_price(None if point is None else SearchStart.of(point), neighbours)
    if failure is not None:
        return _certified_so_far(search, _result(task, search, failure.status, failure.message))
    plan, last = search.plan(), search.last
    lower = max(0.0, last.value - last.gap)
    found = replace(_result(task, search, plan.status, plan.message), plan=plan,
                    duration=last.value if plan.solved else np.inf, local_lower=lower)
    limited = bound_by_limits(plan.problem, plan)
    if limited is not None:
        bounded = replace(task, path_constraints=limited.task.path_constraints)
        within = hurry_within_limits(bounded, search.solver, accuracy, found)
        if within is not None:
            return within
        found = replace(found, local_lower=0.0)  # what ends is a motion beyond the limits
    if not plan.solved:
        return _certified_so_far(search, found)
    if not search.is_near:
        return replace(found, status=PlanStatus.NOT_CONVERGED, message=(
            f'{last.value:.6g} s are enough, but where this kind of motion ends was not found'))
    best = search.explored_best
    if best is not None:
        return replace(found, status=PlanStatus.NOT_CONVERGED, message=(
            f'{last.value:.6g} s are enough; {best.value:.6g} s were found by direct collocation '
            f'on two meshes ({best.sentence}), but not certified'))
    return replace(found, message=(
        f'{last.value:.6g} s are enough, certified{describe_kinds(found)}; this kind of motion '
        f'ends at {lower:.6g} s'))


def _certified_so_far(search: LimitSearch, found: MinDuration) -> MinDuration:
    """Return the outcome of a search that failed with the shortest duration it can certify."""
    if found.status is PlanStatus.CANCELED:
        return found
    known = search.certify_so_far(stopped=found.status is PlanStatus.TIMEOUT)
    if known is None:
        return found
    extremal, plan = known
    status = (PlanStatus.NOT_CONVERGED if found.status is PlanStatus.CERTIFICATE_FAILED
              else found.status)  # what was certified is slower than what was not
    return replace(found, status=status, plan=plan, duration=extremal.value,
                   local_lower=max(0.0, extremal.value - extremal.gap),
                   message=f'{found.message}{say_lost_weights(found.task, plan)} '
                           f'({extremal.value:.6g} s are certified)')


def _result(task: Task, search: LimitSearch, status: PlanStatus, message: str) -> MinDuration:
    """Return the outcome of a search so far, without a plan."""
    return MinDuration(task=task, status=status, message=message, extremals=search.priced,
                       warm=search.warm, kinds=tuple(search.kinds[:MOST_KINDS]),
                       starts=search.starts)


def payload_against_duration(task: Task, durations: ArrayLike, *, model: ArmModel | None = None,
                             solver: Solver | None = None, monitor: Monitor | None = None,
                             accuracy: float = 1e-3) -> Iterator[MaxPayload]:
    """
    Yield the maximum payload for each duration, each search starting from the one before.

    Parameters
    ----------
    task : Task
        The motion; its duration does not matter.
    durations : array_like, shape (k,)
        > 0 [s]; neighbours should be near each other.
    model, solver, monitor : optional
        As of `find_max_payload`.
    accuracy : float
        As of `find_max_payload` [kg].

    Raises
    ------
    InvalidTaskError, InvalidValueError
        As `find_max_payload`, before anything is searched.

    """
    checked: Sequence[float] = vector('durations', durations, np.size(durations), above=0,
                                      at_most=MAX_DURATION, unit='s').tolist()
    tasks = [replace(task, duration=duration) for duration in checked]
    return _against_duration(tasks, ArmModel.for_arm(task.arm, model),
                             (solver or Solver()).watched_by(monitor), accuracy)


def _against_duration(tasks: list[Task], model: ArmModel, solver: Solver,
                      accuracy: float) -> Iterator[MaxPayload]:
    """Search each task, starting from the two before it."""
    near: MaxPayload | None = None
    far: MaxPayload | None = None
    for task in tasks:
        ratio = step_ratio(far.task.duration, near.task.duration, task.duration) if (
            far is not None and near is not None) else 1.0
        found = find_max_payload(task, model=model, solver=solver, accuracy=accuracy,
                                 start_from=Neighbours(near=near, far=far, ratio=ratio))
        yield found
        if found.solved and (near is None or near.task.duration != task.duration):
            near, far = found, near
