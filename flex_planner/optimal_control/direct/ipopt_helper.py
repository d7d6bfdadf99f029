"""What a helper process does: IPOPT, one start after the other."""

from __future__ import annotations

from multiprocessing.connection import Connection
import signal
import time
from types import FrameType

from flex_planner.base.helper_process import ending_with_caller
from flex_planner.base.progress import Monitor, Progress, StoppedError
from flex_planner.optimal_control.direct.ipopt_start import Answer, solve_here, Start

# between two messages on iterations [s]
_OFTEN = 0.02


class _Reporter:
    """Sends what IPOPT's iterations say, and hears that it should give up."""

    def __init__(self, replies: Connection) -> None:
        self._replies, self._sent = replies, 0.0
        self._residuals: list[float] = []
        self.interrupted = False

    def interrupt(self, number: int, frame: FrameType | None) -> None:
        self.interrupted = True

    def report(self, progress: Progress) -> None:
        self._residuals.append(progress.residual)
        if time.monotonic() > self._sent + _OFTEN:
            self.flush()

    def flush(self) -> None:
        self._replies.send(self._residuals)
        self._residuals, self._sent = [], time.monotonic()


def serve(requests: Connection, replies: Connection) -> None:
    """Solve what is asked for: residuals go back while IPOPT runs, then its answer or error."""
    reporter = _Reporter(replies)
    signal.signal(signal.SIGUSR1, reporter.interrupt)
    replies.send(None)  # ready
    while True:
        start = requests.recv()
        reporter.interrupted = False
        with ending_with_caller(requests):
            outcome = _solve(start, reporter)
            reporter.flush()
        replies.send(outcome)


def _solve(start: Start, reporter: _Reporter) -> Answer | Exception:
    """Return IPOPT's answer, or the error that kept it from one."""
    monitor = Monitor(report=reporter.report, canceled=lambda: reporter.interrupted)
    try:
        return solve_here(start, monitor, 0)
    except StoppedError as error:
        return Answer.failed(start, str(error))
    except Exception as error:  # there it is raised
        return error
