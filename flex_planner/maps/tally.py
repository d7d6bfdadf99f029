"""Progress of the computation of a map."""

from __future__ import annotations

from collections import deque
import math
import time

from flex_planner.maps.cell_results import CellCode
import numpy as np
from numpy.typing import NDArray

_WINDOW = 60.0  # [s], that the rate is taken over


class Tally:
    """
    Counts the cells of a map.

    Parameters
    ----------
    codes : numpy.ndarray
        A `CellCode` each.

    Attributes
    ----------
    cells : int
        Of the map.

    """

    def __init__(self, codes: NDArray[np.int8]) -> None:
        self.cells, self._started = codes.size, time.monotonic()
        self._counts = np.bincount(codes.ravel(), minlength=len(CellCode))
        self._before = self.done
        self._history = deque([(self._started, self.done)])

    def count(self, before: NDArray[np.int8], after: NDArray[np.int8]) -> None:
        """Count cells whose codes have changed."""
        for codes, sign in ((before, -1), (after, 1)):
            self._counts += sign * np.bincount(codes.ravel(), minlength=len(CellCode))
        now = time.monotonic()
        self._history.append((now, self.done))
        # one entry older than the window stays, to have all of it
        while len(self._history) > 2 and self._history[1][0] < now - _WINDOW:
            self._history.popleft()

    @property
    def done(self) -> int:
        """Return the number of cells with an outcome."""
        return self.cells - self.of(CellCode.PENDING)

    @property
    def failed(self) -> int:
        """Return the number of cells that are done and have no value."""
        return self.done - self.of(CellCode.SOLVED)

    @property
    def computed(self) -> int:
        """Return the number of cells of this run."""
        return self.done - self._before

    @property
    def elapsed(self) -> float:
        """Return the time from the beginning to the cells that were counted last [s]."""
        return self._history[-1][0] - self._started

    @property
    def rate(self) -> float:
        """Return the cells per second over the last minute; NaN before the first cell."""
        since, done = self._history[0]
        span = time.monotonic() - since
        return (self.done - done) / span if self.computed and span > 0 else math.nan

    @property
    def time_left(self) -> float:
        """Return the time that the rest takes at that rate [s]; infinite at rate 0."""
        return (self.cells - self.done) / self.rate if self.rate else math.inf

    def of(self, code: CellCode) -> int:
        """Return the number of cells of a kind."""
        return int(self._counts[code])
