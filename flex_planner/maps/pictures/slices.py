"""A map along one of its axes: lines, and below them what has no value."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.pictures.data import combinations, MapAxis, MapData, spread
from flex_planner.maps.pictures.panels import (
    finish_map,
    grid_shape,
    legend_entries,
    MARKERS,
    MOST_PANELS,
    scale,
    show_scale,
)
from flex_planner.plotting.figures import Picture, say
import matplotlib
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize, to_hex
from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

_MOST_LINES, _MOST_POINTS = 10, 7
_WIDE, _HIGH = 6.4, 4.2  # [in]
_MARGIN = 0.05
# of the colour map: yellow lines are hard to see
_BRIGHTEST = 0.9


def draw_slices(data: MapData, x: int, lines: list[dict[int, int]], labels: list[str],
                omitted: list[str]) -> Figure:
    """Return a picture of lines along an axis, a diagram for each of the other values."""
    taken = {x, *(place for line in lines for place in line)}
    others = [place for place in range(len(data.axes)) if place not in taken]
    panels, more = combinations(data, others, MOST_PANELS)
    cuts = [[data.cut([x], {**fixed, **line}) for line in lines] for fixed in panels]
    codes = np.array([[codes for _, codes in cut] for cut in cuts])
    failed = _is_failure(codes).any(axis=(0, 2))
    figure, pairs = _create_diagrams(len(panels), int(failed.sum()))
    colors = _colors(len(lines))
    norm = scale(np.array([[values for values, _ in cut] for cut in cuts]))
    for (axes, below), fixed, cut in zip(pairs, panels, cuts, strict=True):
        for (values, _), color, label in zip(cut, colors, labels, strict=True):
            _draw_line(axes, data.axes[x], values, color, label)
        if below is not None:
            _draw_failures(below, data.axes[x], [
                (cut[line][1], colors[line]) for line in np.flatnonzero(failed)])
        if not any(np.isfinite(values).any() for values, _ in cut):
            say(axes, 'no cell is solved')
        _label(axes, below, data, x, norm)
        axes.set_title(data.at(fixed), fontsize='medium')
    if len(lines) > 1:
        figure.legend(*pairs[0][0].get_legend_handles_labels(), loc='outside right center',
                      fontsize='small')
    finish_map(figure, data, omitted + more, legend_entries(codes, data.kinds, marked=True))
    return figure


def _create_diagrams(count: int, failed: int) -> tuple[Figure, list[tuple[Axes, Axes | None]]]:
    """Return a figure with diagrams in rows, each with a strip for so many failed lines."""
    (columns, rows), strip = grid_shape(count), 0.1 + 0.14 * failed
    heights = [_HIGH, strip] if failed else [_HIGH]
    figure = Picture(_WIDE * columns + 1.8, (sum(heights) + 0.5) * rows + 0.8)
    grid = figure.subplots(rows * len(heights), columns, height_ratios=heights * rows,
                           squeeze=False)
    upper = grid[::len(heights)].ravel()
    for axes in upper[1:]:
        axes.sharey(upper[0])
    lower = grid[1::2].ravel() if failed else [None] * upper.size
    for empty in [*upper[count:], *lower[count:]]:
        if empty is not None:
            empty.set_axis_off()
    return figure, list(zip(upper, lower, strict=True))[:count]


def _label(axes: Axes, below: Axes | None, data: MapData, x: int, norm: Normalize) -> None:
    """Give a diagram and the strip below it their scales."""
    axes.set_ylabel(data.label)
    axes.grid(alpha=0.3)
    if isinstance(norm, LogNorm):
        axes.set_yscale('log')
        show_scale(axes.yaxis, norm)
    values = data.axes[x].values
    margin = _MARGIN * float(np.ptp(values)) or 0.5
    lowest = axes if below is None else below
    for each in (axes, lowest):
        each.set_xlim(values.min() - margin, values.max() + margin)
    axes.tick_params(labelbottom=below is None)
    lowest.set_xlabel(data.axes[x].label)


def lines_along(data: MapData, place: list[int]
                ) -> tuple[list[dict[int, int]], list[str], list[str]]:
    """Return a line for each value of an axis, its label, and what was left out."""
    lines, omitted = combinations(data, place, _MOST_LINES)
    return lines, [data.at(line) for line in lines], omitted


def lines_through_points(data: MapData, plane: tuple[int, int]
                         ) -> tuple[list[dict[int, int]], list[str], list[str]]:
    """Return a line for some points of the workspace, from the best to the worst."""
    values = np.moveaxis(data.values, plane, (0, 1))
    values = values.reshape(*values.shape[:2], -1)
    # by their values where most have one
    values = values[..., np.isfinite(values).sum((0, 1)).argmax()]
    known = np.argwhere(np.isfinite(values))
    order = np.argsort(values[tuple(known.T)], kind='stable')
    known = known[order[::-1] if data.best(np.array([0.0, 1.0])) else order]
    cells = [known[k] for k in spread(len(known), _MOST_POINTS)]
    lines = [dict(zip(plane, map(int, cell), strict=True)) for cell in cells]
    x, y = (data.axes[place] for place in plane)
    kind = x.name[:-2]
    labels = [f'{kind} ({x.values[i]:.3g}, {y.values[j]:.3g}) m' for i, j in cells]
    missing = len(known) - len(cells)
    return lines, labels, [f'{missing} of {len(known)} points'] if missing else []


def _colors(count: int) -> list[str]:
    """Return colours in the order of the lines."""
    shades = matplotlib.colormaps['viridis'](np.linspace(0, _BRIGHTEST, count))
    return [to_hex(shade) for shade in shades]


def _is_failure(codes: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Return the mask of cells that failed."""
    return ~np.isin(codes, (CellCode.PENDING, CellCode.SOLVED))


def _draw_line(axes: Axes, x: MapAxis, values: Array, color: str, label: str) -> None:
    """Draw a line with points; it is interrupted where there is no value."""
    axes.plot(x.values, values, 'o-', color=color, markersize=4, linewidth=1.5, label=label)


def _draw_failures(axes: Axes, x: MapAxis, lines: list[tuple[NDArray[np.int8], str]]) -> None:
    """Mark failed cells below a diagram with the same x axis, one row per line, from above."""
    for row, (codes, color) in enumerate(lines):
        for kind, marker in MARKERS.items():
            places = x.values[codes == kind]
            if places.size:
                axes.plot(places, np.full(places.size, row), linestyle='', marker=marker,
                          color=color, markersize=5)
    axes.set(ylim=(len(lines) - 0.5, -0.5), yticks=[])
    axes.set_ylabel('no value', rotation=0, ha='right', va='center', fontsize='small')
