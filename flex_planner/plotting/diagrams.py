"""The parts of pictures of equal diagrams: curves, in panels, in a picture."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.colours import FEEDBACK, FLEXIBLE, RIGID
from flex_planner.base.validation import Array
from flex_planner.simulation.execution import ExecutionMode

# what is planned gives the colour; without feedback the lines are dashed
MODE_COLOURS = {
    ExecutionMode.FLEXIBLE_OPEN: FLEXIBLE, ExecutionMode.RIGID_OPEN: RIGID,
    ExecutionMode.FLEXIBLE: FLEXIBLE, ExecutionMode.RIGID: RIGID, ExecutionMode.PD_ONLY: FEEDBACK}
OPEN_LOOP = (ExecutionMode.FLEXIBLE_OPEN, ExecutionMode.RIGID_OPEN)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """
    A line of a diagram.

    Attributes
    ----------
    x, y : numpy.ndarray, shape (k,)
        Its points.
    label : str
        In the legend; empty for none.
    color, style : str
        As Matplotlib takes them.
    width : float
        Of the line [pt].

    """

    x: Array
    y: Array
    label: str = ''
    color: str = FLEXIBLE
    style: str = '-'
    width: float = 1.3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Panel:
    """A diagram; `equal` gives both axes the same scale, `log` the vertical one decades."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    equal: bool = False
    log: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """Diagrams in rows of `columns`, saved as NAME.png."""

    name: str
    caption: str
    panels: tuple[Panel, ...]
    columns: int = 2
