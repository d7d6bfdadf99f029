"""Limits on the way as lines of text."""

from __future__ import annotations

from typing import Any, cast

from flex_planner.planning.constraint_margins import ConstraintMargin
from flex_planner.planning.plan import Plan
from flex_planner.reports.limits import limit_rows


class Limited:
    """What the rows of a plan come from."""

    def __init__(self, *margins: ConstraintMargin, barrier_gap: float = 0.0) -> None:
        self.constraints, self.barrier_gap = margins, barrier_gap


def margin(name: str, slack: float, **fields: Any) -> ConstraintMargin:
    return ConstraintMargin(**{'name': name, 'constraint': 0, 'unit': 'm', 'margin': slack / 10,
                               'slack': slack, 'time': 0.5, 'active': (), **fields})


def rows(*margins: ConstraintMargin, **fields: float) -> list[tuple[str, str]]:
    return limit_rows(cast(Plan, Limited(*margins, **fields)))


def test_limits_that_are_reached_come_first_and_the_others_in_one_line() -> None:
    assert not rows()
    assert rows(margin('far', 0.9), margin('near', 0.4),
                margin('met', 0.001, active=((0.25, 0.5), (0.7, 0.8))),
                margin('broken', -0.5), barrier_gap=2e-4) == [
        ('limits on the way', '4: 1 broken, 1 reached, 2 with room'),
        ('  limit', 'broken: 0.05 m beyond the limit at 0.5 s'),
        ('  limit', 'met: 0.0001 m left at 0.5 s; reached from 0.25 to 0.5 s, 0.7 to 0.8 s'),
        ('  nearest of the others', 'near: 0.04 m left at 0.5 s, 40.0% of its scale'),
        ('  barrier gap', '2.0e-04 N^2 m^2 s')]


def test_a_limit_that_is_far_away_is_kept_and_not_missed() -> None:
    assert rows(margin('far', 0.9))[0] == ('limits on the way', '1: 1 with room')
