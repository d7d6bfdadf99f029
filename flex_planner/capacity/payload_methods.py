"""
The two searches for the maximum payload: with the payload as an unknown, and step by step.

Both always end with what they have: the heaviest payload with a certified plan, and where its
kind of motion ends if that is known. Errors of payloads that they try stay inside.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import StoppedError
from flex_planner.capacity.extrapolation import Neighbours
from flex_planner.capacity.incremental import PayloadTrial, raise_payload
from flex_planner.capacity.limit_search import in_grace, LimitSearch, plan_near
from flex_planner.capacity.results import (
    describe_kinds,
    MaxPayload,
    PayloadFront,
    PayloadMethod,
)
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.kinds.clusters import MOST_KINDS
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import INTERRUPTED_STATUS, plan_problem, STOP_STATUS
from flex_planner.planning.proofs import bound_payload
from flex_planner.planning.strategies.catalogue import QUICK
from flex_planner.planning.strategies.extremals import Extremal, SearchStart
from flex_planner.planning.strategies.free_parameters import PAYLOAD
import numpy as np

# of the payload that the motors can just hold, kept clear of rounding
_HELD = 1 - 1e-9
# of a bound that is reached
_ROUNDING = 1e-6
# Newton iterations of a first try with that payload
_FIRST_TRY = 15


def search_directly(problem: MotionProblem, solver: Solver, accuracy: float,
                    effort: SearchEffort,
                    start: MaxPayload | SearchStart | Neighbours | None) -> MaxPayload:
    """Follow the price to the limit, then plan there."""
    search = LimitSearch(PAYLOAD, problem, solver, accuracy, effort)
    try:
        held = None if start is not None else _hold_at_once(problem, solver)
        found = held or _follow(search, problem, solver, start)
    except StoppedError as error:
        found = _certified_so_far(search, _result(
            search, problem, STOP_STATUS[error.reason], str(error)))
    except FlexPlannerError as error:  # of a payload that was tried
        found = _certified_so_far(search, _result(
            search, problem, PlanStatus.NOT_CONVERGED, str(error)))
    return _describe(_with_bound(found, problem))


def _follow(search: LimitSearch, problem: MotionProblem, solver: Solver,
            start: MaxPayload | SearchStart | Neighbours | None) -> MaxPayload:
    """Follow the price, plan at its end, and see whether the goal can be held with more."""
    neighbours = start if isinstance(start, Neighbours) else Neighbours()
    failure = search.follow_price(_start(start), neighbours)
    if failure is not None:
        return _certified_so_far(search, _result(
            search, problem, failure.status, failure.message))
    plan = search.plan()
    last, near = search.last, search.is_near
    found = replace(_result(search, problem, plan.status, plan.message), plan=plan,
                    payload=last.value if plan.solved else 0.0,
                    local_upper=last.value + last.gap)
    held = None if near else _hold(problem, last, found, solver)
    if held is not None or not plan.solved:
        return _certified_so_far(search, held or found)
    if not near:
        return replace(found, status=PlanStatus.NOT_CONVERGED, message=(
            f'{found.payload:.6g} kg can be carried, but where this kind of motion ends was not '
            'found'))
    best = search.explored_best
    if best is not None:
        return replace(found, status=PlanStatus.NOT_CONVERGED, message=(
            f'{found.payload:.6g} kg can be carried; {best.value:.6g} kg were found by direct '
            f'collocation on two meshes ({best.sentence}), but not certified'))
    return found


def _hold_at_once(problem: MotionProblem, solver: Solver) -> MaxPayload | None:
    """Return the outcome if what the motors can just hold is carried by a first try."""
    limit, joint = holding_limit(problem.model, problem.task, problem.parameters)
    if not np.isfinite(limit) or limit * _HELD <= problem.task.payload_mass:
        return None
    solver.monitor.phase = 'the payload that can be held'
    plan = plan_problem(PAYLOAD.with_value(problem, limit * _HELD), solver.patient(_FIRST_TRY),
                        QUICK[:2])
    return _held(plan, limit, joint, MaxPayload(
        task=problem.task, method=PayloadMethod.DIRECT, status=plan.status,
        message=plan.message))


def _hold(problem: MotionProblem, last: Extremal, found: MaxPayload,
          solver: Solver) -> MaxPayload | None:
    """Return the outcome where the goal is what the motors can just hold; None if it is not."""
    limit, joint = holding_limit(problem.model, problem.task, problem.parameters)
    if not np.isfinite(limit) or limit * _HELD <= last.value:
        return None
    heaviest = PAYLOAD.with_value(problem, limit * _HELD)
    return _held(plan_near(heaviest, last.result.solution, solver), limit, joint, found)


def _held(plan: Plan, limit: float, joint: int, found: MaxPayload) -> MaxPayload | None:
    """Return the outcome with a plan that carries what can be held; None without one."""
    if plan.status in INTERRUPTED_STATUS.values():
        return replace(found, status=plan.status, message=plan.message)
    if not plan.solved:
        return None
    return replace(found, status=plan.status, payload=limit * _HELD, local_upper=limit,
                   plan=plan, held=True, limiting_joint=joint)


def _certified_so_far(search: LimitSearch, found: MaxPayload) -> MaxPayload:
    """Return the outcome of a search that failed with the heaviest payload that it can certify."""
    if found.status is PlanStatus.CANCELED or found.plan is not None and found.plan.solved:
        return found
    known = search.certify_so_far()
    if known is None:
        return found
    extremal, plan = known
    return replace(found, plan=plan, payload=extremal.value,
                   local_upper=extremal.value + extremal.gap)


def search_in_steps(problem: MotionProblem, solver: Solver, step: float,
                    accuracy: float) -> MaxPayload:
    """Raise the payload of the task step by step, as in fig. 2 of the paper."""
    method, task, trials = PayloadMethod.INCREMENTAL, problem.task, list[PayloadTrial]()
    first = plan_problem(problem, solver)
    found = MaxPayload(task=task, method=method, status=first.status, message=first.message)
    if first.solution is None or not first.solved:
        return found
    solver.monitor.phase = 'payload raised'
    best: tuple[float, CollocationSolution] = (task.payload_mass, first.solution)
    upper, stopped = np.inf, None
    try:
        for trial in raise_payload(problem, first.solution, step=step, accuracy=accuracy,
                                   solver=solver):
            trials.append(trial)
            if trial.solved:
                best = trial.payload, trial.result.solution
            elif trial.interrupted:
                stopped = INTERRUPTED_STATUS[trial.result.status], trial.result.message
            else:
                upper = trial.payload
    except StoppedError as error:
        stopped = STOP_STATUS[error.reason], str(error)
    heaviest = PAYLOAD.with_value(problem, best[0])
    plan = plan_near(heaviest, best[1], solver)
    status, message = stopped or (plan.status, plan.message)
    if status is PlanStatus.TIMEOUT:
        plan = plan_near(heaviest, best[1], in_grace(solver))
    held = holding_limit(problem.model, task, problem.parameters)[0]
    found = replace(found, status=status, message=message, trials=tuple(trials),
                    local_upper=min(upper, held))
    if plan.solved:
        found = replace(found, plan=plan, payload=best[0])
    refused = next((trial.refusal for trial in trials if trial.payload == upper), '')
    if refused and plan.solved and stopped is None:
        return replace(_with_bound(found, problem), message=(
            f'{found.payload:.6g} kg can be carried, {upper:.6g} kg cannot by this kind of '
            f'motion: {refused}'))
    return _describe(_with_bound(found, problem))


def _with_bound(found: MaxPayload, problem: MotionProblem) -> MaxPayload:
    """Return an outcome with what is proved from above."""
    bound = bound_payload(problem)
    return replace(found, proved_upper=bound.payload, proof=bound.proof)


def _result(search: LimitSearch, problem: MotionProblem, status: PlanStatus,
            message: str) -> MaxPayload:
    """Return the outcome of a search so far, without a plan."""
    return MaxPayload(task=problem.task, method=PayloadMethod.DIRECT, status=status,
                      message=message, front=_front(search.priced), extremals=search.priced,
                      warm=search.warm, kinds=tuple(search.kinds[:MOST_KINDS]),
                      starts=search.starts)


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
    """Return an outcome in words, with its limiting motor."""
    if found.plan is None or not found.plan.solved:
        return found
    joint, shares = found.limiting_joint, found.plan.saturation
    joint = int(shares.argmax()) if joint is None else joint
    found = replace(found, limiting_joint=joint)
    if found.status is not PlanStatus.SOLVED:
        return replace(found, message=f'{found.message} ({found.payload:.6g} kg are certified)')
    if found.held:
        proved = found.proved_upper <= found.local_upper * (1 + _ROUNDING)
        return replace(found, message=(
            f'{found.payload:.6g} kg can be carried, certified; joint {joint + 1} can hold no '
            f'more at the goal{": no motion carries more" if proved else ""}'))
    words = [f'{found.payload:.6g} kg can be carried, certified{describe_kinds(found)}',
             f'this kind of motion ends at {found.local_upper:.6g} kg: the motor of joint '
             f'{joint + 1} is on its limit for {shares[joint]:.1%} of the time']
    if np.isfinite(found.proved_upper):
        words.append(f'no motion carries more than {found.proved_upper:.4g} kg')
    return replace(found, message='; '.join(words))
