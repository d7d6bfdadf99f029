"""A motion in space: the path of the tip in three dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points
from flex_planner.base.colours import ARM, PLANNED, REFUSED
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import PathConstraint
from flex_planner.planning.region_outlines import find_keep_outs
from flex_planner.planning.spatial_outlines import outline_in_space
from flex_planner.plotting.limits import name_region
import numpy as np

_STATIONS, _POSTURES = 21, 6
_LEAST_SIDE = 1e-9


def draw_path_in_space(axes: Any, arm: Arm, coordinates: Array, tip: Array) -> None:
    """
    Draw the path of the tip with the arm at some instants.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.Axes3D
        To draw in.
    arm : Arm
        A spatial one of n_t coordinates.
    coordinates : numpy.ndarray, shape (k, n_t)
        q.
    tip : numpy.ndarray, shape (k, 3)
        [m].

    """
    last = len(tip) - 1
    shown = [tip]
    for k in np.linspace(0, last, _POSTURES).astype(int):
        points = link_points(arm, coordinates[k], _STATIONS).reshape(-1, 3)
        axes.plot(*points.T, color=ARM, linewidth=2.5 if k in (0, last) else 1)
        shown.append(points)
    axes.plot(*tip.T, color=PLANNED, linewidth=1.5, label='tip, planned')
    axes.plot(*tip[:1].T, 'o', color=PLANNED, label='start')
    axes.plot(*tip[-1:].T, 's', color=PLANNED, label='goal')
    show_space(axes, np.concatenate(shown))
    axes.set_title('path of the tip')


def draw_limits_in_space(axes: Any, constraints: Sequence[PathConstraint], extent: float) -> None:
    """
    Draw the regions that are kept free.

    Parameters
    ----------
    axes : mpl_toolkits.mplot3d.Axes3D
        To draw in; what it shows stays as it is.
    constraints : sequence of PathConstraint
        Those that keep no region free are left out.
    extent : float
        Half the side of the squares that stand for half-spaces [m].

    """
    shown = axes.get_w_lims()
    for one in find_keep_outs(constraints):
        for line in outline_in_space(one.region, extent):
            axes.plot(*line.T, color=REFUSED, linewidth=0.8, label=name_region(one))
    for name, limits in zip('xyz', np.reshape(shown, (3, 2)), strict=True):
        getattr(axes, f'set_{name}lim')(*limits)


def show_space(axes: Any, points: Array) -> None:
    """Show points (k, 3) [m] with the same scale in every direction, and name the axes."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, max(float((high - low).max()), _LEAST_SIDE) / 2
    for name, centre in zip('xyz', middle, strict=True):
        getattr(axes, f'set_{name}lim')(centre - half, centre + half)
        getattr(axes, f'set_{name}label')(f'{name} [m]')
    axes.set_box_aspect((1, 1, 1))
