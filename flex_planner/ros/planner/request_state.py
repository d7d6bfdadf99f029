"""The state of a request in the node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import math
import time

from flex_planner.base.progress import Progress
from flex_planner.ros.settings.planner import PlannerSettings

_WAITING = Progress(phase='waiting for earlier requests', iteration=0, residual=math.inf,
                    intervals=0)


def _never() -> bool:
    return False


@dataclass(slots=True, kw_only=True, eq=False)
class RequestState:
    """
    The settings of a request, its progress, and whether its client has canceled it.

    One thread reads it while another one writes.

    Attributes
    ----------
    settings : PlannerSettings
        Parameters when the request was accepted.
    stopping : callable
        Returns True once the node ends.
    accepted_ns, stamp_ns : int
        When it was accepted, by the monotonic clock and since 1970 [ns].
    progress : Progress
        The latest.
    withdrawn : bool
        Whether it is given up.
    ended_ns : int or None
        When that was, by the monotonic clock [ns].
    reason : str
        Why, where its client has not canceled it.
    began_ns : int
        When the worker began with it, by the monotonic clock [ns]; 0 while it waits.
    motion : str
        How the arm moved when it was accepted, empty if it did not or is not watched.
    plan_id : str
        Of its plan, empty while there is none.

    """

    settings: PlannerSettings
    stopping: Callable[[], bool] = _never
    accepted_ns: int = field(default_factory=time.monotonic_ns)
    stamp_ns: int = field(default_factory=time.time_ns)
    progress: Progress = _WAITING
    withdrawn: bool = False
    ended_ns: int | None = None
    reason: str = ''
    began_ns: int = 0
    motion: str = ''
    plan_id: str = ''

    @property
    def elapsed_ns(self) -> int:
        """Time since it was accepted, until it was canceled if it was [ns]."""
        now = time.monotonic_ns() if self.ended_ns is None else self.ended_ns
        return now - self.accepted_ns

    def withdraw(self, reason: str = '') -> None:
        """Let it be given up from now on, for a reason if its client has not canceled it."""
        self.reason, self.ended_ns, self.withdrawn = reason, time.monotonic_ns(), True

    @property
    def waited_ns(self) -> int:
        """Time that it waited for others [ns]."""
        return min((self.began_ns or time.monotonic_ns()) - self.accepted_ns, self.elapsed_ns)

    def is_canceled(self) -> bool:
        """Return whether to stop working on it."""
        return self.withdrawn or self.stopping()

    def report(self, progress: Progress) -> None:
        """Store the progress."""
        self.progress = progress
