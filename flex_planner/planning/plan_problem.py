"""From a problem to a certified plan: strategies in order, then the certificate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flex_planner.base.progress import StoppedError, StopReason
from flex_planner.collocation import CollocationResult, Solver, SolverStatus
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.optimal_control.via_points import free_times
from flex_planner.planning.advice import suggest_changes
from flex_planner.planning.certificate import CertificateLimits, certify
from flex_planner.planning.kinds.cheaper import find_cheaper
from flex_planner.planning.kinds.clusters import are_alike, MOST_KINDS
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.largest_rates import find_largest_rates
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.strategies.catalogue import CATALOGUE, order_strategies
from flex_planner.planning.strategies.initial_guesses import SMOOTHED, WARM_START
from flex_planner.planning.strategies.price_continuation import free_duration
from flex_planner.planning.strategies.strategy import Attempt, Strategy
from flex_planner.planning.strategies.try_strategies import TriedStrategy, try_strategies
from flex_planner.planning.strategies.via_times import (
    choose_via_times,
    free_via_times,
    move_free_via_points,
    TimedMotion,
)
from flex_planner.planning.verdict import judge
from flex_planner.planning.warnings import find_arm_warnings

INTERRUPTED_STATUS = {SolverStatus.TIMEOUT: PlanStatus.TIMEOUT,
                      SolverStatus.CANCELED: PlanStatus.CANCELED}
STOP_STATUS = {StopReason.TIMEOUT: PlanStatus.TIMEOUT, StopReason.CANCELED: PlanStatus.CANCELED}

_REFINEMENTS = 2
_REFINEMENT_FACTOR = 10.0
_STRICTER = 100.0
_MOVED = 'homotopy in via points at free times'
# longer guesses of a free duration
_GUESSES = (2.0, 4.0, 8.0)


def plan_problem(problem: MotionProblem, solver: Solver,
                 strategies: Sequence[Strategy] = CATALOGUE,
                 effort: SearchEffort = SearchEffort.FAST, *, substitutes: bool = False) -> Plan:
    """
    Return the certified plan of a problem by the first strategy that solves it.

    Unless it was a warm start, cheaper kinds of motion are looked for then; where that ends for
    want of time, or leads to nothing that can be certified, the plan is the first one.

    Parameters
    ----------
    problem : MotionProblem
        The motion.
    solver : Solver
        Its monitor may interrupt the work.
    strategies : sequence of Strategy
        At least one, in the order in which they are tried, see `order_strategies`.
    effort : SearchEffort
        Whether cheaper kinds of motion are looked for.
    substitutes : bool
        Whether a plan of the same task with other weights will do, see `calm_links`; the task of
        the plan has them.

    """
    tried: list[TriedStrategy] = []
    try:
        strategies = order_strategies(problem, solver, strategies)
        if problem.task.time_weight:
            problem, strategy, attempt = _solve_in_any_time(problem, solver, strategies, tried)
        elif free_times(problem.task.via_points):
            problem, strategy, attempt = _solve_at_via_times(problem, solver, strategies, tried)
        else:
            strategy, attempt = try_strategies(problem, solver, strategies, tried,
                                               substitutes=substitutes)
            if attempt.substitute is not None:
                problem = attempt.substitute.problem
        plan = _conclude(problem, strategy, attempt, solver)
        if (effort.explores and strategy != WARM_START and plan.solution is not None
                and not problem.junctions.size  # kinds are looked for without via points
                and plan.status not in STOP_STATUS.values()
                and plan.cost > 0):  # nothing is cheaper than nothing
            plan = _look_for_cheaper(plan, attempt, solver, effort)
    except StoppedError as error:
        plan = Plan(task=problem.task, status=STOP_STATUS[error.reason], message=str(error),
                    strategy='', problem=problem, solution=None)
    # where there is no motion to judge, the arm may say why
    warnings = plan.warnings or find_arm_warnings(problem.task.arm)
    return replace(plan, warnings=warnings, iterations=solver.monitor.iteration,
                   tried=tuple(tried), planning_time=solver.monitor.elapsed)


def _solve_at_via_times(
        problem: MotionProblem, solver: Solver, strategies: Sequence[Strategy],
        tried: list[TriedStrategy]) -> tuple[MotionProblem, str, Attempt]:
    """
    Solve a task whose via points have free times: at times that are near, then at the best.

    Where no quick strategy leads from such times to the best they may be too demanding; then via
    points are moved with free times.

    """
    near = choose_via_times(problem, solver)
    warm = any(strategy.name in (WARM_START, SMOOTHED) for strategy in strategies)
    quick = [strategy for strategy in strategies if strategy.quick] or strategies
    homes = [problem, near.problem] if warm else [near.problem, problem]
    found, names, failures = near, list[str](), list[str]()
    for home in homes if near.problem is not problem else homes[:1]:
        name, attempt = try_strategies(home, solver, quick, tried)
        found = (free_via_times(home, attempt.result, solver) if attempt.result.converged
                 else TimedMotion(home, attempt.result))
        if found.result.converged or found.result.status in INTERRUPTED_STATUS:
            return found.problem, name, Attempt(result=found.result)
        names, failures = [*names, name], [*failures, found.result.message]
    solver.monitor.phase = _MOVED
    moved = move_free_via_points(near, solver)
    if moved.result.converged or moved.result.status in INTERRUPTED_STATUS:
        return moved.problem, _MOVED, Attempt(result=moved.result)
    slow = [strategy for strategy in strategies if strategy not in quick]
    name, attempt = try_strategies(near.problem, solver, slow, tried)
    if attempt.result.converged:
        found = free_via_times(near.problem, attempt.result, solver)
        return found.problem, name, Attempt(result=found.result)
    message = '; '.join(dict.fromkeys([*failures, moved.result.message, attempt.result.message]))
    return near.problem, ', '.join(dict.fromkeys([*names, _MOVED, name])), replace(
        attempt, result=replace(attempt.result, message=message))


def _look_for_cheaper(plan: Plan, attempt: Attempt, solver: Solver,
                      effort: SearchEffort) -> Plan:
    """Return the plan of the cheapest kind of motion, with the kinds that were met."""
    cheapest = find_cheaper(plan.problem, attempt.result, solver, effort, attempt.kinds)
    if solver.monitor.canceled():
        raise StoppedError(StopReason.CANCELED)
    others = [kind for kind in attempt.kinds if not any(
        are_alike(kind.motion.angles, one.motion.angles) for one in cheapest.kinds)]
    met = Attempt(result=cheapest.result, kinds=(*cheapest.kinds, *others),
                  starts=cheapest.starts + attempt.starts - 1)
    if met.result is attempt.result:
        plan = replace(plan, kinds=met.kinds[:MOST_KINDS], starts=met.starts)
        return replace(plan, message=describe_choice(plan)) if plan.solved else plan
    other = conclude(cheapest.problem, plan.strategy, met, solver)
    if other.status is PlanStatus.CANCELED:
        return other
    better = other.solved > plan.solved or other.cost < plan.cost
    return other if better and other.solved >= plan.solved else plan


def conclude(problem: MotionProblem, strategy: str, attempt: Attempt,
             solver: Solver) -> Plan:
    """Return the plan of another motion of the same task, in the time that is best for it."""
    if problem.task.time_weight:
        problem, result = free_duration(problem, attempt.result, solver)
        attempt = replace(attempt, result=result)
    return _conclude(problem, strategy, attempt, solver)


def _solve_in_any_time(problem: MotionProblem, solver: Solver, strategies: Sequence[Strategy],
                       tried: list[TriedStrategy]) -> tuple[MotionProblem, str, Attempt]:
    """Solve for the duration of the task or a longer one, then free it."""
    useful = [_without_verdict(strategy) for strategy in strategies]
    quick = [strategy for strategy in useful if strategy.quick] or useful
    slow = [strategy for strategy in useful if strategy not in quick]
    strategy, attempt = try_strategies(problem, solver, quick, tried)
    for factor in _GUESSES:
        longer = factor * problem.task.duration
        if attempt.result.status is not SolverStatus.NEWTON_FAILED or longer > MAX_DURATION:
            break
        stretched = problem.with_changes(duration=longer)
        strategy, attempt = try_strategies(stretched, solver, quick, tried)
        problem = stretched if attempt.result.converged else problem
    if attempt.result.status is SolverStatus.NEWTON_FAILED and slow:
        names, failure = strategy, attempt.result.message
        strategy, attempt = try_strategies(problem, solver, slow, tried)
        if not attempt.decides:
            strategy = f'{names}, {strategy}'
            attempt = replace(attempt, result=replace(
                attempt.result, message=f'{failure}; {attempt.result.message}'))
    if attempt.result.converged:
        solver.monitor.phase = 'duration freed'
        problem, result = free_duration(problem, attempt.result, solver)
        attempt = replace(attempt, result=result)
    return problem, strategy, attempt


def _without_verdict(strategy: Strategy) -> Strategy:
    """Return a strategy that says nothing against a task whose duration is but a guess."""
    def attempt(problem: MotionProblem, solver: Solver) -> Attempt | None:
        found = strategy.attempt(problem, solver)
        return None if found is None else replace(found, not_found=False, hopeless=False)

    return replace(strategy, attempt=attempt)


def _conclude(problem: MotionProblem, strategy: str, attempt: Attempt, solver: Solver) -> Plan:
    """Return the plan of an attempt, certified if it solved the task."""
    result = attempt.result
    failed = PlanStatus.NOT_FOUND if attempt.not_found else PlanStatus.NOT_CONVERGED
    plan = Plan(task=problem.task, status=failed, message=result.message,
                strategy=strategy, problem=problem, solution=None,
                kinds=attempt.kinds[:MOST_KINDS], starts=attempt.starts)
    if result.status in INTERRUPTED_STATUS:
        return replace(plan, status=INTERRUPTED_STATUS[result.status])
    if result.converged:
        return _certify(plan, result, solver)
    if failed is PlanStatus.NOT_FOUND:  # it says which payload or duration was found instead
        return plan
    return replace(plan, message=_explain_failure(plan, solver))


def _explain_failure(plan: Plan, solver: Solver) -> str:
    """Return what may help, how many strategies failed, and how each of them did."""
    count = len(plan.strategy.split(', '))
    failed = [f'{count} strategies found no motion'] if count > 1 else []
    return '; '.join([suggest_changes(plan.problem, solver), *failed, plan.message])


def _certify(plan: Plan, result: CollocationResult, solver: Solver) -> Plan:
    """Certify a solution; where the certificate fails, solve more exactly."""
    limits = CertificateLimits(boundary_error=plan.task.tolerance)
    problem = plan.problem
    for refinements in range(_REFINEMENTS + 1):
        # an arm that stands up magnifies the integrator's errors as it does those of the mesh
        try:
            certificate = certify(problem, result, solver.monitor,
                                  rtol=1e-8 / _STRICTER**refinements)
        except StoppedError as error:
            return replace(plan, status=STOP_STATUS[error.reason], message=str(error))
        total = integrate_totals(problem, result.solution)
        plan = replace(plan, solution=result.solution, certificate=certificate, cost=total.cost,
                       effort=total.effort, energy=total.energy,
                       switching_times=result.switches, saturation=total.saturation,
                       torque_rates=find_largest_rates(problem, result.solution))
        reasons = limits.violations(certificate)
        if not reasons:
            return judge(replace(plan, message=describe_choice(plan)))
        if refinements < _REFINEMENTS:
            solver.monitor.phase = 'mesh refinement'
            reached = min(solver.settings.error_tolerance, float(result.errors.max()))
            solver = solver.with_settings(error_tolerance=max(reached / _REFINEMENT_FACTOR, 1e-11))
            finer = solver.solve(problem, result.solution)
            if finer.status in INTERRUPTED_STATUS:
                return replace(plan, status=INTERRUPTED_STATUS[finer.status],
                               message=finer.message)
            # where the mesh is at its limit, the stricter integrator may still do
            result = finer if finer.converged else result
    return replace(plan, status=PlanStatus.CERTIFICATE_FAILED, message='; '.join(reasons))


def describe_choice(plan: Plan) -> str:
    """Return that a plan is certified, and among which kinds of motion it is the cheapest."""
    if len(plan.kinds) < 2:
        return PlanStatus.SOLVED.value
    others = ', '.join(f'{kind.value:.4g}' for kind in plan.kinds[1:])
    rigid = ', if the arm were rigid,' if plan.arm.n_passive else ''
    return (f'{PlanStatus.SOLVED.value}; the cheapest of {len(plan.kinds)} kinds of motion found '
            f'from {plan.starts} starts (J = {plan.cost:.4g}; of the others{rigid} {others})')
