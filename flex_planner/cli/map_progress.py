"""Progress and summary of ``flex-planner map``."""

from __future__ import annotations

from datetime import timedelta
import math
from typing import TYPE_CHECKING

from flex_planner.cli.progress_line import Display
from flex_planner.maps.cell_results import CellCode
from flex_planner.reports.motion import Row
import numpy as np

if TYPE_CHECKING:
    from flex_planner.maps.tally import Tally
    import xarray as xr

_BAR = 10


class MapDisplay(Display):
    """Shows the progress of a map: on a terminal in one line, elsewhere a line now and then."""

    def show(self, tally: Tally) -> None:
        """Show it, unless it was shown a moment ago."""
        if self.is_due():
            if self._terminal:
                self._rewrite(progress_line(tally, bar=True))
            else:
                self._add(progress_line(tally))


def progress_line(tally: Tally, *, bar: bool = False) -> str:
    """Return the progress of a map in a line."""
    full = _BAR * tally.done // tally.cells
    drawn = f'[{"#" * full}{"." * (_BAR - full)}] ' if bar else ''
    text = f'{drawn}{tally.done}/{tally.cells} cells, {tally.failed} failed'
    if math.isnan(tally.rate):
        return text
    left = str(timedelta(seconds=math.ceil(tally.time_left))) if tally.rate else 'unknown time'
    return f'{text}, {tally.rate:.3g} cells/s, {left} left'


def outcome_rows(tally: Tally, dataset: xr.Dataset) -> list[Row]:
    """Return the numbers of cells by result, the range of values, and the time."""
    rows = [('cells', f'{tally.done} of {tally.cells}')]
    rows += [(f'  {code.name.lower().replace("_", " ")}', f'{tally.of(code)}, {code.meaning}')
             for code in CellCode if tally.of(code)]
    quantity = dataset[dataset.attrs['quantity']]
    values = quantity.values[np.isfinite(quantity.values)]
    if values.size:
        rows.append((quantity.attrs['long_name'], f'{values.min():.6g} to {values.max():.6g} '
                                                  f'{quantity.attrs["units"]}'))
    if tally.computed:
        rows.append(('computed', f'{tally.computed} cells in {tally.elapsed:.1f} s, '
                                 f'{tally.computed / tally.elapsed:.3g} cells/s'))
    return rows
