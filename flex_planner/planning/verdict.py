"""The verdict on a motion that solves its task: whether the arm may do it, and what to know."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.bending import find_bending, LARGEST
from flex_planner.planning.constraint_margins import ConstraintMargin, find_margins
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.warnings import find_warnings
from flex_planner.planning.way_limits import find_limit_violations
import numpy as np

# of the scale of a limit, by which the re-simulated motion may pass it
_DRIFT = 1e-4


def judge(plan: Plan) -> Plan:
    """
    Return a certified plan with its status, message and warnings.

    Parameters
    ----------
    plan : Plan
        With a solution that passed its certificate; both are kept whatever the verdict is.

    """
    assert plan.solution is not None
    margins = find_margins(plan.problem, plan.solution)
    refused = find_refusal(plan.problem, plan.solution, margins) or _find_drift(plan)
    status, message = refused or (PlanStatus.SOLVED, plan.message)
    return replace(plan, status=status, message=message, constraints=margins,
                   warnings=find_warnings(plan.problem, plan.solution))


def find_refusal(problem: MotionProblem, solution: CollocationSolution,
                 margins: tuple[ConstraintMargin, ...] | None = None,
                 ) -> tuple[PlanStatus, str] | None:
    """
    Return why the arm may not do a motion that solves its task; None if it may.

    Parameters
    ----------
    problem : MotionProblem
        The task says whether links may bend far.
    solution : CollocationSolution
        The motion.
    margins : tuple of ConstraintMargin, optional
        Its margins where they are known, see `find_margins`.

    Returns
    -------
    tuple of PlanStatus and str, or None
        ``LIMIT_VIOLATED`` or ``BENT_TOO_FAR``, and a sentence with link or joint, time and by how
        much.

    """
    violations = find_limit_violations(problem, solution)
    if violations:
        others = len(violations) - 1
        more = f' ({others} more limit{"s are" if others > 1 else " is"} passed)' if others else ''
        return PlanStatus.LIMIT_VIOLATED, (
            f'{violations[0]}{more}; another duration, another posture at start or goal, or '
            'weights on positions or speeds may lead past')
    found = find_margins(problem, solution) if margins is None else margins
    broken = [one for one in found if not one.kept]
    if broken:
        return PlanStatus.LIMIT_VIOLATED, str(min(broken, key=lambda one: one.slack))
    return None if problem.task.allow_large_bending else _find_bent_link(problem, solution)


def _find_drift(plan: Plan) -> tuple[PlanStatus, str] | None:
    """Refuse a motion that is planned within its limits, but re-simulated beyond one."""
    slack = plan.certificate.limit_slack
    if slack >= -_DRIFT or np.isneginf(slack):  # which is not known: no certificate to go by
        return None
    return PlanStatus.CERTIFICATE_FAILED, (
        f'the re-simulated motion passes a limit on the way by {-slack:.2g} of its scale, but may '
        f'by {_DRIFT:g} at most')


def _find_bent_link(problem: MotionProblem,
                    solution: CollocationSolution) -> tuple[PlanStatus, str] | None:
    """Refuse a motion whose links bend further than their model holds."""
    if not problem.model.arm.n_passive:
        return None
    found, time = find_bending(problem, solution)
    if found.share <= LARGEST:
        return None
    return PlanStatus.BENT_TOO_FAR, (
        f'link {found.link + 1} bends by {found.share:.0%} of its length at '
        f'{time:.4g} s, and the beam model holds up to {LARGEST:.0%} at most: a longer '
        'duration bends it less, and allow_large_bending in the task accepts it')
