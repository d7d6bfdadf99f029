"""Limits on the way in diagrams: regions that are kept free, bounds, and when one is active."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.colours import ASIDE, coordinate_colour, REFUSED, VIA
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import (
    JointRange,
    JointSpeed,
    KeepOut,
    PathConstraint,
)
from flex_planner.planning.constraint_margins import ConstraintMargin
from flex_planner.planning.region_outlines import find_keep_outs, outline_region
from flex_planner.plotting.figures import plain
from matplotlib.axes import Axes
import numpy as np

_SHADE, _FILL = 0.15, 0.3
# of the height of a diagram: bounds further away are left out
_NEAR = 0.3


def draw_keep_outs(axes: Axes, constraints: Sequence[PathConstraint], extent: float) -> None:
    """
    Draw the regions that are kept free into a picture of the arm.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        In metres.
    constraints : sequence of PathConstraint
        Those that keep no region free are left out.
    extent : float
        To which half-planes are drawn [m].

    """
    for one in find_keep_outs(constraints):
        corners = outline_region(one.region, extent)
        axes.fill(*corners.T, facecolor=REFUSED, alpha=_FILL, edgecolor=REFUSED,
                  label=name_region(one))


def shade_active(axes: Axes, margins: Sequence[ConstraintMargin]) -> None:
    """Shade the times at which a limit is active in a diagram over time."""
    for margin in margins:
        for first, last in margin.active:
            axes.axvspan(first, last, color=REFUSED, alpha=_SHADE, linewidth=0,
                         label=f'at its limit: {plain(margin.name)}')


def mark_via_times(axes: Axes, via_times: Array) -> None:
    """Mark the times (k,) at which via points are passed in a diagram over time [s]."""
    for time in via_times:
        axes.axvline(time, color=VIA, linestyle='-.', linewidth=1, label='via points')


def draw_via_points(axes: Axes, times: Array, path: Array, via_times: Array) -> None:
    """
    Mark where the tip is at via points in a picture of its path.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        In metres.
    times : numpy.ndarray, shape (k,)
        Of the path [s].
    path : numpy.ndarray, shape (k, 2), or (k, 3) in space
        Of the tip [m].
    via_times : numpy.ndarray, shape (m,)
        When via points are passed [s].

    """
    if via_times.size:
        passed = [np.interp(via_times, times, column) for column in path.T]
        axes.plot(*passed, 'D', color=VIA, label='via points')


def draw_speed_limits(axes: Axes, constraints: Sequence[PathConstraint]) -> None:
    """Draw limits of joint speeds that are near into a diagram of them [rad/s]."""
    for one in constraints:
        if isinstance(one, JointSpeed):
            _draw_bounds(axes, one.joint, [-one.limit, one.limit])


def draw_angle_limits(axes: Axes, constraints: Sequence[PathConstraint], scale: Array) -> None:
    """Draw limits of joint angles that are near into a diagram of them, in units of 1 / scale."""
    for one in constraints:
        if isinstance(one, JointRange):
            factor = float(scale[one.joint - 1])
            _draw_bounds(axes, one.joint, [factor * one.lower, factor * one.upper])


def _draw_bounds(axes: Axes, joint: int, bounds: Sequence[float]) -> None:
    """Draw lines at bounds that are near what is shown."""
    low, high = axes.get_ylim()
    spare = _NEAR * (high - low)
    for bound in bounds:
        if low - spare <= bound <= high + spare:
            axes.axhline(bound, color=coordinate_colour(joint - 1), linestyle='--', linewidth=1)
            axes.plot([], [], '--', color=ASIDE, label='limits on the way')


def name_region(one: KeepOut) -> str:
    """Return the name of a region for a legend."""
    return plain(one.name) or 'kept free'
