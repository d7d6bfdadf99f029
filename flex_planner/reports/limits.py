"""What is left of the limits on the way, as lines of text."""

from __future__ import annotations

from flex_planner.planning.constraint_margins import ACTIVE, ConstraintMargin
from flex_planner.planning.plan import Plan

Row = tuple[str, str]


def limit_rows(plan: Plan) -> list[Row]:
    """Return the limits that a motion meets, and the nearest of the others; empty without any."""
    margins = sorted(plan.constraints, key=lambda one: one.slack)
    if not margins:
        return []
    met = [one for one in margins if one.slack < ACTIVE]
    rows = [('limits on the way', f'{len(margins)}, {len(met)} of them met')]
    rows += [('  limit', f'{one}{_span(one)}') for one in met]
    nearest = margins[len(met):][:1]
    rows += [('  nearest of the others', f'{one}, {one.slack:.1%} of its scale')
             for one in nearest]
    if plan.barrier_gap:
        rows.append(('  barrier gap', f'{plan.barrier_gap:.1e} N^2 m^2 s'))
    return rows


def _span(one: ConstraintMargin) -> str:
    """Return between which times a limit is met."""
    spans = ', '.join(f'{first:.4g} to {last:.4g} s' for first, last in one.active)
    return f'; met from {spans}' if spans else ''
