"""
Maximum payload between two postures: Korayem et al. 2009, section 4.2.

`find_max_payload` answers with the largest payload that a certified plan carries, where its kind
of motion ends, and what no motion can carry, as far as that is proved. What can be carried does
not depend on the weights of the task: the direct search minimises effort alone, and the weights
shape the plan at the end.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import HoldingError, InvalidTaskError
from flex_planner.base.processes import helper_processes
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import number
from flex_planner.capacity.extrapolation import Neighbours
from flex_planner.capacity.payload_methods import search_directly
from flex_planner.capacity.payload_outcome import with_bound
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.capacity.rigid_search import search_as_rigid
from flex_planner.capacity.step_search import search_in_steps
from flex_planner.capacity.without_jumps import carry_without_jumps
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import MAX_PAYLOAD, Task
from flex_planner.optimal_control.via_points import free_times
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.proofs import (
    bound_payload,
    check_duration,
    find_doubt,
    find_proof,
    Proof,
    prove_not_held,
)
from flex_planner.planning.smooth_torques import (
    refuse_torque_rates,
    STIFF_LINKS,
    without_torque_rates,
)
from flex_planner.planning.stiff_links import find_stiff_links
from flex_planner.planning.strategies.extremals import SearchStart
import numpy as np

_MIN_ACCURACY, _MAX_ACCURACY = 1e-6, 1e3
_STEP = 1.0
# joint angles that differ by less are the same [rad]
_SAME = 1e-9


def find_max_payload(task: Task, *, model: ArmModel | None = None, solver: Solver | None = None,
                     monitor: Monitor | None = None,
                     method: PayloadMethod = PayloadMethod.DIRECT, accuracy: float = 1e-3,
                     step: float | None = None,
                     start_from: MaxPayload | SearchStart | Neighbours | None = None,
                     search: SearchEffort | str = SearchEffort.NORMAL) -> MaxPayload:
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
        time where motors switch alike. The search then stays in the kind of that motion.
    search : SearchEffort or str
        How many kinds of motion the direct method looks for: ``'fast'`` follows one, ``'normal'``
        explores 16 starts, ``'thorough'`` 48.

    Returns
    -------
    MaxPayload
        Check `MaxPayload.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If no motor has a limit, if the goal is the start, if the duration is free or absurdly
        short, if the arm need not come to rest at the goal, if a via point has no time, or if the
        incremental method is to keep limits on the way or rates of torques.
    InvalidValueError
        If accuracy or step breaks its bound.

    """
    number('accuracy', accuracy, at_least=_MIN_ACCURACY, at_most=_MAX_ACCURACY, unit='kg')
    step = max(_STEP, accuracy) if step is None else step
    number('step', step, at_least=accuracy, at_most=MAX_PAYLOAD, unit='kg')
    effort = SearchEffort.of(search)
    helper_processes()  # what the environment says is refused before anything is solved
    _check(task)
    if method is PayloadMethod.INCREMENTAL:
        refuse_torque_rates(task, 'the incremental method: the direct method keeps them')
    if task.path_constraints and method is PayloadMethod.INCREMENTAL:
        raise InvalidTaskError('path_constraints are given, but must be left out for the '
                               'incremental method: it knows only motions that no limit on the '
                               'way bends. The direct method keeps them')
    model = ArmModel.for_arm(task.arm, model)  # before a clock starts
    solver = (solver or Solver()).watched_by(monitor)
    began = solver.monitor.iteration, solver.monitor.elapsed
    try:
        problem = MotionProblem(model, task, task_parameters(task))
    except HoldingError as error:
        problem = MotionProblem(model, task, task_parameters(task), holds=False)
        return _impossible(problem, method, prove_not_held(error, task.payload_mass))
    proof = find_proof(problem)
    if proof is not None:
        return _impossible(problem, method, proof)
    check_duration(problem)
    doubt = find_doubt(problem)
    if doubt is not None:
        return MaxPayload(task=task, method=method, status=PlanStatus.NOT_FOUND, message=doubt)
    if task.has_torque_rates:
        return _carry_smoothly(problem, solver, accuracy, effort, start_from)
    rigid = search_as_rigid(problem, solver, lambda stiff: find_max_payload(
        stiff, solver=solver, method=method, accuracy=accuracy, step=step, start_from=start_from,
        search=effort))
    if rigid is not None:
        return with_bound(rigid, problem)
    if method is PayloadMethod.DIRECT:
        found = search_directly(problem, solver, accuracy, effort, start_from)
    else:
        found = search_in_steps(problem, solver, step, accuracy)
    return replace(found, iterations=solver.monitor.iteration - began[0],
                   planning_time=solver.monitor.elapsed - began[1])


def _carry_smoothly(problem: MotionProblem, solver: Solver, accuracy: float, effort: SearchEffort,
                    start: MaxPayload | SearchStart | Neighbours | None) -> MaxPayload:
    """Return the outcome for torques without jumps, from that for torques that may jump."""
    task, began = problem.task, (solver.monitor.iteration, solver.monitor.elapsed)
    jumping = without_torque_rates(task)
    if find_stiff_links(MotionProblem(problem.model, jumping, problem.parameters), solver):
        return MaxPayload(task=task, method=PayloadMethod.DIRECT, status=PlanStatus.NOT_FOUND,
                          message=STIFF_LINKS)
    free = find_max_payload(jumping, model=problem.model, solver=solver, accuracy=accuracy,
                            start_from=start, search=effort)
    try:
        found = carry_without_jumps(task, free, solver, accuracy)
    except StoppedError as error:
        found = replace(free, task=task, status=STOP_STATUS[error.reason], message=str(error),
                        plan=None, payload=0.0)
    return replace(found, iterations=solver.monitor.iteration - began[0],
                   planning_time=solver.monitor.elapsed - began[1])


def stays(task: Task) -> bool:
    """Return whether a task begins where it ends, at rest, but for what rounding may add."""
    apart = np.abs(task.goal_positions - task.start_positions).max()
    return task.starts_at_rest and bool(apart <= _SAME)


def _check(task: Task) -> None:
    """Refuse a task that has no largest payload."""
    if not np.isfinite([joint.motor.standstill_torque for joint in task.arm.joints]).any():
        raise InvalidTaskError('no motor of the arm has a stall torque, so no payload is the '
                               'largest')
    if task.time_weight:
        raise InvalidTaskError(f'time_weight is {task.time_weight:g}, but must be 0: the largest '
                               'payload is that of a given duration')
    if free_times(task.via_points):
        raise InvalidTaskError('a via point has no time, but must have one: the largest payload '
                               'is that of via points at given times')
    if not (task.arm.gravity.any() or task.via_points) and stays(task):
        raise InvalidTaskError('goal_positions are start_positions: no payload is too large for '
                               'an arm that stays where it is')
    if not task.ends_at_rest:
        raise InvalidTaskError('the largest payload is that of a motion which ends at rest: '
                               'goal_position_weights and goal_velocity_weights must be inf, '
                               'goal_velocities 0')


def _impossible(problem: MotionProblem, method: PayloadMethod, proof: Proof) -> MaxPayload:
    """
    Return the outcome where no motion carries even the payload of the task.

    More is another question: a payload may be a counterweight, or its fall may lift the arm.

    """
    bound = bound_payload(problem)
    return MaxPayload(task=problem.task, method=method, status=PlanStatus.INFEASIBLE,
                      message=str(proof), proved_upper=bound.payload,
                      proof=bound.proof or proof)
