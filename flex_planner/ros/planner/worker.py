"""One thread that plans, behind a bounded queue, so that the node's callbacks never wait."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import logging
import math
import threading
import time

from flex_planner.base.processes import return_memory

Job = Callable[[], None]

_MOST_WITHDRAWN = 1000  # whoever sends and cancels without end must not fill the memory

_LOG = logging.getLogger(__name__)


class Worker:
    """
    Runs jobs one at a time in its own thread.

    Parameters
    ----------
    queue_length : int
        Jobs that may wait.
    max_waiting_time : float
        Largest sum of the times that waiting jobs may take [s].

    """

    def __init__(self, queue_length: int, max_waiting_time: float = math.inf) -> None:
        self._queue_length, self._max_waiting_time = queue_length, max_waiting_time
        self._jobs: deque[tuple[Job, float]] = deque()
        self._withdrawn: deque[Job] = deque()
        self._ends = 0.0  # when the running job ends at the latest, by the monotonic clock
        self._running = False
        self._changed = threading.Condition()
        self._stopping = False
        # a daemon: should a job not listen, the process still ends
        self._thread = threading.Thread(target=self._run, name='planner', daemon=True)
        self._thread.start()

    @property
    def stopping(self) -> bool:
        """Whether the node is shutting down; long jobs look at it and give up."""
        return self._stopping

    @property
    def waiting(self) -> int:
        """Return the number of waiting jobs."""
        return len(self._jobs)

    def submit(self, job: Job, seconds: float = 0.0) -> str:
        """
        Queue a job; return the reason if that cannot be, empty if it is done.

        Parameters
        ----------
        job : callable
            The job.
        seconds : float
            Time that it may take.

        """
        with self._changed:
            if self._stopping:
                return 'the planner is ending'
            refusal = self._refusal(seconds)
            if not refusal:
                self._jobs.append((job, seconds))
                self._changed.notify()
        return refusal

    def withdraw(self, job: Job) -> bool:
        """
        Let a job that still waits give its place to others; return False if it does not.

        It runs before all others, to note its end.

        """
        with self._changed:
            found = [entry for entry in self._jobs if entry[0] == job]
            if not found:
                return False
            self._jobs.remove(found[0])
            if len(self._withdrawn) < _MOST_WITHDRAWN:
                self._withdrawn.append(job)
                self._changed.notify()
                return True
        _LOG.warning('more than %d requests are canceled and not recorded yet: one will not be',
                     _MOST_WITHDRAWN)
        return True

    def stop(self, timeout: float) -> bool:
        """Tell the running job to give up, drop the others, wait [s]; return whether it did."""
        with self._changed:
            self._stopping = True
            self._changed.notify()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _refusal(self, seconds: float) -> str:
        """Return why a job cannot wait, and for how long; empty if it can, or need not."""
        now, times = time.monotonic(), [entry[1] for entry in self._jobs]
        if not (times or self._running):
            return ''
        # what the thread is about to take does not wait
        ends = self._ends if self._running else now + times.pop(0)
        # when the worker takes each of those that wait, and when it has done all
        takes = [max(ends - now, 0.0) + sum(times[:k]) for k in range(len(times) + 1)]
        if len(times) >= self._queue_length:
            return (f'{len(times)} requests are waiting already; the parameter queue_length '
                    f'allows no more: {_retry(takes[len(times) - self._queue_length])}')
        if sum(times) + seconds <= self._max_waiting_time:
            return ''
        fits = [k for k in range(len(times))
                if sum(times[k + 1:]) + seconds <= self._max_waiting_time]
        return (f'the requests that wait may take {sum(times):.3g} s and this one {seconds:.3g} '
                f's, together more than max_waiting_time = {self._max_waiting_time:g} s: '
                f'{_retry(takes[fits[0] if fits else -1])}, or allow less planning time')

    def _next(self) -> Job | None:
        """Wait for a job; None when the worker stops."""
        with self._changed:
            self._running = False
            self._changed.wait_for(lambda: self._stopping or self._withdrawn or self._jobs)
            if self._stopping:
                return None
            if self._withdrawn:  # takes no time worth counting
                return self._withdrawn.popleft()
            job, seconds = self._jobs.popleft()
            self._running, self._ends = True, time.monotonic() + seconds
        return job

    def _run(self) -> None:
        while (job := self._next()) is not None:
            try:
                job()
            except Exception:
                _LOG.exception('a planning job failed')
            return_memory()


def _retry(seconds: float) -> str:
    """Return when to try again, in words."""
    return f'there is room in about {math.ceil(seconds)} s at the latest, try again then'
