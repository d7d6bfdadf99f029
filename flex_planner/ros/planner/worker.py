"""One thread that plans, behind a bounded queue, so that the node's callbacks never wait."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import logging
import threading

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

    """

    def __init__(self, queue_length: int) -> None:
        self._queue_length = queue_length
        self._jobs: deque[Job] = deque()
        self._withdrawn: deque[Job] = deque()
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

    def submit(self, job: Job) -> bool:
        """Queue a job; return False if the queue is full or the worker is stopping."""
        with self._changed:
            if self._stopping or len(self._jobs) >= self._queue_length:
                return False
            self._jobs.append(job)
            self._changed.notify()
        return True

    def withdraw(self, job: Job) -> bool:
        """
        Let a job that still waits give its place to others; return False if it does not.

        It runs before all others, to note its end.

        """
        with self._changed:
            if job not in self._jobs:
                return False
            self._jobs.remove(job)
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

    def _next(self) -> Job | None:
        """Wait for a job; None when the worker stops."""
        with self._changed:
            self._changed.wait_for(lambda: self._stopping or self._withdrawn or self._jobs)
            if self._stopping:
                return None
            return (self._withdrawn or self._jobs).popleft()

    def _run(self) -> None:
        while (job := self._next()) is not None:
            try:
                job()
            except Exception:
                _LOG.exception('a planning job failed')
            return_memory()
