"""Pictures made of equal diagrams, such as those of a paper."""

from __future__ import annotations

from flex_planner.plotting import diagrams
from flex_planner.plotting.figures import explain_lines, Picture
from matplotlib.axes import Axes
import numpy as np

_WIDTH, _HEIGHT, _LEGEND = 5.2, 3.7, 0.5


def draw_picture(picture: diagrams.Picture) -> Picture:
    """Return a picture as a Matplotlib figure."""
    columns = min(picture.columns, len(picture.panels))
    rows = -(-len(picture.panels) // columns)
    figure = Picture(_WIDTH * columns, _HEIGHT * rows + _LEGEND)
    axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
    for panel, one in zip(picture.panels, axes, strict=False):
        _draw(one, panel)
    for empty in axes[len(picture.panels):]:
        empty.set_axis_off()
    explain_lines(figure, list(axes[:len(picture.panels)]), 2 * columns)
    return figure


def _draw(axes: Axes, panel: diagrams.Panel) -> None:
    """Draw a diagram."""
    for curve in panel.curves:
        axes.plot(curve.x, curve.y, curve.style, color=curve.color, linewidth=curve.width,
                  label=curve.label or None, markersize=5)
    if panel.log:
        axes.set_yscale('log')
    if panel.equal:
        axes.set_aspect('equal', adjustable='datalim')
    axes.set(title=panel.title, xlabel=panel.x_label, ylabel=panel.y_label)
    axes.grid(alpha=0.3)
