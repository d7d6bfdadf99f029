"""Recordings of plans that an arm cannot wait for: written once the request is answered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import logging
import threading

from flex_planner.base.errors import FlexPlannerError

_MOST_WAITING = 100  # plans, with their trajectories some megabytes

_LOG = logging.getLogger(__name__)

_Write = Callable[[], object]


class LateRecorder:
    """
    Writes recordings one after another in a thread of its own, which it starts with the first.

    One that cannot be written is logged, and there is no room for others until `recover` is
    called: recordings before the answer can say there that they fail.

    """

    def __init__(self) -> None:
        self._waiting: deque[_Write] = deque()
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._closed = self._failed = False

    @property
    def ready(self) -> bool:
        """Return whether there is room for another one."""
        return not (self._closed or self._failed or len(self._waiting) >= _MOST_WAITING)

    def recover(self) -> None:
        """Take note that recordings can be written."""
        self._failed = False

    def add(self, write: _Write) -> None:
        """Have a recording written after those before it; `write` may raise. Lost once closed."""
        with self._changed:
            if self._closed:
                _LOG.error('the planner ends, and a recording after the answer is not written')
                return
            self._waiting.append(write)
            self._changed.notify()
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name='recorder', daemon=True)
                self._thread.start()

    def close(self, timeout: float) -> int:
        """Write what waits, and return how many were not within a time [s]."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(timeout)
        with self._changed:
            left = len(self._waiting)
            self._waiting.clear()
        return left + (self._thread is not None and self._thread.is_alive())

    def _next(self) -> _Write | None:
        """Wait for the next one; None once there is none and no other will come."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            return self._waiting.popleft() if self._waiting else None

    def _run(self) -> None:
        while (write := self._next()) is not None:
            try:
                write()
            except Exception as error:
                self._failed = True
                _LOG.error('recording failed after the answer, which names it: %s', error,
                           exc_info=not isinstance(error, FlexPlannerError))


def once(call: Callable[[], None]) -> Callable[[], None]:
    """Return a function that calls another the first time, and does nothing later."""
    left = [call]

    def calls() -> None:
        if left:
            left.pop()()

    return calls
