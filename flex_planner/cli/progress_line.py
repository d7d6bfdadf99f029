"""Long work on the command line, and its progress on standard error."""

from __future__ import annotations

from collections.abc import Callable
import os
import sys
import time
from typing import TextIO, TypeVar

from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor, Progress
from flex_planner.base.streams import LastingStream
from flex_planner.base.text import printable
from flex_planner.cli.signals import CanceledError, SIGNALS
from flex_planner.optimal_control.arm_model import ArmModel

Result = TypeVar('Result')

_OFTEN = 0.1  # [s], between two states of the line
_SELDOM = 5.0  # [s], between two lines where there is no terminal
_WIDTH = 80  # where a terminal does not know its own
_REWRITE = '\r\x1b[K'


class Display:
    """
    Shows progress.

    On a terminal it is a line that is rewritten, elsewhere a line per phase and every few seconds.

    Parameters
    ----------
    stream : text file or None
        Where to; None for nowhere.

    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream if isinstance(stream, LastingStream) else LastingStream(stream)
        self._terminal = self._stream.isatty()
        self._started, self._shown = time.monotonic(), -_OFTEN
        self.phase = self._state = ''

    @property
    def elapsed(self) -> float:
        """Return the time since creation [s]."""
        return time.monotonic() - self._started

    def begin(self, phase: str) -> None:
        """Show that a phase begins."""
        self.phase = self._state = phase
        if self._terminal:
            self._rewrite(phase)
        else:
            self._add(phase)

    def report(self, progress: Progress) -> None:
        """Show where the work is."""
        if progress.phase != self.phase:
            self.begin(progress.phase)
        else:
            payload = f', payload {progress.payload:.6g} kg' if progress.payload else ''
            self._state = (f'{progress.phase}{payload}: iteration {progress.iteration}, '
                           f'correction {progress.residual:.1e}, {progress.intervals} intervals')
            self.remind()

    def remind(self) -> None:
        """Show where the work is again, unless that was shown a moment ago."""
        if self._state and self.is_due():
            show = self._rewrite if self._terminal else self._add
            show(self._state)

    def is_due(self) -> bool:
        """Return whether the last state was shown long enough ago for another."""
        return self.elapsed > self._shown + (_OFTEN if self._terminal else _SELDOM)

    def close(self) -> None:
        """Remove the line from a terminal."""
        if self._terminal:
            self._stream.write_raw(_REWRITE)
            self._stream.flush()

    def _add(self, text: str) -> None:
        """Write a line of its own."""
        self._shown = self.elapsed
        print(f'{self._shown:7.1f} s  {printable(text)}', file=self._stream, flush=True)

    def _rewrite(self, text: str) -> None:
        """Write the line on a terminal anew."""
        self._shown = self.elapsed
        line = f'{self._shown:6.1f} s  {printable(text)}'[:self._width() - 1]
        self._stream.write_raw(f'{_REWRITE}{line}')
        self._stream.flush()

    def _width(self) -> int:
        """Return the width of the terminal."""
        try:
            return os.get_terminal_size(self._stream.fileno()).columns or _WIDTH
        except OSError:
            return _WIDTH


def run_with_progress(arm: Arm, time_limit: float,
                      work: Callable[[ArmModel, Monitor], Result],
                      prepare: Callable[[Arm], None] | None = None) -> Result:
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
    prepare : callable, optional
        Compiles what else the work takes, which is no part of its time.

    Raises
    ------
    CanceledError
        If Ctrl-C was pressed.

    """
    display = Display(sys.stderr)
    try:
        display.begin(f'preparing the dynamics of {arm.name}')
        model = ArmModel(arm)
        if prepare is not None:
            prepare(arm)
        with SIGNALS.patient() as canceled:

            def stopping() -> bool:
                display.remind()  # it is asked often, also where no iteration is reported
                return canceled()

            result = work(model, Monitor(time_limit=time_limit, canceled=stopping,
                                         report=display.report))
    finally:
        display.close()
    if canceled():
        raise CanceledError(f'{SIGNALS.word} after {display.elapsed:.1f} s, in the phase '
                            f'{display.phase!r}; nothing was written')
    return result
