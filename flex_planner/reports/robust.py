"""What a plan forgives, as lines of text."""

from __future__ import annotations

from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.objective import RobustSearch
from flex_planner.reports.execution import millimetres
from flex_planner.reports.motion import Row


def robust_rows(plan: Plan) -> list[Row]:
    """Return how much a plan vibrates on arms that differ; empty if that was not asked."""
    search = plan.objectives.robust if plan.objectives else None
    if search is None:
        return []
    asked, worst = search.robustness, search.errors[search.residuals.argmax()]
    growth = plan.cost / search.plain_cost - 1 if search.plain_cost else 0.0
    return [
        ('forgives', f'{asked.stiffness_error:.3g} of stiffness, {asked.payload_error:.3g} of '
         f'payload{"" if search.met else ": not enough"}'),
        ('  residual bending', f'{millimetres(search.residual)}, the largest of '
         f'{len(search.errors)} arms, with {worst[0]:+.1%} of stiffness and {worst[1]:+.1%} of '
         f'payload; may be {millimetres(asked.max_residual)}'),
        ('  without', _without(search)),
        ('  costs', f'{growth:.2%} of J')]


def _without(search: RobustSearch) -> str:
    """Return what the motion of least cost leaves."""
    left = f'{millimetres(search.plain_residual)} with the motion of least cost'
    return left if search.weight else f'{left}, which is this one'
