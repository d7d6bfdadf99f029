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


def followed(task: Task, **options: Any) -> MaxPayload:
    """Search along one kind of motion, where that is what matters, or the task has no others."""
    return find_max_payload(task, search='fast', **options)


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


def assert_stopped(found: MaxPayload, status: PlanStatus, *, certified: bool = False) -> None:
    """Check the outcome of a search that was stopped, with or without something certified."""
    assert (found.status, found.solved) == (status, False)
    if not certified:
        assert (found.message, found.payload, found.limiting_joint) == (status.value, 0.0, None)
        assert found.plan is None or not found.plan.solved
        return
    assert found.message == f'{status.value} ({found.payload:.6g} kg are certified)'
    assert found.plan is not None
    assert (found.plan.solved, found.plan.task.payload_mass) == (True, found.payload)
    assert found.limiting_joint is not None


def moments(search: Search) -> dict[tuple[str, bool], int]:
    """Return the calls of the monitor at which a phase begins, and amid its last re-simulation."""
    seen, phases = list[tuple[str, int]](), set[str]()

    def asked() -> bool:
        seen.append((monitor.phase, monitor.iteration))
        return False

    monitor = Monitor(canceled=asked, report=lambda progress: phases.add(progress.phase))
    search(monitor)
    if any(phase.startswith('compiling') for phase in phases):
        return moments(search)  # a compiler asks as often as it takes it
    found, before = dict[tuple[str, bool], int](), 0
    for (phase, _), calls in groupby(seen):
        number = len(list(calls))
        found.setdefault((phase, False), before)
        if number >= 20:  # once an interval of the mesh; an iteration asks less often
            found[phase, True] = before + number // 2
        before += number
    return found


def assert_stopped_at(search: Search, expected: dict[tuple[str, bool], bool]) -> None:
    """Stop a search at moments, each with whether a motion can be certified when time is up."""
    calls = moments(search)
    assert calls.keys() >= expected.keys()
    for moment, certified in expected.items():
        canceled = search(stopped_after(calls[moment], PlanStatus.CANCELED))
        assert_stopped(canceled, PlanStatus.CANCELED)
        late = search(stopped_after(calls[moment], PlanStatus.TIMEOUT))
        assert_stopped(late, PlanStatus.TIMEOUT, certified=certified)
