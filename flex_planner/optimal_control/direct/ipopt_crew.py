"""
IPOPT in helper processes: side by side, and so that it can be stopped at any time.

IPOPT looks up only between its iterations, one of which may take ten seconds, CasADi not at all
while it derives a programme, and neither lets another thread of Python run. Their process is
ended where they do not give up at once.

"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Generator, Sequence
from functools import cache
import logging
import time

from flex_planner.base.helper_process import HelperLostError, HelperPool, HelperProcess
from flex_planner.base.processes import helper_processes
from flex_planner.base.progress import Monitor
from flex_planner.optimal_control.direct.ipopt_start import Answer, solve_here, Start

_POOL = HelperPool('flex_planner.optimal_control.direct.ipopt_helper', kept=4)
# how often a monitor is asked, and how long a helper may take to give up [s]
_OFTEN, _PATIENCE = 0.05, 0.1
# starting one more helper takes as long as so many short solves
_WORTH_A_HELPER = 4
# a start that has ended two helpers is left alone
_LOST = 2
_LOG = logging.getLogger(__name__)


def solve_each(starts: Sequence[Start], monitor: Monitor,
               intervals: int) -> Generator[Answer, None, None]:
    """
    Yield IPOPT's answers in the order of the starts, which are solved side by side.

    What comes of them, and what the monitor hears, does not depend on how many processes there
    are.

    Parameters
    ----------
    starts : sequence of Start
        In order.
    monitor : Monitor
        Receives every iteration of the answer that is next, and may stop the work.
    intervals : int
        Of the mesh, for the monitor.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    crew = _Crew(_borrow(len(starts)), starts, monitor, intervals)
    try:
        for turn in range(len(starts)):
            yield crew.wait_for(turn)
    finally:
        crew.dismiss()


def _borrow(count: int) -> list[HelperProcess]:
    """Return helpers for so many starts; none where there cannot or should not be any."""
    most = min(helper_processes(), count)
    if not most:
        return []
    try:
        return _POOL.borrow(most, min(most, max(1, count // _WORTH_A_HELPER)))
    except OSError as error:
        _warn(error)
        return []


def _warn(error: Exception) -> None:
    _warn_once(str(error))


@cache
def _warn_once(reason: str) -> None:
    _LOG.warning('IPOPT runs in this process, where it cannot be stopped at once: no other one '
                 'can do it (%s)', reason)


class _Crew:
    """Helpers that work on starts; without any the starts are solved in this process."""

    def __init__(self, helpers: list[HelperProcess], starts: Sequence[Start], monitor: Monitor,
                 intervals: int) -> None:
        self._helpers, self._starts, self._waiting = helpers, starts, deque(range(len(starts)))
        self._monitor, self._intervals = monitor, intervals
        self._work: dict[HelperProcess, int] = {}
        self._lost: Counter[int] = Counter()
        self._residuals: dict[int, list[float]] = {}
        self._outcomes: dict[int, Answer | Exception] = {}

    def wait_for(self, turn: int) -> Answer:
        """Return the answer of a start, the next one."""
        while True:
            self._monitor.check()
            if self._monitor.exhausted:
                return Answer.failed(self._starts[turn], 'its share of the work is used up')
            self._distribute()
            self._tell(turn)
            outcome = self._outcomes.pop(turn, None)
            if isinstance(outcome, Exception):
                raise outcome
            if outcome is not None:
                return outcome
            if not self._helpers:
                return self._solve_here(turn)
            for helper in HelperProcess.wait(self._helpers, _OFTEN):
                self._hear(helper)

    def dismiss(self) -> None:
        """Let the helpers go: those that give up are kept for the next use, others end."""
        try:
            for helper in self._work:
                helper.interrupt()
            until = time.monotonic() + _PATIENCE
            while self._work and (left := until - time.monotonic()) > 0:
                for helper in HelperProcess.wait(list(self._work), left):
                    self._hear(helper)
            kept = [helper for helper in self._helpers if helper not in self._work]
        except BaseException:  # no patience at all: Ctrl-C again
            self._work, kept = dict.fromkeys(self._helpers, 0), []
            raise
        finally:
            for helper in self._work:
                helper.end()
        for helper in kept:
            _POOL.give_back(helper)

    def _distribute(self) -> None:
        """Give every helper that is ready a start."""
        for helper in list(self._helpers):
            if self._waiting and helper.ready and helper not in self._work:
                turn = self._waiting.popleft()
                try:
                    helper.send(self._starts[turn])
                    self._work[helper] = turn
                except HelperLostError as error:  # it has ended while it had nothing to do
                    self._waiting.appendleft(turn)
                    self._lose(helper, error)

    def _tell(self, turn: int) -> None:
        """Tell the monitor of the iterations of a start."""
        for residual in self._residuals.pop(turn, ()):
            self._monitor.step(residual, self._intervals)
            self._monitor.check()

    def _hear(self, helper: HelperProcess) -> None:
        """Take a message: nothing but that it is ready, residuals, or an outcome."""
        try:
            message = helper.receive()
        except HelperLostError as error:
            self._lose(helper, error)
            return
        if message is None:
            helper.ready = True
        elif isinstance(message, list):
            self._residuals.setdefault(self._work[helper], []).extend(message)
        else:
            self._outcomes[self._work.pop(helper)] = message

    def _lose(self, helper: HelperProcess, error: HelperLostError) -> None:
        """Go on without a helper; another one tries its start, but only one."""
        self._helpers.remove(helper)
        helper.end()
        turn = self._work.pop(helper, None)
        if turn is not None:
            self._lost[turn] += 1
            if self._lost[turn] < _LOST:
                self._waiting.appendleft(turn)
            else:
                self._outcomes[turn] = Answer.failed(self._starts[turn], f'its process {error}')
        if not self._helpers and helper.ready:
            self._helpers += _borrow(1)
        elif not self._helpers:  # it has not even begun: others would not, either
            _warn(error)

    def _solve_here(self, turn: int) -> Answer:
        """Solve a start in this process, unless it has ended another one."""
        start = self._starts[turn]
        self._waiting.remove(turn)
        if self._lost[turn]:
            return Answer.failed(start, 'its process has ended')
        return solve_here(start, self._monitor, self._intervals)
