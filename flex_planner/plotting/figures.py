"""Labels and files of all pictures."""

from __future__ import annotations

from pathlib import Path
import secrets

from flex_planner.base.paths import expand_path
from matplotlib.axes import Axes
from matplotlib.figure import Figure

_DPI = 110


def finish(axes: Axes, title: str, y_label: str, x_label: str = 'time [s]', *,
           legend: str = 'best', columns: int = 1) -> None:
    """Label a diagram, and add a legend at a place in a number of columns."""
    axes.set(title=title, xlabel=x_label, ylabel=y_label)
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize='small', loc=legend, ncols=columns)


def say(axes: Axes, text: str) -> None:
    """Write a remark into a diagram that has nothing to show."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha='center')


def save(figure: Figure, path: Path) -> None:
    """
    Write a picture, whole or not at all; one of that name is replaced.

    Raises
    ------
    OSError
        If it cannot be written, naming the path.

    """
    path = expand_path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    stage = path.with_name(f'.{secrets.token_hex(8)}.{path.name}')
    try:
        figure.savefig(stage, dpi=_DPI)
        stage.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        stage.unlink(missing_ok=True)
