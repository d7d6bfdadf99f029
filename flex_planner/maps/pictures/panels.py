"""Cells of a map over a plane, and what all pictures of maps share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
import itertools
import textwrap

from flex_planner.base.validation import Array
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.pictures.data import MapAxis, MapData
from flex_planner.plotting.figures import plain
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import Locator, LogLocator, MaxNLocator, NullFormatter
import numpy as np
from numpy.typing import NDArray

# face, hatch and marker; light, so that none looks like a value
_LOOKS = {CellCode.PENDING: ('white', '', ''), CellCode.UNREACHABLE: ('#dcdcdc', '', '_'),
          CellCode.INFEASIBLE: ('#f7dcd6', '////', 'x'),
          CellCode.NOT_CONVERGED: ('#fbeccb', '....', 'o'),
          CellCode.CERTIFICATE_FAILED: ('#e6dcf2', '\\\\\\\\', 's'),
          CellCode.TIMEOUT: ('#d8e6f3', '----', 'v'), CellCode.INVALID: ('#ececec', '++++', '+'),
          CellCode.FAILED: ('#f4b6b6', 'xxxx', 'D'), CellCode.NOT_FOUND: ('#f3e3bd', '..', '.'),
          CellCode.LIMIT_VIOLATED: ('#d5ece0', '||||', '|'),
          CellCode.BENT_TOO_FAR: ('#e3e3f7', '**', '*')}
MARKERS = {kind: marker for kind, (_, _, marker) in _LOOKS.items() if marker}
_HATCH = '#8a8a8a'
# diagrams of a picture; of its title [1/in]; of its legend [in]
MOST_PANELS = 9
_LETTERS, _ENTRY = 11, 2.4
# largest by smallest value from which a logarithmic scale shows more
_LOG_FROM = 30.0
_DECADES = 1e3
_LEVELS = 7
_FEWEST = 3
_HALO = 2.0
# of a picture's side: contours with a value, and what is left free around it
_LONG, _ROOM = 0.15, 0.08
_BETWEEN = 6
_MANY = 30


def scale(values: Array) -> Normalize:
    """Return a scale of colours for the values that are known, logarithmic if they differ much."""
    known = values[np.isfinite(values)]
    if not known.size:
        return Normalize(0, 1)
    low, high = float(known.min()), float(known.max())
    # values that are spread evenly stay so
    if 0 < low < high / _LOG_FROM and np.median(known) < high / _LOG_FROM**0.5:
        return LogNorm(max(low, high / _DECADES), high)
    return Normalize(low, high) if low < high else Normalize(low - 0.5, high + 0.5)


def edges(values: Array) -> Array:
    """Return the borders of cells, half-way between their values."""
    if values.size == 1:
        half = 0.5 * (abs(float(values[0])) or 1.0)
        lone: Array = values[0] + np.array([-half, half])
        return lone
    middle = (values[1:] + values[:-1]) / 2
    first, last = 2 * values[0] - middle[0], 2 * values[-1] - middle[-1]
    found: Array = np.concatenate([[first], middle, [last]])
    return found


def draw_cells(axes: Axes, x: MapAxis, y: MapAxis, values: Array, codes: NDArray[np.int8],
               norm: Normalize) -> QuadMesh:
    """Draw the cells of a plane, arrays of shape (x, y): values as colours, failures by kind."""
    columns, rows = edges(x.values), edges(y.values)
    mesh = axes.pcolormesh(columns, rows, values.T, norm=norm, cmap='viridis')
    for kind, (face, hatch, marker) in _LOOKS.items():
        areas = _areas(columns, rows, codes == kind)
        if areas and marker:
            axes.add_collection(PolyCollection(areas, facecolor=face, edgecolor=_HATCH,
                                               hatch=hatch, linewidth=0), autolim=False)
    axes.set(xlabel=x.label, ylabel=y.label)
    return mesh


def _areas(columns: Array, rows: Array, chosen: NDArray[np.bool_]) -> list[Array]:
    """Return rectangles over the chosen cells, neighbours in a column as one."""
    areas = []
    for i, column in enumerate(chosen):
        steps = np.flatnonzero(np.diff(np.concatenate([[False], column, [False]])))
        areas += [np.array([[columns[i + right], rows[end]] for right, end in
                            ((0, low), (1, low), (1, high), (0, high))])
                  for low, high in zip(steps[::2], steps[1::2], strict=True)]
    return areas


def draw_contours(axes: Axes, x: MapAxis, y: MapAxis, values: Array, norm: Normalize,
                  arm: list[Array]) -> None:
    """Draw lines of equal value where there are enough cells; their values beside the arm."""
    known = values[np.isfinite(values)]
    if min(values.shape) < _FEWEST or known.size < _FEWEST**2:
        return
    low, high = float(norm.vmin or 0), float(norm.vmax or 0)
    levels = [tick for tick in locator(norm).tick_values(low, high)
              if max(known.min(), low) < tick < known.max()]
    if not levels:
        return
    lines = axes.contour(x.values, y.values, values.T, levels, colors='white', linewidths=1.0)
    lines.set_path_effects([withStroke(linewidth=_HALO, foreground='#40404080')])
    size = np.array([np.ptp(x.values), np.ptp(y.values)])
    places = _label_places(list(itertools.chain(*lines.allsegs)), size, arm)
    if places:
        for text in axes.clabel(lines, fmt=_plain, fontsize=8, colors='white', manual=places):
            text.set_path_effects([withStroke(linewidth=_HALO, foreground='#404040')])


def _label_places(lines: list[Array], size: Array, arm: list[Array]) -> list[Array]:
    """Return a point on each line that is long enough, away from the arm and one another."""
    taken = np.concatenate([np.full((1, 2), np.inf), *(_densify(part) / size for part in arm)])
    places: list[Array] = []
    for line in lines:
        points = _densify(line) / size
        if np.linalg.norm(np.diff(points, axis=0), axis=1).sum() < _LONG:
            continue
        # a label at an end would be cut off
        inner = points[points.shape[0] // 5:-(points.shape[0] // 5) or None]
        room = np.linalg.norm(inner[:, None] - taken, axis=-1).min(axis=1)
        best = int(room.argmax())
        if room[best] > _ROOM:
            taken = np.concatenate([taken, inner[best:best + 1]])
            places.append(inner[best] * size)
    return places


def _densify(line: Array) -> Array:
    """Return more points along a line."""
    shares = np.linspace(0, 1, _BETWEEN, endpoint=False, dtype=np.float64)[:, None]
    between = [a + shares * (b - a) for a, b in zip(line[:-1], line[1:], strict=True)]
    return np.concatenate([*between, line[-1:]])


def locator(norm: Normalize) -> Locator:
    """Return the locator of a scale's ticks."""
    if isinstance(norm, LogNorm):
        return LogLocator(subs=(1, 2, 5), numticks=_MANY)
    return MaxNLocator(_LEVELS)


