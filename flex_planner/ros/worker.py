"""One thread that plans, behind a bounded queue, so that the node's callbacks never wait."""

from __future__ import annotations

from collections.abc import Callable
import logging
import queue
import threading

Job = Callable[[], None]

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
        self._jobs: queue.Queue[Job | None] = queue.Queue(queue_length)
        self._stopping = threading.Event()
        # a daemon: should a job not listen, the process still ends
        self._thread = threading.Thread(target=self._run, name='planner', daemon=True)
        self._thread.start()

    @property
    def stopping(self) -> bool:
        """Whether the node is shutting down; long jobs look at it and give up."""
        return self._stopping.is_set()

    def submit(self, job: Job) -> bool:
        """Queue a job; return False if the queue is full or the worker is stopping."""
        if self.stopping:
            return False
        try:
            self._jobs.put_nowait(job)
        except queue.Full:
            return False
        return True

    def stop(self, timeout: float) -> None:
        """Tell the running job to give up, drop the others, and wait for the thread [s]."""
        self._stopping.set()
        try:
            self._jobs.put_nowait(None)
        except queue.Full:
            pass  # the thread is busy and looks at `stopping` before the next job
        self._thread.join(timeout)

    def _run(self) -> None:
        while not self.stopping:
            job = self._jobs.get()
            if job is None:
                return
            try:
                job()
            except Exception:
                _LOG.exception('a planning job failed')
