"""Time by a clock that may start late, stand still or jump."""

from __future__ import annotations

from flex_planner.ros.runtime.elapsed import ElapsedTime
import pytest

SECOND = 10**9


@pytest.mark.parametrize(('looks', 'passed', 'jumps'), [
    ([5, 6, 6, 8.5], 3.5, []), ([0, 0, 1e9, 1e9 + 1], 1.0, []), ([100, 103, 2, 4], 5.0, [-101]),
    ([1, 2, 1000, 1001], 2.0, [998]), ([7, 0, 9, 10], 1.0, [-7]), ([3, 13], 10.0, [])])
def test_jumps_are_no_time_that_passes(looks: list[float], passed: float,
                                       jumps: list[float]) -> None:
    elapsed = ElapsedTime()
    found = [elapsed.look(round(seconds * SECOND)) for seconds in looks]
    assert elapsed.seconds == pytest.approx(passed)
    assert [jump for jump in found if jump] == pytest.approx(jumps)
