"""Pictures of a map, from what its store holds, finished or not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flex_planner.base.validation import Array
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.pictures.data import combinations, MapData
from flex_planner.maps.pictures.panels import (
    draw_cells,
    draw_contours,
    finish_map,
    grid_shape,
    legend_entries,
    MOST_PANELS,
    scale,
    show_scale,
)
from flex_planner.maps.pictures.scene import draw_arm, find_scene, frame, study_of
from flex_planner.maps.pictures.slices import draw_slices, lines_along, lines_through_points
from flex_planner.maps.store import open_map
from flex_planner.maps.study import Study
from flex_planner.plotting.figures import Picture, save
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

_PLANES = tuple((f'{end}_{first}', f'{end}_{second}') for end in ('goal', 'start')
                for first, second in ('xy', 'xz', 'yz'))
_SIDE = 4.6  # [in]
# height by width of a square diagram with its labels
_FLAT = 0.92


def draw_map(store: Path) -> dict[str, Figure]:
    """
    Draw a map, finished or not; return Matplotlib figures by their names.

    Over the workspace the quantity is drawn as colours with contours and the arm, a diagram for
    each combination of further values; if one of them is the duration, also against it for some
    points. Other maps with a duration are drawn against it, others with two axes as colours,
    with one as a line. Cells without a value are marked by kind, and counted.

    Parameters
    ----------
    store : Path
        Zarr store, as written by `flex_planner.maps.store.MapStore`.

    Returns
    -------
    dict of str to Picture
        Figures by names such as ``max_payload_map``.

    Raises
    ------
    MapStoreError
        If there is no map, or it is damaged.

    """
    data, study = _read(store)
    return {f'{data.key}_{name}': figure for name, figure in _figures(data, study).items()}


def save_map(store: Path, folder: Path) -> list[Path]:
    """
    Write the pictures of a map as PNG, see `draw_map`, and return their paths.

    Parameters
    ----------
    store : Path
        Zarr store.
    folder : Path
        For the pictures; made if there is none. Pictures of the same name are replaced.

    Raises
    ------
    MapStoreError
        If there is no map, or it is damaged.
    OSError
        If a picture cannot be written, naming the path.

    """
    pictures = {folder / f'{name}.png': figure for name, figure in draw_map(store).items()}
    for path, figure in pictures.items():
        save(figure, path)
    return list(pictures)


def _read(store: Path) -> tuple[MapData, Study | None]:
    """Return a map, and its study where the arm is to be drawn."""
    dataset = open_map(store)
    data = MapData.of(dataset)
    return data, study_of(dataset) if _is_workspace(data, _plane(data) or ()) else None


def _figures(data: MapData, study: Study | None) -> dict[str, Figure]:
    """Return the pictures that suit the axes of a map, by name."""
    plane, varied = _plane(data), data.varied_axes()
    duration = [place for place in data.places('duration') if place in varied]
    if plane is None:
        x, *lines = duration + [place for place in data.places('payload_mass') + tuple(varied)
                                if place in varied and place not in duration] or [0]
        return {'slices' if lines else 'line': draw_slices(data, x, *lines_along(data, lines[:1]))}
    figures = {'map': _map(data, plane, study)}
    if duration and _is_workspace(data, plane) and (data.codes == CellCode.SOLVED).any():
        figures['slices'] = draw_slices(data, duration[0], *lines_through_points(data, plane))
    return figures


def _plane(data: MapData) -> tuple[int, int] | None:
    """Return the axes that span the pictures, the first to the right; None for lines."""
    varied = data.varied_axes()
    for names in _PLANES:
        pair = data.places(*names)
        if len(pair) == 2 and set(pair) <= set(varied):
            return pair[0], pair[1]
    if len(varied) < 2 or set(varied) & set(data.places('duration')):
        return None
    return varied[0], varied[1]


def _is_workspace(data: MapData, plane: Sequence[int]) -> bool:
    return tuple(data.axes[place].name for place in plane) in _PLANES


def _map(data: MapData, plane: tuple[int, int], study: Study | None) -> Figure:
    """Return a picture of all cells over a plane, a diagram for each of the other values."""
    x, y = (data.axes[place] for place in plane)
    others = [place for place in range(len(data.axes)) if place not in plane]
    panels, omitted = combinations(data, others, MOST_PANELS)
    figure, diagrams = _diagrams(len(panels), _SIDE if len(panels) > 1 else 1.5 * _SIDE)
    cuts = [data.cut(plane, fixed) for fixed in panels]
    norm = scale(np.stack([values for values, _ in cuts]))
    entries: list[Artist] = []
    in_workspace = _is_workspace(data, plane)
    for axes, fixed, (values, codes) in zip(diagrams, panels, cuts, strict=False):
        mesh = draw_cells(axes, x, y, values, codes, norm)
        scene = find_scene(data, plane, fixed, study) if study else None
        draw_contours(axes, x, y, values, norm, scene.lines if scene else [])
        entries = draw_arm(axes, scene) if scene else entries
        if in_workspace:
            frame(axes, x, y, scene)
        axes.set_title(data.at(fixed), fontsize='medium')
    if any(np.isfinite(values).any() for values, _ in cuts):
        bar = figure.colorbar(mesh, ax=diagrams, label=data.label, extend=_extend(norm, cuts))
        show_scale(bar.ax.yaxis, norm)
    entries += legend_entries(np.stack([codes for _, codes in cuts]), data.kinds)
    finish_map(figure, data, omitted, entries)
    return figure


def _extend(norm: Normalize, cuts: list[tuple[Array, NDArray[np.int8]]]) -> str:
    """Return the end of the colour scale beyond which there are values."""
    below = any((values[np.isfinite(values)] < norm.vmin).any() for values, _ in cuts)
    return 'min' if below else 'neither'


def _diagrams(count: int, side: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with diagrams in rows."""
    columns, rows = grid_shape(count)
    figure = Picture(side * columns + 1.2, _FLAT * side * rows + 1.2)
    diagrams = list(np.atleast_1d(figure.subplots(rows, columns)).ravel())
    for empty in diagrams[count:]:
        empty.set_axis_off()
    return figure, diagrams[:count]
