"""
Progress as a bar, in notebooks and in terminals, by tqdm.

    with ProgressBar(time_limit=60) as bar:
        plan = plan_path(task, monitor=Monitor(time_limit=60, report=bar.report))

tqdm is the only dependency, ``pip install 'flex_planner[notebooks]'``. Planning does not know
how much is left, so that its bar is the share of the time limit that is used up; maps know their
cells.

"""

from __future__ import annotations

import math
import time
from types import TracebackType
from typing import Any, Protocol

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Progress
from flex_planner.base.text import printable

_OFTEN = 0.1  # [s]


class Cells(Protocol):
    """Progress of a map: cells, how many are done, and how many of these have no value."""

    cells: int

    @property
    def done(self) -> int:
        """Return the number of cells with an outcome."""

    @property
    def failed(self) -> int:
        """Return the number of cells with an outcome other than a value."""


class ProgressBar:
    """
    A bar for the progress of planning, of searches and of maps.

    Parameters
    ----------
    time_limit : float
        Of planning [s]; without one there is no bar, but phase, iterations and time.
    stream : text file, optional
        Where to, outside notebooks (default: standard error).

    Raises
    ------
    FlexPlannerError
        If tqdm is not installed.

    """

    def __init__(self, time_limit: float = math.inf, stream: Any = None) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError as error:
            raise FlexPlannerError(
                f"a progress bar needs tqdm: pip install 'flex_planner[notebooks]' ({error})"
            ) from None
        self._limit, self._started, self._shown = time_limit, time.monotonic(), -math.inf
        self._bar = tqdm(file=stream, leave=False, unit=' s',
                         total=time_limit if math.isfinite(time_limit) else None)

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._bar.close()

    def report(self, progress: Progress) -> None:
        """Show the progress of planning or of a search: `report` of a `Monitor`."""
        payload = f', {progress.payload:.4g} kg' if progress.payload else ''
        self._show(f'{progress.phase}{payload}, iteration {progress.iteration}',
                   min(time.monotonic() - self._started, self._limit))

    def count(self, tally: Cells) -> None:
        """Show the progress of a map: `report` of `flex_planner.maps.run_map`."""
        self._bar.total, self._bar.unit = tally.cells, ' cells'
        self._show(f'{tally.failed} failed', tally.done, last=tally.done == tally.cells)

    def _show(self, text: str, value: float, *, last: bool = False) -> None:
        """Show a state, unless one was shown a moment ago."""
        now = time.monotonic()
        if now < self._shown + _OFTEN and not last:
            return
        self._shown = now
        self._bar.n = round(value, 1)
        self._bar.set_description_str(printable(text), refresh=False)
        self._bar.refresh()
