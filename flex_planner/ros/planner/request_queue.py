"""The queue of requests, whose outcomes are awaited without blocking callbacks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import math
import threading
import time

from flex_planner.ros.planner.execution import Execution
from flex_planner.ros.planner.outcome import (
    busy_outcome,
    canceled_outcome,
    Outcome,
    unknown_failure,
)
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.planner.worker import Job, Worker
from flex_planner.ros.settings.planner import PlannerSettings
from rclpy.executors import Executor
from rclpy.task import Future

Work = Callable[[RequestState], Outcome]


class PendingRequest:
    """
    A request in the queue or at work.

    Parameters
    ----------
    state : RequestState
        Of the request.
    executor : Executor
        Runs what awaits `future`.

    Attributes
    ----------
    future : Future
        Of the outcome of planning.
    execution : Execution or None
        Of the plan, by a controller.
    is_open : bool
        Whether there is no answer yet.

    """

    def __init__(self, state: RequestState, executor: Executor) -> None:
        self.state, self.future = state, Future(executor=executor)
        self.job: Job | None = None
        self.execution: Execution | None = None
        self.is_open = True
        self._executor, self._lock = executor, threading.Lock()

    def conclude(self, outcome: Outcome) -> None:
        """Set the outcome, unless there is one already; from any thread."""
        with self._lock:
            if self.future.done():
                if outcome.record is not None:  # as nobody else will
                    outcome.record()
                return
            self.future.set_result(outcome)
        # a future that another thread completes does not wake the executor by itself
        self._executor.wake()


class RequestQueue:
    """
    Takes requests, one at work and a bounded number waiting.

    Parameters
    ----------
    queue_length : int
        Requests that may wait.
    max_waiting_time : float
        Largest sum of the times that they may take [s].

    """

    def __init__(self, queue_length: int, max_waiting_time: float = math.inf) -> None:
        self._worker = Worker(queue_length, max_waiting_time)
        self._active: PendingRequest | None = None

    @property
    def waiting(self) -> int:
        """Return the number of waiting requests."""
        return self._worker.waiting

    @property
    def active(self) -> RequestState | None:
        """Return the state of the request at work, None if there is none."""
        active = self._active
        return active.state if active else None

    def submit(self, work: Work, settings: PlannerSettings, executor: Executor,
               seconds: float = 0.0, motion: str = '') -> PendingRequest:
        """
        Add a request.

        Parameters
        ----------
        work : callable
            Returns the outcome; runs in the thread of the worker.
        settings : PlannerSettings
            To serve it with.
        executor : Executor
            Runs what awaits the outcome.
        seconds : float
            Time that it may take.
        motion : str
            How the arm moves, empty if it does not.

        """
        state = RequestState(settings=settings, stopping=lambda: self._worker.stopping,
                             motion=motion)
        pending = PendingRequest(state, executor)
        pending.job = partial(self._serve, work, pending)
        refusal = self._worker.submit(pending.job, seconds)
        if refusal:
            pending.conclude(busy_outcome(refusal))
        return pending

    def withdraw(self, pending: PendingRequest, reason: str = '') -> None:
        """
        Cancel a request, for a reason if not its client's, and conclude it at once.

        A solver that works on it stops at its next iteration. One that waits gives its place to
        others; its work is still called, which sees that it is canceled, and records that.

        """
        pending.state.withdraw(reason)
        if pending.job is not None:
            self._worker.withdraw(pending.job)
        pending.conclude(canceled_outcome(pending.state))

    def close(self, timeout: float) -> bool:
        """Take no more, stop the one at work, and return whether it ended in time [s]."""
        return self._worker.stop(timeout)

    def _serve(self, work: Work, pending: PendingRequest) -> None:
        self._active = pending
        pending.state.began_ns = time.monotonic_ns()
        try:
            outcome = work(pending.state)
        except Exception as error:
            outcome = unknown_failure(error)
        finally:
            self._active = None
        pending.conclude(outcome)
