"""Long work on the command line: its progress on standard error, and Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
import signal
import sys
from threading import Event
import time
from types import FrameType
from typing import TextIO, TypeVar

from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor, Progress
from flex_planner.optimal_control.arm_model import ArmModel

Result = TypeVar('Result')

_OFTEN = 0.1  # [s], between two states of the line
_WIDTH = 80  # where a terminal does not know its own
_REWRITE = '\r\x1b[K'


class CanceledError(Exception):
    """Ctrl-C was pressed, and the work has stopped in good order."""


class Display:
    """
    Shows progress: on a terminal as a line that is rewritten, elsewhere as a line per phase.

    Parameters
    ----------
    stream : text file
        Where to.

    """

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._terminal = stream, stream.isatty()
        self._started, self._shown = time.monotonic(), -_OFTEN
        self.phase = ''

    @property
    def elapsed(self) -> float:
        """Return the time since creation [s]."""
        return time.monotonic() - self._started

    def begin(self, phase: str) -> None:
        """Show that a phase begins."""
        self.phase = phase
        if self._terminal:
            self._rewrite(phase)
        else:
            print(f'{self.elapsed:7.1f} s  {phase}', file=self._stream, flush=True)

    def report(self, progress: Progress) -> None:
        """Show where the work is."""
        if progress.phase != self.phase:
            self.begin(progress.phase)
        elif self._terminal and self.elapsed > self._shown + _OFTEN:
            payload = f', payload {progress.payload:.6g} kg' if progress.payload else ''
            self._rewrite(f'{progress.phase}{payload}: iteration {progress.iteration}, correction '
                          f'{progress.residual:.1e}, {progress.intervals} intervals')

    def close(self) -> None:
        """Remove the line from a terminal."""
        if self._terminal:
            print(_REWRITE, end='', file=self._stream, flush=True)

    def _rewrite(self, text: str) -> None:
        self._shown = self.elapsed
        width = os.get_terminal_size(self._stream.fileno()).columns or _WIDTH
        line = f'{self._shown:6.1f} s  {text}'[:width - 1]
        print(f'{_REWRITE}{line}', end='', file=self._stream, flush=True)


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Provide a function that says whether Ctrl-C was pressed; a second time it interrupts."""
    pressed = Event()

    def on_interrupt(number: int, frame: FrameType | None) -> None:
        if pressed.is_set():
            raise KeyboardInterrupt
        pressed.set()

    before = signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)


def run_with_progress(arm: Arm, time_limit: float,
                      work: Callable[[ArmModel, Monitor], Result]) -> Result:
    """
    Return the result of work on an arm, showing its progress.

    Parameters
    ----------
    arm : Arm
        Compiled first.
    time_limit : float
        Of the work [s].
    work : callable
        Obeys the monitor that it is given.

    Raises
    ------
    CanceledError
        If Ctrl-C was pressed.

    """
    display = Display(sys.stderr)
    try:
        display.begin(f'preparing the dynamics of {arm.name}')
        model = ArmModel(arm)
        with interruptible() as canceled:
            result = work(model, Monitor(time_limit=time_limit, canceled=canceled,
                                         report=display.report))
    finally:
        display.close()
    if canceled():
        raise CanceledError(f'canceled after {display.elapsed:.1f} s, in the phase '
                            f'{display.phase!r}; nothing was written')
    return result
