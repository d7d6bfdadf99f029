"""
Maximum payload between two postures: Korayem et al. 2009, section 4.2.

`find_max_payload` answers with a bracket: a payload that a certified plan carries, and one that
is too much for the motors. What can be carried does not depend on the weights of the task: the
direct search minimises effort alone, and the weights shape the plan at the end.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import number
from flex_planner.capacity.extrapolation import Neighbours
from flex_planner.capacity.incremental import PayloadTrial, raise_payload
from flex_planner.capacity.limit_search import LimitSearch, plan_near
from flex_planner.capacity.results import MaxPayload, PayloadFront, PayloadMethod
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import MAX_PAYLOAD, Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_problem import INTERRUPTED_STATUS, plan_problem, STOP_STATUS
from flex_planner.planning.strategies.extremals import Extremal, SearchStart
from flex_planner.planning.strategies.free_parameters import PAYLOAD
import numpy as np

_MIN_ACCURACY, _MAX_ACCURACY = 1e-6, 1e3
_STEP = 1.0
# of the payload that the motors can just hold, kept clear of rounding
_HELD = 1 - 1e-9


def find_max_payload(task: Task, *, model: ArmModel | None = None, solver: Solver | None = None,
                     monitor: Monitor | None = None,
                     method: PayloadMethod = PayloadMethod.DIRECT, accuracy: float = 1e-3,
                     step: float | None = None,
                     start_from: MaxPayload | SearchStart | Neighbours | None = None,
                     ) -> MaxPayload:
    """
    Find the largest payload that the arm can carry from start to goal in the task's duration.

    Parameters
    ----------
    task : Task
        The motion; the search starts at its payload.
    model : ArmModel, optional
        Of the task's arm; compiled or read from disk if not given.
    solver : Solver, optional
        Of boundary-value problems: its settings, its monitor and its method.
    monitor : Monitor, optional
        Receives progress, and may cancel or limit the time; that of the solver if not given.
    method : PayloadMethod
        ``DIRECT`` has the payload as an unknown, ``INCREMENTAL`` is that of the paper's fig. 2.
    accuracy : float
        Largest width of the bracket, 1e-6 to 1e3, but not less than a millionth of the payload
        [kg].
    step : float, optional
        First step of the incremental method, `accuracy` to 1e6; 1 or `accuracy` if that is more
        [kg].
    start_from : MaxPayload, SearchStart or Neighbours, optional
        A search of a similar task by the direct method, or a motion of one, tried first. From two
        neighbours on a line of tasks the motion is extrapolated, which takes a fraction of the
        time where motors switch alike.

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
    _check(task)
    model = ArmModel.for_arm(task.arm, model)  # before a clock starts
    solver = (solver or Solver()).watched_by(monitor)
    began = solver.monitor.iteration, solver.monitor.elapsed
    problem = MotionProblem(model, task, task_parameters(task))
    search = LimitSearch(PAYLOAD, problem, solver, accuracy)
    try:
        if method is PayloadMethod.DIRECT:
            found = _search_directly(search, problem, solver, start_from)
        else:
            found = _search_in_steps(problem, solver, step, accuracy)
    except StoppedError as error:
        found = _result(search, task, method, STOP_STATUS[error.reason], str(error))
    return replace(found, iterations=solver.monitor.iteration - began[0],
                   planning_time=solver.monitor.elapsed - began[1])


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


def _search_directly(search: LimitSearch, problem: MotionProblem, solver: Solver,
                     start: MaxPayload | SearchStart | Neighbours | None) -> MaxPayload:
    """Follow the price to the limit, then plan there."""
    method, task = PayloadMethod.DIRECT, problem.task
    neighbours = start if isinstance(start, Neighbours) else Neighbours()
    failure = search.follow_price(_start(start), neighbours)
    if failure is not None:
        return _result(search, task, method, failure.status, failure.message)
    plan = search.plan()
    last, near = search.last, search.is_near
    found = replace(_result(search, task, method, plan.status, plan.message), plan=plan,
                    payload=last.value, upper=last.value + last.gap)
    if not near:
        held = _hold(problem, last, found, solver)
        if held is not None:
            return held
    if not plan.solved:
        return replace(found, payload=0.0)
    if not near:
        return replace(found, status=PlanStatus.NOT_CONVERGED, message=(
            f'{found.payload:.6g} kg can be carried, but it was not shown that no more can'))
    return _describe(found)


def _hold(problem: MotionProblem, last: Extremal, found: MaxPayload,
          solver: Solver) -> MaxPayload | None:
    """Return the outcome where the goal is what the motors can just hold; None if it is not."""
    limit, joint = holding_limit(problem.model, problem.task, problem.parameters)
    if not np.isfinite(limit) or limit * _HELD <= last.value:
        return None
    heaviest = PAYLOAD.with_value(problem, limit * _HELD)
    plan = plan_near(heaviest, last.result.solution, solver)
    if plan.status in INTERRUPTED_STATUS.values():
        return replace(found, status=plan.status, message=plan.message, payload=0.0,
                       upper=np.inf, plan=None)
    if not plan.solved:
        return None
    return _describe(replace(found, status=plan.status, payload=limit * _HELD, upper=limit,
                             plan=plan, held=True, limiting_joint=joint))


def _search_in_steps(problem: MotionProblem, solver: Solver, step: float,
                     accuracy: float) -> MaxPayload:
    """Raise the payload of the task step by step."""
    method, task, trials = PayloadMethod.INCREMENTAL, problem.task, list[PayloadTrial]()
    first = plan_problem(problem, solver)
    failed = MaxPayload(task=task, method=method, status=first.status, message=first.message)
    if first.solution is None or not first.solved:
        return failed
    solver.monitor.phase = 'payload raised'
    best, upper = (task.payload_mass, first.solution), np.inf
    for trial in raise_payload(problem, first.solution, step=step, accuracy=accuracy,
                               solver=solver):
        trials.append(trial)
        if trial.interrupted:
            return replace(failed, status=INTERRUPTED_STATUS[trial.result.status],
                           message=trial.result.message, trials=tuple(trials))
        if trial.solved:
            best = trial.payload, trial.result.solution
        else:
            upper = trial.payload
    plan = plan_near(PAYLOAD.with_value(problem, best[0]), best[1], solver)
    upper = min(upper, holding_limit(problem.model, task, problem.parameters)[0])
    found = replace(failed, status=plan.status, message=plan.message, plan=plan, upper=upper,
                    payload=best[0] if plan.solved else 0.0, trials=tuple(trials))
    return _describe(found) if plan.solved else found


def _result(search: LimitSearch, task: Task, method: PayloadMethod, status: PlanStatus,
            message: str) -> MaxPayload:
    """Return the outcome of a search so far, without a plan."""
    return MaxPayload(task=task, method=method, status=status, message=message,
                      front=_front(search.priced), extremals=search.priced, warm=search.warm)


def _start(given: MaxPayload | SearchStart | Neighbours | None) -> SearchStart | None:
    """Return the motion that a search starts from, if there is one."""
    if given is None or isinstance(given, SearchStart):
        return given
    result = given.near if isinstance(given, Neighbours) else given
    point = None if result is None else result.restart_point
    return None if point is None else SearchStart.of(point)


def _front(priced: tuple[Extremal, ...]) -> PayloadFront:
    """Return the cost of the payloads."""
    efforts = [integrate_totals(one.problem, one.result.solution).cost for one in priced]
    return PayloadFront(payloads=np.array([one.value for one in priced]),
                        efforts=np.array(efforts), prices=np.array([one.price for one in priced]))


def _describe(found: MaxPayload) -> MaxPayload:
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
