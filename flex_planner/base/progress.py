"""Progress of long work, and requests to stop it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
import math
import time


class StopReason(Enum):
    """Reasons for stopping work from outside; the value is shown to people."""

    CANCELED = 'canceled'
    TIMEOUT = 'time limit reached'


class StoppedError(Exception):
    """Work was stopped from outside, at a point where it cannot return a result."""

    def __init__(self, reason: StopReason) -> None:
        self.reason = reason
        super().__init__(reason.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """
    One line of progress.

    Attributes
    ----------
    phase : str
        What is being solved.
    iteration : int
        Newton iterations so far.
    residual : float
        Size of the last Newton correction relative to the unknowns.
    intervals : int
        Intervals of the mesh.
    payload : float
        Payload tried [kg]; 0 where none is searched.

    """

    phase: str
    iteration: int
    residual: float
    intervals: int
    payload: float = 0.0


@dataclass(slots=True, kw_only=True)
class Monitor:
    """
    Watches work: receives its progress, and asks it to stop.

    Parameters
    ----------
    time_limit : float
        From creation [s].
    canceled : callable
        Returns True once the work should stop; called from the working thread.
    report : callable
        Receives a `Progress` per iteration; called from the working thread.

    """

    time_limit: float = math.inf
    canceled: Callable[[], bool] = lambda: False
    report: Callable[[Progress], None] = lambda progress: None
    phase: str = ''
    payload: float = 0.0
    iteration: int = 0
    started: float = field(default_factory=time.monotonic)

    @property
    def elapsed(self) -> float:
        """Time since creation [s]."""
        return time.monotonic() - self.started

    def stop_reason(self) -> StopReason | None:
        """Return the reason to stop now, or None to go on."""
        if self.canceled():
            return StopReason.CANCELED
        if self.elapsed > self.time_limit:
            return StopReason.TIMEOUT
        return None

    def check(self) -> None:
        """Raise StoppedError if the work should stop now."""
        reason = self.stop_reason()
        if reason is not None:
            raise StoppedError(reason)

    def step(self, residual: float, intervals: int) -> None:
        """Count and report an iteration."""
        self.iteration += 1
        self.report(Progress(phase=self.phase, iteration=self.iteration, residual=residual,
                             intervals=intervals, payload=self.payload))
