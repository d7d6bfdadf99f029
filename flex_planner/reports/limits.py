"""What is left of the limits on the way, as lines of text."""

from __future__ import annotations

from flex_planner.planning.constraint_margins import ACTIVE, ConstraintMargin
from flex_planner.planning.plan import Plan

Row = tuple[str, str]


def limit_rows(plan: Plan) -> list[Row]:
    """Return limits that a motion reaches, and the nearest of the others; empty without any."""
    margins = sorted(plan.constraints, key=lambda one: one.slack)
    if not margins:
        return []
    reached = [one for one in margins if one.slack < ACTIVE]
    rows = [('limits on the way', _count(margins, len(reached)))]
    rows += [('  limit', f'{one}{_span(one)}') for one in reached]
    nearest = margins[len(reached):][:1]
    rows += [('  nearest of the others', f'{one}, {one.slack:.1%} of its scale')
             for one in nearest]
    if plan.barrier_gap:
        rows.append(('  barrier gap', f'{plan.barrier_gap:.1e} N^2 m^2 s'))
    return rows


def _count(margins: list[ConstraintMargin], reached: int) -> str:
    """Return how many limits there are, and how many are broken, reached, or have room."""
    broken = sum(not one.kept for one in margins)
    kinds = {'broken': broken, 'reached': reached - broken, 'with room': len(margins) - reached}
    return f'{len(margins)}: ' + ', '.join(
        f'{count} {kind}' for kind, count in kinds.items() if count)


def _span(one: ConstraintMargin) -> str:
    """Return between which times less than a hundredth of a limit is left."""
    spans = ', '.join(f'{first:.4g} to {last:.4g} s' for first, last in one.active)
    return f'; reached from {spans}' if spans else ''
