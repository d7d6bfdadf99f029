"""A published motion with what the arm says of it, while it is recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import struct
from typing import Any

from flex_planner.ros.settings.planner import PlannerSettings

_MOST = 200_000  # joint states of a recording, as a log for an identification may have
_LATEST_NS = 5_000_000_000  # by which an arm may be late, as a simulated one is on a busy machine


@dataclass(slots=True)
class RecordedMotion:
    """
    A motion that is being recorded.

    Attributes
    ----------
    settings : PlannerSettings
        Of the plan.
    trajectory : object
        As it was published.
    began_ns, end_ns : int
        When it was published, and when the recording ends [ns].
    states : list of (int, bytes)
        Joint states with the time of their receipt [ns].

    """

    settings: PlannerSettings
    trajectory: Any
    began_ns: int
    end_ns: int
    states: list[tuple[int, bytes]] = field(default_factory=list)

    def is_over(self, now_ns: int) -> bool:
        """Return whether nothing more is to be recorded."""
        # a clock that was set back never comes to the end
        if not self.began_ns <= now_ns < self.end_ns + _LATEST_NS or len(self.states) >= _MOST:
            return True
        return now_ns >= self.end_ns and not self._is_late()

    def _is_late(self) -> bool:
        """Return whether the last state is one of the motion by its stamp, and not of its end."""
        return bool(self.states) and self.began_ns <= _stamp_ns(self.states[-1][1]) < self.end_ns


def in_order(states: Sequence[tuple[int, bytes]], began_ns: int) -> tuple[
        list[tuple[int, bytes]], list[tuple[int, bytes]]]:
    """Return joint states in the order of their times, those before a time and the others."""
    ordered = sorted(states, key=lambda one: one[0])
    return ([one for one in ordered if one[0] < began_ns],
            [one for one in ordered if one[0] >= began_ns])


def _stamp_ns(data: bytes) -> int:
    """Return the stamp of a message in CDR that begins with a header [ns]."""
    order = '<' if data[1] & 1 else '>'
    seconds, rest = struct.unpack_from(f'{order}iI', data, 4)
    return int(seconds) * 10**9 + int(rest)
