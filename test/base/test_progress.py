"""Watching a part of some work that has only a share of it."""

from __future__ import annotations

from flex_planner.base.progress import LimitedMonitor, Monitor, Progress, StopReason
import pytest


def test_part_of_the_work_is_reported_and_counted_with_the_whole() -> None:
    heard: list[Progress] = []
    whole = Monitor(report=heard.append)
    whole.step(1.0, 10)
    part = LimitedMonitor.of(whole, 25.0)
    part.phase, part.payload = 'part', 2.0
    part.step(0.5, 20)
    assert heard[-1] == Progress(phase='part', iteration=2, residual=0.5, intervals=20,
                                 payload=2.0)
    assert part.iteration == whole.iteration == 2
    assert whole.phase == 'part'


def test_share_is_used_up_by_iterations_times_intervals() -> None:
    whole = Monitor()
    part = LimitedMonitor.of(whole, 25.0)
    part.step(0.5, 20)
    assert not part.exhausted
    part.step(0.5, 20)
    assert part.exhausted
    assert not whole.exhausted
    assert part.stop_reason() is None  # the whole goes on


@pytest.mark.parametrize(('options', 'reason'), [
    ({'canceled': lambda: True}, StopReason.CANCELED), ({'time_limit': 0.0}, StopReason.TIMEOUT)])
def test_part_stops_with_the_whole(options: dict[str, object], reason: StopReason) -> None:
    part = LimitedMonitor.of(Monitor(**options), 1e9)  # type: ignore[arg-type]
    assert part.stop_reason() is reason


def test_parts_of_parts_use_up_the_shares_of_both() -> None:
    outer = LimitedMonitor.of(Monitor(), 30.0)
    inner = LimitedMonitor.of(outer, 10.0)
    inner.step(0.5, 20)
    assert inner.exhausted
    inner.step(0.5, 20)
    assert outer.exhausted


def test_part_is_exhausted_with_the_whole() -> None:
    outer = LimitedMonitor.of(Monitor(), 10.0)
    inner = LimitedMonitor.of(outer, 1e9)
    assert not inner.exhausted
    outer.step(0.5, 20)
    assert inner.exhausted
    assert inner.iterations_left(1) == 0
