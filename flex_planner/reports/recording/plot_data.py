"""What plots.js draws: plots with their lines and bands."""

from __future__ import annotations

from dataclasses import dataclass, field

from flex_planner.base.validation import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Series:
    """
    A line of a plot.

    Attributes
    ----------
    name : str
        In the legend.
    x, y : numpy.ndarray, shape (k,)
        The points; what is not finite is a gap.
    colour : str
        As CSS has it; lines of one colour belong together.
    dashed, dots : bool
        Drawn so instead of as a line.
    bound : bool
        Whether it is only there to compare others with: it may lie beyond the plot.
    filled : bool
        Whether what it encloses is shaded.

    """

    name: str
    x: Array
    y: Array
    colour: str
    dashed: bool = False
    dots: bool = False
    bound: bool = False
    filled: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Bands:
    """
    Ranges along x that are marked from top to bottom.

    Attributes
    ----------
    name : str
        In the legend.
    labels : list of str
        At each range.
    ranges : list of [low, high]
        In the unit of x.

    """

    name: str
    labels: list[str]
    ranges: list[list[float]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plot:
    """
    A plot.

    Attributes
    ----------
    key, title, x_label, y_label : str
        Its names.
    series : list of Series
        Its lines.
    group : str
        Plots of one group are zoomed together; empty for none.
    log, equal : bool
        Logarithmic upwards; the same scale in both directions.
    least : float
        Range upwards that is shown at least, so that rounding errors look like none.
    bands : Bands or None
        What is marked.

    """

    key: str
    title: str
    x_label: str
    y_label: str
    series: list[Series] = field(default_factory=list)
    group: str = ''
    log: bool = False
    equal: bool = False
    least: float = 0.0
    bands: Bands | None = None
