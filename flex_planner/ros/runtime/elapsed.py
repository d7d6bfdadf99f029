"""The time that passes by a clock which may stand still, start late, or jump."""

from __future__ import annotations

# of a clock between two looks at it: with more, it has jumped [ns]
_LONGEST_STEP_NS = 10 * 10**9


class ElapsedTime:
    """
    Time that never runs backwards, by a clock of ROS.

    A simulation that begins anew, or a recording that is played in a loop, sets ``/clock`` back;
    before its first message the clock is at 0. Such jumps are no time that passes.

    Attributes
    ----------
    nanoseconds : int
        Passed so far [ns].

    """

    def __init__(self) -> None:
        self.nanoseconds = 0
        self._last_ns = 0

    @property
    def seconds(self) -> float:
        """Return what has passed so far [s]."""
        return self.nanoseconds * 1e-9

    def look(self, now_ns: int) -> float:
        """Look at the clock [ns]; return by how much it has jumped, 0 if it has not [s]."""
        step, known = now_ns - self._last_ns, self._last_ns > 0
        self._last_ns = now_ns
        if 0 <= step <= _LONGEST_STEP_NS and known:
            self.nanoseconds += step
            return 0.0
        return step * 1e-9 if known else 0.0
