"""
Maximum payload between two postures: Korayem et al. 2009, section 4.2.

`find_max_payload` answers with a bracket: a payload that a certified plan carries, and one that
is too much for the motors. What can be carried does not depend on the weights of the task: the
direct search minimises effort alone, and the weights shape the plan at the end.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import Enum

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array, number
from flex_planner.capacity.extrapolation import check_ratio, continued_stops
from flex_planner.capacity.incremental import PayloadTrial, raised_payload
from flex_planner.capacity.limit_search import (
    collected,
    is_near,
    middle,
    plan_at,
    plan_near,
    way_to,
    width,
)
from flex_planner.collocation import CollocationSolution, solve, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import (
    holding_limit,
    MotionProblem,
    task_parameters,
)
from flex_planner.optimal_control.task import MAX_PAYLOAD, Task
from flex_planner.planning.certificate import totals
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import LADDER, planned, STATUSES, STOPPED
from flex_planner.planning.strategies.first_extremals import heaviest, taken_over
from flex_planner.planning.strategies.initial_guesses import without_weights
from flex_planner.planning.strategies.price_continuation import (
    changed,
    Extremal,
    payloads,
    SearchStart,
)
import numpy as np

_MIN_ACCURACY, _MAX_ACCURACY = 1e-6, 1e3
_STEP = 1.0
# of the payload that the motors can just hold, kept clear of rounding
_HELD = 1 - 1e-9


class PayloadMethod(Enum):
    """How the maximum payload is found; the value is shown to people."""

    DIRECT = 'payload as an unknown at a rising price'
    INCREMENTAL = 'payload raised step by step'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadFront:
    """
    What each payload costs, met on the way to the largest.

    Attributes
    ----------
    payloads : numpy.ndarray, shape (k,)
        Ascending [kg].
    efforts : numpy.ndarray, shape (k,)
        Least integral of R-weighted squared torques that carries it, J of eq. (6) without
        weights but R [N^2 m^2 s].
    prices : numpy.ndarray, shape (k,)
        dJ/dm_p [N^2 m^2 s/kg].

    """

    payloads: Array = field(default_factory=lambda: np.zeros(0))
    efforts: Array = field(default_factory=lambda: np.zeros(0))
    prices: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MaxPayload:
    """
    The outcome of a search for the maximum payload, whether it succeeded or not.

    Attributes
    ----------
    task : Task
        What was asked; its payload is the least that is of interest.
    method : PayloadMethod
        How it was searched.
    status : PlanStatus
        ``SOLVED`` if the largest payload is in the bracket, ``INFEASIBLE`` if not even the task's
        own payload can be carried.
    message : str
        The status in more words.
    payload : float
        Lower end of the bracket: the largest payload with a certified plan; 0 if there is
        none [kg].
    upper : float
        Upper end: too much, see `Extremal.room`, or without a solution; ``inf`` if unknown
        [kg].
    plan : Plan or None
        The motion with `payload`.
    limiting_joint : int or None
        Index of the joint whose motor is on its limit for the largest share of the time, see
        `Plan.saturation`, or that can hold no more at the goal.
    held : bool
        Whether the limit is what the motors hold at the goal.
    front : PayloadFront
        Payloads and their cost; empty if not searched by the direct method.
    trials : tuple of PayloadTrial
        Payloads tried; empty if not searched by the incremental method.
    stops : tuple of Extremal
        The motions of the front.
    warm : bool
        Whether it went on from the motion that it was given to start from.
    iterations : int
        Newton iterations.
    planning_time : float
        [s].

    """

    task: Task
    method: PayloadMethod
    status: PlanStatus
    message: str
    payload: float = 0.0
    upper: float = np.inf
    plan: Plan | None = None
    limiting_joint: int | None = None
    held: bool = False
    front: PayloadFront = field(default_factory=PayloadFront)
    trials: tuple[PayloadTrial, ...] = ()
    stops: tuple[Extremal, ...] = field(default=(), repr=False)
    warm: bool = False
    iterations: int = 0
    planning_time: float = 0.0

    @property
    def solved(self) -> bool:
        """Return whether the largest payload is known to the accuracy asked for."""
        return self.status is PlanStatus.SOLVED

    @property
    def middle(self) -> Extremal | None:
        """Return the last motion that leaves some room: a start for searches of its kind."""
        return middle(self.stops)


def find_max_payload(task: Task, *, model: ArmModel | None = None,
                     settings: SolverSettings | None = None, monitor: Monitor | None = None,
                     method: PayloadMethod = PayloadMethod.DIRECT, accuracy: float = 1e-3,
                     step: float | None = None,
                     start_from: MaxPayload | SearchStart | None = None,
                     before: MaxPayload | None = None, ratio: float = 1.0) -> MaxPayload:
    """
    Find the largest payload that the arm can carry from start to goal in the task's duration.

    Parameters
    ----------
    task : Task
        The motion; the search starts at its payload.
    model : ArmModel, optional
        Of the task's arm; compiled or read from disk if not given.
    settings : SolverSettings, optional
        Of the boundary-value solver.
    monitor : Monitor, optional
        Receives progress, and may cancel or limit the time.
    method : PayloadMethod
        ``DIRECT`` has the payload as an unknown, ``INCREMENTAL`` is that of the paper's fig. 2.
    accuracy : float
        Largest width of the bracket, 1e-6 to 1e3, but not less than a millionth of the payload
        [kg].
    step : float, optional
        First step of the incremental method, `accuracy` to 1e6; 1 or `accuracy` if that is more
        [kg].
    start_from : MaxPayload or SearchStart, optional
        A search of a similar task by the direct method, or a motion of one, tried first.
    before : MaxPayload, optional
        The search before `start_from` on a line of tasks: the motion is continued along that line,
        which takes a fraction of the time where motors switch alike.
    ratio : float
        Of the step from `start_from` to this task to the step before, within +-100.

    Returns
    -------
    MaxPayload
        Check `MaxPayload.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If no motor has a limit, if the goal is the start, if the duration is free, if the arm need
        not come to rest at the goal, or if a motor is too weak to hold the arm with the task's
        payload there.
    InvalidValueError
        If accuracy or step breaks its bound.

    """
    number('accuracy', accuracy, at_least=_MIN_ACCURACY, at_most=_MAX_ACCURACY, unit='kg')
    step = max(_STEP, accuracy) if step is None else step
    number('step', step, at_least=accuracy, at_most=MAX_PAYLOAD, unit='kg')
    check_ratio(ratio)
    _check(task)
    monitor = monitor or Monitor()
    began = monitor.iteration, monitor.elapsed
    search = _Search(MotionProblem(model or ArmModel(task.arm), task, task_parameters(task)),
                     settings or SolverSettings(), monitor, accuracy)
    try:
        if method is PayloadMethod.DIRECT:
            found = search.direct(start_from, before, ratio)
        else:
            found = search.incremental(step)
    except StoppedError as stop:
        found = search.failed(method, STATUSES[stop.reason], str(stop))
    return replace(found, iterations=monitor.iteration - began[0],
                   planning_time=monitor.elapsed - began[1])


def _check(task: Task) -> None:
    """Refuse a task that has no largest payload."""
    if not np.isfinite([joint.motor.stall_torque for joint in task.arm.joints]).any():
        raise InvalidTaskError('no motor of the arm has a stall torque, so no payload is the '
                               'largest')
    if task.time_weight:
        raise InvalidTaskError(f'time_weight is {task.time_weight:g}, but must be 0: the largest '
                               'payload is that of a given duration')
    if (not task.arm.gravity.any() and not task.start_velocities.any()
            and (task.start_positions == task.goal_positions).all()):
        raise InvalidTaskError('goal_positions are start_positions: no payload is too large for '
                               'an arm that stays where it is')
    if not task.ends_at_rest:
        raise InvalidTaskError('the largest payload is that of a motion which ends at rest: '
                               'goal_position_weights and goal_velocity_weights must be inf, '
                               'goal_velocities 0')


class _Search:
    """What both methods share."""

    def __init__(self, problem: MotionProblem, settings: SolverSettings, monitor: Monitor,
                 accuracy: float) -> None:
        self._problem, self._settings, self._monitor = problem, settings, monitor
        self._accuracy = accuracy
        self._stops: list[Extremal] = []
        self._warm = False

    def failed(self, method: PayloadMethod, status: PlanStatus, message: str,
               trials: Iterable[PayloadTrial] = ()) -> MaxPayload:
        """Return the outcome of a search that found no plan."""
        return MaxPayload(task=self._problem.task, method=method, status=status, message=message,
                          front=_front(self._stops), stops=_priced(self._stops),
                          trials=tuple(trials), warm=self._warm)

    def direct(self, start: MaxPayload | SearchStart | None, before: MaxPayload | None,
               ratio: float) -> MaxPayload:
        """Follow the price to the limit, then plan there."""
        exact = isinstance(start, MaxPayload) and self._continued(start, before, ratio)
        if not exact:
            failure = self._follow_price(_start(start))
            if failure is not None:
                return failure
        last = self._stops[-1]
        if last.stopped:
            return self.failed(PayloadMethod.DIRECT, STOPPED[last.result.status],
                               last.result.message)
        plan = plan_at(self._stops, self._problem, self._settings, self._monitor, payload=True,
                       exact=exact)
        last, near = self._stops[-1], is_near(self._stops, self._accuracy)
        found = MaxPayload(task=self._problem.task, method=PayloadMethod.DIRECT,
                           status=plan.status, message=plan.message,
                           front=_front(self._stops), stops=_priced(self._stops),
                           payload=last.value, upper=last.value + last.room, plan=plan,
                           warm=exact or self._warm)
        if not near:
            found = self._held(last, found)
        if not plan.solved or found.status in STOPPED.values():
            return replace(found, payload=0.0)
        if not near and not found.held:
            return replace(found, status=PlanStatus.NOT_CONVERGED, message=(
                f'{found.payload:.6g} kg can be carried, but it was not shown that no more can'))
        return _described(found)

    def _continued(self, start: MaxPayload, before: MaxPayload | None, ratio: float) -> bool:
        """Collect the stops that two searches lead to; False without success."""
        self._monitor.phase = 'payload at a rising price'
        self._stops = continued_stops(
            without_weights(self._problem), before.stops if before else (), start.stops, ratio,
            self._accuracy, self._settings, self._monitor, payload=True)
        return bool(self._stops)

    def _follow_price(self, start: SearchStart | None) -> MaxPayload | None:
        """Collect stops up to the limit; return the failure if there is no first motion."""
        bare, monitor = without_weights(self._problem), self._monitor
        way = way_to(self._accuracy, self._settings)
        monitor.phase = 'payload at a rising price'
        known = None if start is None else taken_over(bare, start, way, monitor, payload=True)
        self._warm = known is not None
        self._stops = collected(heaviest(bare, way, monitor, first=known, enough=self._enough),
                                self._accuracy)
        if self._stops[-1].result.converged or self._stops[-1].stopped:
            return None
        plan = planned(bare, LADDER, self._settings, monitor)
        if plan.solution is None or not plan.solved:
            return self.failed(PayloadMethod.DIRECT, plan.status, plan.message)
        first = solve(bare, plan.solution, way, monitor)
        self._stops = [Extremal(value=bare.task.payload_mass, price=0.0, result=first,
                                problem=bare)]
        monitor.phase = 'payload at a rising price'
        self._stops += collected(payloads(bare, first, way, monitor, self._enough),
                                 self._accuracy)
        return None

    def _enough(self, payload: float) -> float:
        """Return the room that is near enough."""
        return width(self._accuracy, payload)

    def _held(self, last: Extremal, found: MaxPayload) -> MaxPayload:
        """Return the outcome where the goal is what the motors can just hold, if it is."""
        limit, joint = holding_limit(self._problem)
        if not np.isfinite(limit) or limit * _HELD <= last.value:
            return found
        plan = self._plan(limit * _HELD, last.result.solution)
        if plan.status in STOPPED.values():
            return self.failed(PayloadMethod.DIRECT, plan.status, plan.message)
        if not plan.solved:
            return found
        return replace(found, status=plan.status, payload=limit * _HELD, upper=limit, plan=plan,
                       held=True, limiting_joint=joint)

    def _plan(self, payload: float, start: CollocationSolution) -> Plan:
        """Return the plan with a payload, from the motion of one like it."""
        return plan_near(changed(self._problem, payload_mass=payload), start, self._settings,
                         self._monitor)

    def incremental(self, step: float) -> MaxPayload:
        """Raise the payload of the task step by step."""
        method = PayloadMethod.INCREMENTAL
        first = planned(self._problem, LADDER, self._settings, self._monitor)
        if first.solution is None or not first.solved:
            return self.failed(method, first.status, first.message)
        self._monitor.phase = 'payload raised'
        trials, best, upper = [], (self._problem.task.payload_mass, first.solution), np.inf
        for trial in raised_payload(self._problem, first.solution, step=step,
                                    accuracy=self._accuracy, settings=self._settings,
                                    monitor=self._monitor):
            trials.append(trial)
            if trial.stopped:
                return self.failed(method, STOPPED[trial.result.status], trial.result.message,
                                   trials)
            if trial.solved:
                best = trial.payload, trial.result.solution
            else:
                upper = trial.payload
        plan = self._plan(*best)
        upper = min(upper, holding_limit(self._problem)[0])
        found = MaxPayload(task=self._problem.task, method=method, status=plan.status,
                           message=plan.message, payload=best[0] if plan.solved else 0.0,
                           upper=upper, plan=plan, trials=tuple(trials))
        return _described(found) if plan.solved else found


def _start(given: MaxPayload | SearchStart | None) -> SearchStart | None:
    """Return the motion that a search starts from, if there is one."""
    if not isinstance(given, MaxPayload):
        return given
    return None if given.middle is None else SearchStart.of(given.middle)


def _priced(stops: list[Extremal]) -> tuple[Extremal, ...]:
    """Return the stops that are motions of least effort."""
    return tuple(stop for stop in stops if stop.price and stop.result.converged)


def _front(stops: list[Extremal]) -> PayloadFront:
    """Return what the payloads cost."""
    priced = _priced(stops)
    efforts = [totals(stop.problem, stop.result.solution).cost for stop in priced]
    return PayloadFront(payloads=np.array([stop.value for stop in priced]),
                        efforts=np.array(efforts), prices=np.array([s.price for s in priced]))


def _described(found: MaxPayload) -> MaxPayload:
    """Return a solved search in words, with its limiting motor."""
    assert found.plan is not None
    joint, shares = found.limiting_joint, found.plan.saturation
    if joint is None:
        joint = int(shares.argmax())
        reason = f'joint {joint + 1} is on its limit for {shares[joint]:.1%} of the time'
    else:
        reason = f'joint {joint + 1} can hold no more at the goal'
    # under gravity the bound is that of this kind of motion; another may swing back first
    kind = ' by motions of this kind' if found.task.arm.gravity.any() and not found.held else ''
    return replace(found, limiting_joint=joint, message=(
        f'{found.payload:.6g} kg can be carried, {found.upper:.6g} kg cannot{kind}: '
        f'the motor of {reason}'))
