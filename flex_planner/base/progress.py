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

    @property
    def exhausted(self) -> bool:
        """Return whether the work has used up its share; never, unless it has one."""
        return False

    def iterations_left(self, intervals: int) -> float:
        """Return how many iterations on a mesh there may be: any number of them."""
        return math.inf

    def check(self) -> None:
        """Raise StoppedError if the work should stop now."""
        reason = self.stop_reason()
        if reason is not None:
            raise StoppedError(reason)

    def announce(self, phase: str) -> None:
        """Report that something begins which has no iterations; the phase goes on after it."""
        self.report(Progress(phase=phase, iteration=self.iteration, residual=math.inf,
                             intervals=0, payload=self.payload))

    def step(self, residual: float, intervals: int) -> None:
        """Count and report an iteration."""
        self.iteration += 1
        self.report(Progress(phase=self.phase, iteration=self.iteration, residual=residual,
                             intervals=intervals, payload=self.payload))


@dataclass(slots=True, kw_only=True)
class LimitedMonitor(Monitor):
    """
    Watches a part of some work that has only a share of it.

    What is reported and asked goes to the monitor of the whole. Work is counted in iterations
    times intervals, not in seconds: so the same is done on every machine.

    Parameters
    ----------
    whole : Monitor
        Of the whole work.
    share : float
        Iterations times intervals, > 0.

    """

    whole: Monitor
    share: float

    @classmethod
    def of(cls, whole: Monitor, share: float) -> LimitedMonitor:
        """Return a monitor of a part that begins now."""
        return cls(whole=whole, share=share, time_limit=whole.time_limit, canceled=whole.canceled,
                   report=whole.report, phase=whole.phase, payload=whole.payload,
                   iteration=whole.iteration, started=whole.started)

    @property
    def exhausted(self) -> bool:
        """Return whether its share, or that of the whole, is used up."""
        return self.share <= 0 or self.whole.exhausted

    def iterations_left(self, intervals: int) -> float:
        """Return how many iterations on a mesh it has still, as a whole number or infinity."""
        own = math.inf if math.isinf(self.share) else max(0, math.ceil(self.share / intervals))
        return min(own, self.whole.iterations_left(intervals))

    def stop_reason(self) -> StopReason | None:
        """Return the reason to stop the whole work now, or None."""
        return self.whole.stop_reason()

    def step(self, residual: float, intervals: int) -> None:
        """Count and report an iteration."""
        self.share -= intervals
        self.whole.phase, self.whole.payload = self.phase, self.payload
        self.whole.step(residual, intervals)
        self.iteration = self.whole.iteration
