"""
The search for the maximum payload with the payload as an unknown.

It always ends with what it has: the heaviest payload with a certified plan, and where its kind of
motion ends if that is known. Errors of payloads that it tries stay inside.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import StoppedError
from flex_planner.capacity.bracket import bracket_width
from flex_planner.capacity.extrapolation import Neighbours
from flex_planner.capacity.known_starts import plan_near
from flex_planner.capacity.limit_search import LimitSearch
from flex_planner.capacity.payload_outcome import describe, with_bound
from flex_planner.capacity.results import MaxPayload, PayloadFront, PayloadMethod, say_lost_weights
from flex_planner.capacity.within_limits import carry_within_limits, is_touched
from flex_planner.collocation import Solver
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.bending import find_largest_bending, LARGEST, limits_of_model
from flex_planner.planning.kinds.clusters import MOST_KINDS
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.kinds_strategy import as_guess
from flex_planner.planning.kinds.search import find_kinds
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import INTERRUPTED_STATUS, plan_problem, STOP_STATUS
from flex_planner.planning.proofs import is_payload_bounded
from flex_planner.planning.strategies.catalogue import BARRIER, QUICK
from flex_planner.planning.strategies.extremals import Extremal, SearchStart
from flex_planner.planning.strategies.free_parameters import PAYLOAD
from flex_planner.planning.strategies.homotopies import drop_weights
from flex_planner.planning.strategies.limit_barrier import is_cheap, reach_exactly
from flex_planner.planning.within_model import bound_bending, bound_by_limits
import numpy as np

# of the payload that the motors can just hold, kept clear of rounding
_HELD = 1 - 1e-9
# of it, up to which an exploration has come to it
_REACHED = 1e-3
# Newton iterations of a first try with that payload
_FIRST_TRY = 15
# kinds of the rigid arm that are lifted
_LIFTED = 2


def search_directly(problem: MotionProblem, solver: Solver, accuracy: float,
                    effort: SearchEffort,
                    start: MaxPayload | SearchStart | Neighbours | None) -> MaxPayload:
    """Follow the price to the limit, then plan there."""
    search, at_once = LimitSearch(PAYLOAD, problem, solver, accuracy, effort), _AtOnce()
    try:
        if start is None:
            at_once = _find_at_once(search, problem, accuracy, effort)
        held = at_once.answer
        if held is not None and not (held.held or held.within_limits):
            return with_bound(held, problem)
        found = held or _follow(search, problem, solver, start, accuracy)
    except StoppedError as error:
        found = _certified_so_far(search, _result(
            search, problem, STOP_STATUS[error.reason], str(error)))
    except FlexPlannerError as error:  # of a payload that was tried
        found = _certified_so_far(search, _result(
            search, problem, PlanStatus.NOT_CONVERGED, str(error)))
    return describe(with_bound(_heavier(found, at_once.certified), problem))


def _follow(search: LimitSearch, problem: MotionProblem, solver: Solver,
            start: MaxPayload | SearchStart | Neighbours | None,
            accuracy: float) -> MaxPayload:
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
    limited = bound_by_limits(problem, plan)
    if limited is not None:
        within = carry_within_limits(limited, solver, accuracy, found)
        if within is not None:
            return within
        found = replace(found, local_upper=np.inf)  # what ends is a motion beyond the limits
    held = None if near else _hold(problem, search, found, solver)
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _AtOnce:
    """The outcome where no price is followed, or else one that is certified, but not the limit."""

    answer: MaxPayload | None = None
    certified: MaxPayload | None = None


def _find_at_once(search: LimitSearch, problem: MotionProblem, accuracy: float,
                  effort: SearchEffort) -> _AtOnce:
    """Return the outcome where no price need be followed, or none can be."""
    solver = search.solver
    if _bends_too_far(problem):  # so does what can be held
        found = _carry_within_model(problem, solver, accuracy, effort)
        if found is not None and found.solved and found.plan is not None and (
                is_touched(found.plan)):
            return _AtOnce(answer=found)
        return _AtOnce(answer=_carry_the_most(problem, solver), certified=found)
    answer = _hold_at_once(problem, solver) or _carry_the_most(problem, solver)
    if answer is not None or not _may_ring(problem):
        return _AtOnce(answer=answer)
    search.known = reach_exactly(PAYLOAD, drop_weights(problem), solver,
                                 lambda value: bracket_width(accuracy, value))
    if search.known is not None:
        return _AtOnce()
    found = _carry_within_model(problem, solver, accuracy, effort, ringing=True)
    bent = found is not None and found.plan is not None and is_touched(found.plan)
    if found is None or not found.solved or (bent and problem.task.allow_large_bending):
        return _AtOnce(certified=found)
    return _AtOnce(answer=found)


def _heavier(found: MaxPayload, other: MaxPayload | None) -> MaxPayload:
    """Return the outcome of a search, or what was certified before it where that is more."""
    if other is None or found.solved or found.status is PlanStatus.CANCELED or (
            other.payload <= found.payload):
        return found
    status = PlanStatus.NOT_CONVERGED if other.solved else other.status
    if found.status is PlanStatus.TIMEOUT:
        return replace(other, status=found.status, message=f'{found.message}; {other.message}')
    return replace(other, status=status)


def _carry_within_model(problem: MotionProblem, solver: Solver, accuracy: float,
                        effort: SearchEffort, *, ringing: bool = False) -> MaxPayload | None:
    """
    Return the outcome by the interior-point method alone where an exact one is out of reach.

    Where links bend too far with less than the motors can carry, motions with much more are none
    of the arm, and hard to find: their weight pulls along the links. Where clamped links ring, the
    torques of the largest payload switch too often. None where nothing is certified.

    """
    bounded = bound_bending(problem)
    if bounded is None:
        return None
    starts = effort.starts if effort.explores else 0
    kinds = find_kinds(drop_weights(bounded), PAYLOAD.unknown, starts, solver)
    found = carry_within_limits(bounded, solver, accuracy, MaxPayload(
        task=problem.task, method=PayloadMethod.DIRECT, status=PlanStatus.NOT_FOUND, message='',
        kinds=tuple(kinds[:MOST_KINDS]), starts=starts), [
            as_guess(bounded, kind, solver) for kind in kinds[:_LIFTED]], ringing=ringing)
    return found if found is not None and found.plan is not None else None


def _may_ring(problem: MotionProblem) -> bool:
    """Return whether torques drive the bending of their own links, on a mesh that is cheap."""
    arm = problem.model.arm
    if isinstance(arm, SpatialArm) or not (limits_of_model(arm) and is_cheap(PAYLOAD, problem)):
        return False
    return any(link.mode_shapes().tip_deflection.any() for link in arm.links if link.modes)


def _bends_too_far(problem: MotionProblem) -> bool:
    """Return whether links may not bend as far as they do by what the motors hold."""
    arm = problem.model.arm
    if problem.task.allow_large_bending or not (arm.gravity.any() and limits_of_model(arm)):
        return False
    limit = holding_limit(problem.model, problem.task, problem.parameters)[0]
    try:
        heaviest = PAYLOAD.with_value(problem, min(limit * _HELD, MAX_PAYLOAD))
    except FlexPlannerError:  # the links give way first
        return True
    goal = heaviest.goal[None, :arm.n_coordinates]
    return find_largest_bending(arm, goal).share > LARGEST


def _hold_at_once(problem: MotionProblem, solver: Solver) -> MaxPayload | None:
    """Return the outcome if what the motors can just hold is carried by a first try."""
    limit, joint = holding_limit(problem.model, problem.task, problem.parameters)
    if not np.isfinite(limit) or limit * _HELD <= problem.task.payload_mass:
        return None
    solver.monitor.phase = 'the payload that can be held'
    heaviest = PAYLOAD.with_value(problem, limit * _HELD)
    plan = plan_problem(heaviest, solver.patient(_FIRST_TRY), QUICK[:2])
    if plan.status is PlanStatus.NOT_CONVERGED:
        plan = plan_problem(heaviest, solver, BARRIER)
    return _held(plan, limit, joint, MaxPayload(
        task=problem.task, method=PayloadMethod.DIRECT, status=plan.status,
        message=plan.message))


def _carry_the_most(problem: MotionProblem, solver: Solver) -> MaxPayload | None:
    """Return the outcome if the most that a task may carry is no limit, and is carried."""
    if is_payload_bounded(problem):
        return None
    solver.monitor.phase = 'the largest payload of all tasks'
    try:
        plan = plan_problem(PAYLOAD.with_value(problem, MAX_PAYLOAD), solver.patient(_FIRST_TRY),
                            QUICK[:2])
    except FlexPlannerError:  # too heavy to hold
        return None
    if not plan.solved:
        return None
    return MaxPayload(
        task=problem.task, method=PayloadMethod.DIRECT, status=plan.status, plan=plan,
        payload=MAX_PAYLOAD, limiting_joint=int(plan.saturation.argmax()), message=(
            f'{MAX_PAYLOAD:g} kg can be carried, certified: a task may ask for no more, and the '
            'motors are not the limit'))


def _hold(problem: MotionProblem, search: LimitSearch, found: MaxPayload,
          solver: Solver) -> MaxPayload | None:
    """Return the outcome where the goal is what the motors can just hold; None if it is not."""
    limit, joint = holding_limit(problem.model, problem.task, problem.parameters)
    if not np.isfinite(limit) or limit * _HELD <= search.last.value:
        return None
    heaviest = PAYLOAD.with_value(problem, limit * _HELD)
    # kinds that an exploration followed up to that payload
    kinds = [as_guess(heaviest, kind, solver) for kind in search.kinds
             if kind.value > (1 - _REACHED) * limit]
    for start in (search.last.result.solution, *kinds):
        held = _held(plan_near(heaviest, start, solver), limit, joint, found)
        if held is not None:
            return held
    return None


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
    known = search.certify_so_far(stopped=found.status is PlanStatus.TIMEOUT)
    if known is None:
        return found
    extremal, plan = known
    status = (PlanStatus.NOT_CONVERGED if found.status is PlanStatus.CERTIFICATE_FAILED
              else found.status)  # what was certified carries less than what was not
    return replace(found, status=status, plan=plan, payload=extremal.value,
                   local_upper=extremal.value + extremal.gap,
                   message=f'{found.message}{say_lost_weights(found.task, plan)}')


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
