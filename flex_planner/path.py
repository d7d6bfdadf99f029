"""
Optimal paths for a given payload: Korayem et al. 2009, section 4.1.

`plan_path` is the library's main entry: a task goes in, a certified plan comes out.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.certify import CertificateLimits, certify, totals
from flex_planner.collocation import CollocationResult, Settings, solve, Status
from flex_planner.model import ArmModel
from flex_planner.motion import MotionProblem, task_parameters
from flex_planner.plan import Plan, PlanStatus
from flex_planner.progress import Monitor, StoppedError, StopReason
from flex_planner.strategies import LADDER
from flex_planner.task import Task

_STOPPED = {Status.TIMEOUT: PlanStatus.TIMEOUT, Status.CANCELED: PlanStatus.CANCELED}
_STATUSES = {StopReason.TIMEOUT: PlanStatus.TIMEOUT, StopReason.CANCELED: PlanStatus.CANCELED}
_REFINEMENTS = 2
_REFINEMENT_FACTOR = 10.0
_STRICTER = 100.0


def plan_path(task: Task, *, model: ArmModel | None = None, settings: Settings | None = None,
              monitor: Monitor | None = None) -> Plan:
    """
    Plan the motion of a task that minimises eq. (6) within the motor limits of eq. (15).

    Parameters
    ----------
    task : Task
        The motion.
    model : ArmModel, optional
        Of the task's arm; compiled or read from disk if not given.
    settings : Settings, optional
        Of the boundary-value solver.
    monitor : Monitor, optional
        Receives progress, and may cancel or limit the time.

    Returns
    -------
    Plan
        Check `Plan.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If a motor is too weak to hold the arm at the goal.

    """
    settings, monitor = settings or Settings(), monitor or Monitor()
    model = model or ArmModel(task.arm)
    problem = MotionProblem(model, task, task_parameters(task))
    strategy, result = _first_solution(problem, settings, monitor)
    plan = Plan(task=task, status=PlanStatus.NOT_CONVERGED, message=result.message,
                strategy=strategy, problem=problem, solution=None)
    if result.status in _STOPPED:
        plan = replace(plan, status=_STOPPED[result.status])
    elif result.converged:
        try:
            plan = _certified(plan, result, settings, monitor)
        except StoppedError as stop:
            plan = replace(plan, status=_STATUSES[stop.reason], message=str(stop))
    return replace(plan, iterations=monitor.iteration, planning_time=monitor.elapsed)


def _first_solution(problem: MotionProblem, settings: Settings,
                    monitor: Monitor) -> tuple[str, CollocationResult]:
    """Try the strategies in order; report the first that solves it, or all failures."""
    failures = []
    for name, strategy in LADDER:
        monitor.phase = name
        result = strategy(problem, settings, monitor)
        if result.converged or result.status in _STOPPED:
            return name, result
        failures.append(f'{name}: {result.message}')
    return ', '.join(name for name, _ in LADDER), replace(result, message='; '.join(failures))


def _certified(plan: Plan, result: CollocationResult, settings: Settings,
               monitor: Monitor) -> Plan:
    """Certify a solution; where the certificate fails, solve on finer meshes."""
    limits = CertificateLimits(boundary_error=plan.task.tolerance)
    problem, reasons = plan.problem, ['']
    for attempt in range(_REFINEMENTS + 1):
        # an arm that stands up magnifies the integrator's errors as it does those of the mesh
        certificate = certify(problem, result, monitor, rtol=1e-8 / _STRICTER**attempt)
        total = totals(problem, result.solution)
        plan = replace(plan, solution=result.solution, certificate=certificate, cost=total.cost,
                       effort=total.effort, energy=total.energy)
        reasons = limits.violations(certificate)
        if not reasons:
            return replace(plan, status=PlanStatus.SOLVED, message=PlanStatus.SOLVED.value)
        if attempt < _REFINEMENTS:
            monitor.phase = 'mesh refinement'
            reached = min(settings.defect_tolerance, result.residual)
            settings = replace(settings, defect_tolerance=max(
                reached / _REFINEMENT_FACTOR, 1e-12))
            finer = solve(problem, result.solution, settings, monitor)
            if finer.status in _STOPPED:
                return replace(plan, status=_STOPPED[finer.status], message=finer.message)
            # where the mesh is at its limit, the stricter integrator may still do
            result = finer if finer.converged else result
    return replace(plan, status=PlanStatus.CERTIFICATE_FAILED, message='; '.join(reasons))
