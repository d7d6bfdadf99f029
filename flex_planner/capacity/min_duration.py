"""
Minimum duration of a motion, and the maximum payload for many durations.

Both are the same front seen from its two sides: the less time there is, the less can be carried.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import number, vector
from flex_planner.capacity.extrapolation import check_ratio, continued_stops, step_ratio
from flex_planner.capacity.limit_search import collected, is_near, middle, plan_at, way_to, width
from flex_planner.capacity.max_payload import find_max_payload, MaxPayload
from flex_planner.collocation import CollocationSolution, solve, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import MAX_DURATION, Task
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import LADDER, planned, STATUSES, STOPPED
from flex_planner.planning.strategies.first_extremals import quickest, taken_over
from flex_planner.planning.strategies.initial_guesses import without_weights
from flex_planner.planning.strategies.price_continuation import (
    changed,
    durations,
    Extremal,
    SearchStart,
)
import numpy as np
from numpy.typing import ArrayLike

_MIN_ACCURACY, _MAX_ACCURACY = 1e-7, 100.0
# durations tried to start from, in units of the one of the task
_LONGER = (1.0, 3.0, 12.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MinDuration:
    """
    The outcome of a search for the shortest duration, whether it succeeded or not.

    Attributes
    ----------
    task : Task
        What was asked; its duration is a first guess.
    status : PlanStatus
        ``SOLVED`` if the shortest duration is in the bracket.
    message : str
        The status in more words.
    duration : float
        Upper end of the bracket: the shortest with a certified plan; ``inf`` if there is
        none [s].
    lower : float
        Lower end: too short, see `Extremal.room`; 0 if unknown [s].
    plan : Plan or None
        The motion in `duration`.
    stops : tuple of Extremal
        Shorter and shorter durations on the way, with their prices -dJ/dt_f.
    iterations : int
        Newton iterations.
    planning_time : float
        [s].

    """

    task: Task
    status: PlanStatus
    message: str
    duration: float = np.inf
    lower: float = 0.0
    plan: Plan | None = None
    stops: tuple[Extremal, ...] = field(default=(), repr=False)
    iterations: int = 0
    planning_time: float = 0.0

    @property
    def solved(self) -> bool:
        """Return whether the shortest duration is known to the accuracy asked for."""
        return self.status is PlanStatus.SOLVED

    @property
    def middle(self) -> Extremal | None:
        """Return the last motion that leaves some room: a start for searches of its kind."""
        return middle(self.stops)


def find_min_duration(task: Task, *, model: ArmModel | None = None,
                      settings: SolverSettings | None = None, monitor: Monitor | None = None,
                      accuracy: float = 1e-4, start_from: MinDuration | None = None,
                      before: MinDuration | None = None, ratio: float = 1.0) -> MinDuration:
    """
    Find the shortest duration in which the arm can make a motion with the payload of the task.

    Parameters
    ----------
    task : Task
        The motion; its duration is a first guess.
    model, settings, monitor : optional
        As of `plan_path`.
    accuracy : float
        Largest width of the bracket, 1e-7 to 100, but not less than a millionth of the duration
        [s].
    start_from : MinDuration, optional
        A search of a similar task, tried first.
    before : MinDuration, optional
        The one before `start_from` on a line of tasks, see `find_max_payload`.
    ratio : float
        Of the step from `start_from` to this task to the step before, within +-100.

    Returns
    -------
    MinDuration
        Check `MinDuration.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If a motor has no limit, or if the arm need not come to rest at the goal.
    InvalidValueError
        If the accuracy breaks its bound.

    """
    number('accuracy', accuracy, at_least=_MIN_ACCURACY, at_most=_MAX_ACCURACY, unit='s')
    check_ratio(ratio)
    if not np.isfinite([joint.motor.stall_torque for joint in task.arm.joints]).all():
        raise InvalidTaskError('a motor of the arm has no stall torque, so no duration is the '
                               'shortest')
    if not task.ends_at_rest:
        raise InvalidTaskError('the shortest duration is that of a motion which ends at rest')
    monitor = monitor or Monitor()
    began = monitor.iteration, monitor.elapsed
    fixed = replace(task, time_weight=0.0)
    problem = MotionProblem(model or ArmModel(task.arm), fixed, task_parameters(fixed))
    try:
        found = _found(task, problem, settings or SolverSettings(), monitor, accuracy, start_from,
                       before, ratio)
    except StoppedError as stop:
        found = MinDuration(task=task, status=STATUSES[stop.reason], message=str(stop))
    return replace(found, iterations=monitor.iteration - began[0],
                   planning_time=monitor.elapsed - began[1])


def _found(task: Task, problem: MotionProblem, settings: SolverSettings, monitor: Monitor,
           accuracy: float, start: MinDuration | None, before: MinDuration | None,
           ratio: float) -> MinDuration:
    """Follow the price of time to the limit, then plan there."""
    monitor.phase = 'duration at a rising price'
    exact = continued_stops(
        changed(without_weights(problem), duration=MAX_DURATION), before.stops if before else (),
        start.stops if start else (), ratio, accuracy, settings, monitor, payload=False)
    stops = exact or _stops(problem, settings, monitor, accuracy, start.middle if start else None)
    last = stops[-1]
    if last.stopped:
        return MinDuration(task=task, status=STOPPED[last.result.status],
                           message=last.result.message)
    if not last.result.converged:
        first = planned(without_weights(problem), LADDER, settings, monitor)
        if first.solution is None or not first.solved:
            return MinDuration(task=task, status=first.status, message=first.message)
        stops = _stops_from(first.problem, first.solution, settings, monitor, accuracy)
        last = stops[-1]
    plan = plan_at(stops, problem, settings, monitor, payload=False, exact=bool(exact))
    last = stops[-1]
    lower = max(0.0, last.value - last.room)
    found = MinDuration(task=task, status=plan.status, message=plan.message, plan=plan,
                        duration=last.value if plan.solved else np.inf, lower=lower,
                        stops=tuple(stop for stop in stops if stop.price))
    if not plan.solved:
        return found
    if not is_near(stops, accuracy):
        return replace(found, status=PlanStatus.NOT_CONVERGED, message=(
            f'{last.value:.6g} s are enough, but it was not shown that no less are'))
    kind = ' for motions of this kind' if task.arm.gravity.any() else ''
    return replace(found, message=f'{last.value:.6g} s are enough, {lower:.6g} s are not{kind}')


def _stops_from(problem: MotionProblem, solution: CollocationSolution, settings: SolverSettings,
                monitor: Monitor, accuracy: float) -> list[Extremal]:
    """Return the motions on the way from one that took all strategies to find."""
    way = way_to(accuracy, settings)
    first = solve(problem, solution, way, monitor)
    stop = Extremal(value=problem.task.duration, price=0.0, result=first, problem=problem)
    family = durations(problem, first, way, monitor, lambda duration: width(accuracy, duration))
    return [stop, *(each for each in collected(family, accuracy) if each.result.converged)]


def _stops(problem: MotionProblem, settings: SolverSettings, monitor: Monitor, accuracy: float,
           start: Extremal | None) -> list[Extremal]:
    """Return the motions on the way to the shortest duration."""
    way, bare = way_to(accuracy, settings), without_weights(problem)
    for factor in _LONGER:
        slow = changed(bare, duration=min(factor * problem.task.duration, MAX_DURATION))
        first = None if start is None else taken_over(slow, SearchStart.of(start), way, monitor,
                                                      payload=False)
        stops = collected(quickest(slow, way, monitor, first=first,
                                   enough=lambda duration: width(accuracy, duration)), accuracy)
        if stops[0].result.converged or stops[0].stopped:
            break
    return stops


def payload_against_duration(task: Task, durations: ArrayLike, *, model: ArmModel | None = None,
                             settings: SolverSettings | None = None,
                             monitor: Monitor | None = None,
                             accuracy: float = 1e-3) -> Iterator[MaxPayload]:
    """
    Yield the maximum payload for each duration, each search starting from the one before.

    Parameters
    ----------
    task : Task
        The motion; its duration does not matter.
    durations : array_like, shape (k,)
        > 0 [s]; neighbours should be near each other.
    model, settings, monitor : optional
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
    return _against_duration(tasks, model or ArmModel(task.arm), settings, monitor or Monitor(),
                             accuracy)


def _against_duration(tasks: list[Task], model: ArmModel, settings: SolverSettings | None,
                      monitor: Monitor, accuracy: float) -> Iterator[MaxPayload]:
    near: MaxPayload | None = None
    far: MaxPayload | None = None
    for task in tasks:
        ratio = step_ratio(far.task.duration, near.task.duration, task.duration) if (
            far is not None and near is not None) else 1.0
        found = find_max_payload(task, model=model, settings=settings, monitor=monitor,
                                 accuracy=accuracy, start_from=near, before=far, ratio=ratio)
        yield found
        if found.solved and (near is None or near.task.duration != task.duration):
            near, far = found, near
