"""Whether somebody still waits for an answer."""

from __future__ import annotations

from flex_planner.ros.planner import clients
from flex_planner.ros.planner.clients import Audience
import pytest

ONE, OTHER = frozenset([b'one']), frozenset([b'other'])
NOBODY: frozenset[bytes] = frozenset()


@pytest.fixture
def passes(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return the time, which a test moves on."""
    now = [100.0]
    monkeypatch.setattr(clients.time, 'monotonic', lambda: now[0])
    return now


def test_request_is_abandoned_once_all_that_were_there_are_gone(passes: list[float]) -> None:
    audience = Audience(ONE)
    assert not audience.is_gone(ONE | OTHER)  # the other is discovered late
    passes[0] += 10
    assert [audience.is_gone(present) for present in (ONE, OTHER)] == [False, False]
    assert [audience.is_gone(NOBODY) for _ in range(2)] == [False, True]


def test_who_comes_later_does_not_wait_for_it(passes: list[float]) -> None:
    audience = Audience(ONE)
    passes[0] += 10
    assert [audience.is_gone(OTHER) for _ in range(2)] == [False, True]


def test_moment_without_anybody_is_not_the_end(passes: list[float]) -> None:
    audience = Audience(ONE)
    passes[0] += 10
    assert [audience.is_gone(seen) for seen in (NOBODY, ONE, NOBODY, ONE)] == [False] * 4


def test_nothing_is_said_of_whom_discovery_does_not_show(passes: list[float]) -> None:
    audience = Audience(NOBODY)
    passes[0] += 10
    assert [audience.is_gone(NOBODY) for _ in range(3)] == [False] * 3
