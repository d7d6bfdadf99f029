"""Labels and files of all pictures."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
import secrets
from typing import Any
import warnings

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.paths import expand_path
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

_DPI = 110
_NOTEBOOK_DPI = 80


class Picture(Figure):
    """A figure that notebooks show without `matplotlib.pyplot`."""

    def __init__(self, width: float, height: float) -> None:
        super().__init__(figsize=(width, height), layout='constrained')

    def _repr_png_(self) -> bytes:
        """Return the picture as PNG."""
        return _drawn(self, 'png', _NOTEBOOK_DPI)


def finish(axes: Axes, title: str, y_label: str, x_label: str = 'time [s]', *,
           legend: str = 'best', columns: int = 1) -> None:
    """Label a diagram, and add a legend at a place in a number of columns."""
    axes.set(title=title, xlabel=x_label, ylabel=y_label)
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize='small', loc=legend, ncols=columns)


def explain_lines(figure: FigureBase, axes: Sequence[Axes], columns: int) -> None:
    """Say what the lines are, once for all diagrams: a name is the same line in each."""
    named: dict[str, Artist] = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
        if (legend := one.get_legend()) is not None:
            legend.remove()
    if named:
        figure.legend(named.values(), named.keys(), loc='outside lower center', ncols=columns,
                      fontsize='small')


def plain(text: str) -> str:
    """Return a text from outside that Matplotlib takes for no formula."""
    return text.replace('$', r'\$')


def say(axes: Axes, text: str) -> None:
    """Write a remark into a diagram that has nothing to show."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha='center')
    axes.set(xticks=[], yticks=[])


def save(figure: Figure, path: Path) -> None:
    """
    Write a picture, whole or not at all; one of that name is replaced.

    Raises
    ------
    InvalidValueError
        If its name ends like that of no kind of picture.
    OSError
        If it cannot be written, naming the path.

    """
    path = expand_path(path)
    kind = path.suffix[1:].lower() or 'png'
    if kind not in figure.canvas.get_supported_filetypes():
        raise InvalidValueError('the picture', str(path), 'named like a picture, NAME.png')
    path.parent.mkdir(parents=True, exist_ok=True)
    # not the whole name, which may be as long as names can be
    stage = path.with_name(f'.{secrets.token_hex(8)}.{kind}')
    try:
        stage.write_bytes(_drawn(figure, kind, _DPI))  # drawing takes much longer than writing
        stage.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        stage.unlink(missing_ok=True)


def _drawn(figure: Figure, kind: str, dpi: float) -> bytes:
    """Return a picture as a file of some kind."""
    drawn = BytesIO()
    options: dict[str, Any] = {'dpi': dpi, 'format': kind}
    with warnings.catch_warnings():
        # letters that the font lacks are drawn as boxes, which is seen
        warnings.filterwarnings('ignore', message='Glyph .* missing from')
        figure.savefig(drawn, **options)
    return drawn.getvalue()