def show_scale(axis: Axis, norm: Normalize) -> None:
    """Write the values of a logarithmic scale in full."""
    if isinstance(norm, LogNorm):
        axis.set_major_locator(locator(norm))
        axis.set_major_formatter(_plain)
        axis.set_minor_formatter(NullFormatter())


def _plain(value: float, place: float = 0) -> str:
    """Return a value of a scale without needless digits."""
    return f'{value:.4g}'


def legend_entries(codes: NDArray[np.int8], names: Mapping[int, str],
                   marked: bool = False) -> list[Artist]:
    """Return entries of a legend for what was not solved, as areas or as marks, with counts."""
    counts = Counter(codes.ravel().tolist())
    entries: list[Artist] = []
    for kind, (face, hatch, marker) in _LOOKS.items():
        label = f'{names[kind]}: {counts[kind]}'
        if not counts[kind] or (marked and kind is CellCode.PENDING):
            continue
        entries.append(
            Line2D([], [], color='gray', linestyle='', marker=marker, label=label) if marked else
            Patch(facecolor=face, edgecolor=_HATCH, hatch=hatch, linewidth=0.5, label=label))
    return entries


def grid_shape(count: int) -> tuple[int, int]:
    """Return the number of columns and rows of so many diagrams."""
    columns = 2 if count == 4 else min(count, 3)
    return columns, -(-count // columns)


def finish_map(figure: Figure, data: MapData, omitted: list[str], entries: list[Artist]) -> None:
    """Write title and legend; a map that is not finished says so."""
    width = figure.get_figwidth()
    lines = [f'{data.name}: {data.quantity}' if data.name else data.quantity, data.progress,
             f'left out: {"; ".join(omitted)}' if omitted else '']
    title = '\n'.join(textwrap.fill(line, int(_LETTERS * width)) for line in lines if line)
    figure.suptitle(plain(title), fontsize='large')
    if entries:
        figure.legend(handles=entries, loc='outside lower center', fontsize='small',
                      ncols=max(1, int(width / _ENTRY)))
