"""Curves of diagrams, so that each is seen and no axis shows rounding errors."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.colours import hides_another
from flex_planner.base.validation import Array
from matplotlib.axes import Axes

_DASHES = (0, (4, 4))
# of the height of the torques, that bounds may add on either side before they are cut off
_WIDE = 1.5
_MARGIN = 0.08


def draw_columns(axes: Axes, times: Array, values: Array, names: Sequence[str],
                 colours: Sequence[str]) -> None:
    """
    Draw a curve per column, dashed where it lies upon an earlier one.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        To draw in.
    times : numpy.ndarray, shape (k,)
        [s].
    values : numpy.ndarray, shape (k, m)
        Columns.
    names, colours : sequence of str
        m of each.

    """
    for i, (name, colour) in enumerate(zip(names, colours, strict=True)):
        style = _DASHES if hides_another(values, i) else '-'
        axes.plot(times, values[:, i], color=colour, linestyle=style, linewidth=1.5, label=name)


def settle_limits(axes: Axes, least: float) -> None:
    """Show at least a range of heights, so that rounding errors look like none; no offsets."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = (low + high) / 2
        axes.set_ylim(middle - least / 2, middle + least / 2)
    axes.ticklabel_format(axis='y', useOffset=False)


def limits_beside(values: Array, bounds: Array, least: float) -> tuple[float, float]:
    """
    Return the range of heights that shows values, and bounds as far as they are near.

    Parameters
    ----------
    values, bounds : numpy.ndarray
        Of any shape; bounds may be infinite.
    least : float
        Smallest range.

    Returns
    -------
    low, high : float
        Bounds that are further from the values than these are high are cut off.

    """
    low, high = float(min(values.min(), 0.0)), float(max(values.max(), 0.0))
    height = max(high - low, least)
    near = bounds[(bounds >= low - _WIDE * height) & (bounds <= high + _WIDE * height)]
    low, high = min([low, *near.ravel()]), max([high, *near.ravel()])
    spare = max(_MARGIN * (high - low), (least - high + low) / 2)
    return low - spare, high + spare
