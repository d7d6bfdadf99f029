"""
The effect of Ctrl-C, and of signals that end a process, on a command.

Once, they let work that looks for them stop in good order, and files that are being written become
whole; else, and twice, they interrupt. None of it leaves a traceback.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
import os
import signal
import sys
import threading
import time
from types import FrameType, TracebackType
from typing import Any

_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_ON_ITS_WAY = 1.0  # [s], in which an interruption is not interrupted again: it cleans up
_LATER = 0.05  # [s]
_IMPORTS = '<frozen importlib._bootstrap>'


class CanceledError(Exception):
    """Ctrl-C was pressed, and the work has stopped in good order."""


class CommandSignals:
    """
    Handles signals while a command runs, for a with block in the main thread.

    Attributes
    ----------
    number : int
        Of the first signal that came; 0 while there was none.

    """

    def __init__(self) -> None:
        self.number = 0
        self._patient, self._hasty = 0, False
        self._leave: Callable[[], int] | None = None
        self._interrupted = -math.inf
        self._before: dict[int, Any] = {}
        self._hook = sys.unraisablehook

    def __enter__(self) -> CommandSignals:
        if self._before:
            return self
        self.number, self._interrupted, self._leave = 0, -math.inf, None
        if threading.current_thread() is not threading.main_thread():
            return self
        for number in _ENDING:
            if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:  # nohup
                self._before[number] = signal.signal(number, self._on_signal)
        self._before[signal.SIGALRM] = signal.signal(signal.SIGALRM, self._on_alarm)
        self._hook, sys.unraisablehook = sys.unraisablehook, self._on_unraisable
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before.clear()
        sys.unraisablehook = self._hook

    @property
    def word(self) -> str:
        """Return what happened."""
        return ('canceled' if self.number in (0, signal.SIGINT)
                else f'ended by {signal.Signals(self.number).name}')

    @property
    def exit_code(self) -> int:
        """Return what a shell makes of a process that the signal ended."""
        return 128 + (self.number or signal.SIGINT)

    def came(self) -> bool:
        """Return whether a signal came."""
        return bool(self.number)

    def check(self) -> None:
        """Raise KeyboardInterrupt if a signal came."""
        if self.number:
            raise KeyboardInterrupt

    @contextmanager
    def patient(self) -> Iterator[Callable[[], bool]]:
        """Leave it to a block to look whether a signal came; a second one interrupts it."""
        with self if not self._before else _nothing():
            self._patient += 1
            try:
                yield self.came
            finally:
                self._patient -= 1

    @contextmanager
    def starting(self) -> Iterator[None]:
        """Let a signal end the process at once in a block, in which nothing is done yet."""
        self._leave = self.tell
        try:
            yield
        finally:
            self._leave = None

    def tell(self) -> int:
        """Say what happened; return the exit code."""
        print(f'flex-planner: {self.word}', file=sys.stderr, flush=True)
        return self.exit_code

    def ending(self, code: int) -> None:
        """
        Let Ctrl-C change the exit code no more; other signals end the process at once.

        Python itself would let Ctrl-C kill it while it ends.

        """
        self._leave = lambda: code
        if self._before:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        self._before.clear()

    @contextmanager
    def hasty(self) -> Iterator[None]:
        """Let a signal interrupt a block after all, also while it loads libraries."""
        patient, self._patient, self._hasty = self._patient, 0, True
        try:
            yield
        finally:
            self._patient, self._hasty = patient, False

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        first, self.number = not self.number, self.number or number
        if not (first and self._patient):
            self._interrupt(frame)

    def _on_alarm(self, number: int, frame: FrameType | None) -> None:
        self._interrupt(frame)

    def _interrupt(self, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt, a moment later where an import would mistake it."""
        if self._leave is not None:
            os._exit(self._leave())
        if time.monotonic() < self._interrupted + _ON_ITS_WAY:
            return
        if _is_importing(frame):
            if self._hasty:
                os._exit(self.tell())
            signal.setitimer(signal.ITIMER_REAL, _LATER)
            return
        self._interrupted = time.monotonic()
        raise KeyboardInterrupt

    def _on_unraisable(self, unraisable: Any) -> None:
        """Interrupt again after an interruption that Python had to drop; tell all else."""
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._interrupted = -math.inf
            signal.setitimer(signal.ITIMER_REAL, _LATER)
        else:
            self._hook(unraisable)


@contextmanager
def _nothing() -> Iterator[None]:
    yield


def _is_importing(frame: FrameType | None) -> bool:
    """Return whether code that is being interrupted runs for an import."""
    while frame is not None:
        if frame.f_code.co_filename == _IMPORTS:
            return True
        frame = frame.f_back
    return False


SIGNALS = CommandSignals()
