"""Searches for the largest payload: by the paper, and stopped at any moment."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count, groupby
from typing import Any

from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus

Search = Callable[[Monitor], MaxPayload]


def raised(task: Task, **options: Any) -> MaxPayload:
    return find_max_payload(task, method=PayloadMethod.INCREMENTAL, **options)


def stopped_after(calls: int, status: PlanStatus) -> Monitor:
    """Return a monitor that lets work go on so many times, then cancels it or runs out of time."""
    monitor, seen = Monitor(), count()

    def due() -> bool:
        late = next(seen) >= calls
        if late and status is PlanStatus.TIMEOUT:
            monitor.time_limit = -1.0
        return late and status is PlanStatus.CANCELED

    monitor.canceled = due
    return monitor


def assert_stopped(found: MaxPayload, status: PlanStatus) -> None:
    assert (found.status, found.message) == (status, status.value)
    assert (found.solved, found.payload, found.limiting_joint) == (False, 0.0, None)
    assert found.plan is None or not found.plan.solved


def moments(search: Search) -> dict[tuple[str, bool], int]:
    """Return the calls of the monitor at which a phase begins, and amid its last re-simulation."""
    monitor, seen = Monitor(), list[tuple[str, int]]()

    def asked() -> bool:
        seen.append((monitor.phase, monitor.iteration))
        return False

    monitor.canceled = asked
    search(monitor)
    found, before = dict[tuple[str, bool], int](), 0
    for (phase, _), calls in groupby(seen):
        number = len(list(calls))
        found.setdefault((phase, False), before)
        if number >= 20:  # once an interval of the mesh; an iteration asks less often
            found[phase, True] = before + number // 2
        before += number
    return found


def assert_stopped_at(search: Search, expected: set[tuple[str, bool]]) -> None:
    calls = moments(search)
    assert calls.keys() >= expected
    for moment in expected:
        for status in (PlanStatus.CANCELED, PlanStatus.TIMEOUT):
            assert_stopped(search(stopped_after(calls[moment], status)), status)
