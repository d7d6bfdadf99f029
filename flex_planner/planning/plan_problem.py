"""From a problem to a certified plan: strategies in order, then the certificate."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.progress import Monitor, StoppedError, StopReason
from flex_planner.collocation import CollocationResult, solve, SolverSettings, SolverStatus
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION
from flex_planner.planning.certificate import CertificateLimits, certify, totals
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.strategies.initial_guesses import Attempt, QUICK, Strategy, THOROUGH
from flex_planner.planning.strategies.limit_strategies import (
    freed_duration,
    walked_duration,
    walked_payload,
)

Rungs = tuple[tuple[str, Strategy], ...]

# the limits come before the thorough strategies: to refuse a task should not take minutes
LADDER: Rungs = (
    *QUICK,
    ('payload walked up', walked_payload),
    ('duration walked down', walked_duration),
    *THOROUGH,
)

STOPPED = {SolverStatus.TIMEOUT: PlanStatus.TIMEOUT, SolverStatus.CANCELED: PlanStatus.CANCELED}
STATUSES = {StopReason.TIMEOUT: PlanStatus.TIMEOUT, StopReason.CANCELED: PlanStatus.CANCELED}
_REFINEMENTS = 2
_REFINEMENT_FACTOR = 10.0
_STRICTER = 100.0
# strategies tried with each guess of a free duration, and longer guesses
_FEW, _GUESSES = 4, (2.0, 4.0, 8.0)


def planned(problem: MotionProblem, rungs: Rungs, settings: SolverSettings,
            monitor: Monitor) -> Plan:
    """Return the certified plan of a problem by the first strategy that solves it."""
    try:
        plan = _planned(problem, rungs, settings, monitor)
    except StoppedError as stop:
        plan = Plan(task=problem.task, status=STATUSES[stop.reason], message=str(stop),
                    strategy='', problem=problem, solution=None)
    return replace(plan, iterations=monitor.iteration, planning_time=monitor.elapsed)


def _planned(problem: MotionProblem, rungs: Rungs,
             settings: SolverSettings, monitor: Monitor) -> Plan:
    """Solve and certify."""
    if problem.task.time_weight:
        return _planned_in_any_time(problem, rungs, settings, monitor)
    strategy, attempt = _first_solution(problem, rungs, settings, monitor)
    return _concluded(problem, strategy, attempt, settings, monitor)


def _planned_in_any_time(problem: MotionProblem, rungs: Rungs,
                         settings: SolverSettings, monitor: Monitor) -> Plan:
    """Solve for the duration of the task or a longer one, then free it."""
    limits = {walked_payload, walked_duration}  # what the guess forbids is no limit of the task
    rungs = tuple(rung for rung in rungs if rung[1] not in limits)
    strategy, attempt = _first_solution(problem, rungs[:_FEW], settings, monitor)
    for factor in _GUESSES:
        longer = factor * problem.task.duration
        if attempt.result.status is not SolverStatus.NEWTON_FAILED or longer > MAX_DURATION:
            break
        slow = MotionProblem(problem.model, replace(problem.task, duration=longer),
                             problem.parameters)
        strategy, attempt = _first_solution(slow, rungs[:_FEW], settings, monitor)
        problem = slow if attempt.result.converged else problem
    if attempt.result.status is SolverStatus.NEWTON_FAILED:
        strategy, attempt = _first_solution(problem, rungs[_FEW:], settings, monitor)
    if attempt.result.converged:
        monitor.phase = 'duration freed'
        problem, result = freed_duration(problem, attempt.result, settings, monitor)
        attempt = Attempt(result=result)
    return _concluded(problem, strategy, attempt, settings, monitor)


def _concluded(problem: MotionProblem, strategy: str, attempt: Attempt, settings: SolverSettings,
               monitor: Monitor) -> Plan:
    """Return the plan of an attempt, certified if it solved the task."""
    result = attempt.result
    plan = Plan(task=problem.task, status=PlanStatus.NOT_CONVERGED, message=result.message,
                strategy=strategy, problem=problem, solution=None)
    if attempt.evidence:
        return replace(plan, status=PlanStatus.INFEASIBLE, message=attempt.evidence)
    if result.status in STOPPED:
        return replace(plan, status=STOPPED[result.status])
    return _certified(plan, result, settings, monitor) if result.converged else plan


def _first_solution(problem: MotionProblem, rungs: Rungs,
                    settings: SolverSettings, monitor: Monitor) -> tuple[str, Attempt]:
    """Try the strategies in order; report the first that decides it, or all failures."""
    failures, names = [], []
    for name, strategy in rungs:
        monitor.phase = name
        attempt = strategy(problem, settings, monitor)
        if attempt is None:
            continue
        last = attempt
        if attempt.evidence or attempt.result.converged or attempt.result.status in STOPPED:
            return name, attempt
        names.append(name)
        failures.append(f'{name}: {attempt.result.message}')
    return ', '.join(names), Attempt(result=replace(last.result, message='; '.join(failures)))


def _certified(plan: Plan, result: CollocationResult, settings: SolverSettings,
               monitor: Monitor) -> Plan:
    """Certify a solution; where the certificate fails, solve more exactly."""
    limits = CertificateLimits(boundary_error=plan.task.tolerance)
    problem, reasons = plan.problem, ['']
    for attempt in range(_REFINEMENTS + 1):
        # an arm that stands up magnifies the integrator's errors as it does those of the mesh
        try:
            certificate = certify(problem, result, monitor, rtol=1e-8 / _STRICTER**attempt)
        except StoppedError as stop:
            return replace(plan, status=STATUSES[stop.reason], message=str(stop))
        total = totals(problem, result.solution)
        plan = replace(plan, solution=result.solution, certificate=certificate, cost=total.cost,
                       effort=total.effort, energy=total.energy,
                       switching_times=result.switches, saturation=total.saturation)
        reasons = limits.violations(certificate)
        if not reasons:
            return replace(plan, status=PlanStatus.SOLVED, message=PlanStatus.SOLVED.value)
        if attempt < _REFINEMENTS:
            monitor.phase = 'mesh refinement'
            reached = min(settings.error_tolerance, float(result.errors.max()))
            settings = replace(settings, error_tolerance=max(
                reached / _REFINEMENT_FACTOR, 1e-11))
            finer = solve(problem, result.solution, settings, monitor)
            if finer.status in STOPPED:
                return replace(plan, status=STOPPED[finer.status], message=finer.message)
            # where the mesh is at its limit, the stricter integrator may still do
            result = finer if finer.converged else result
    return replace(plan, status=PlanStatus.CERTIFICATE_FAILED, message='; '.join(reasons))
