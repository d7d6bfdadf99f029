"""A task carried out as planned with flexible and with rigid links."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flex_planner.base.colours import ASIDE
from flex_planner.base.validation import Array
from flex_planner.plotting.curves import limits_beside
from flex_planner.plotting.diagrams import MODE_COLOURS, OPEN_LOOP
from flex_planner.plotting.figures import finish, Picture, plain, say
from flex_planner.simulation.comparison import Comparison
from flex_planner.simulation.execution import ExecutionMode, ExecutionResult
from matplotlib.axes import Axes
import numpy as np

_MILLI = 1e3
# dashes lie upon wide pale lines of their colour, so that both are seen where they coincide
_DASHED: Mapping[str, Any] = {'linestyle': (0, (4, 3)), 'linewidth': 1.2, 'zorder': 2.5}
_FULL: Mapping[str, Any] = {'linestyle': '-', 'linewidth': 2.4, 'alpha': 0.6}
# of the tip's distance from the goal: less is rounding and sampling
_FLOOR = 1e-4  # [mm]
_LEAST_TORQUE = 1e-3  # [N m]
_MARGIN = 0.15
_POINTS = 201


def draw_comparison(comparison: Comparison) -> Picture:
    """
    Draw a comparison.

    Parameters
    ----------
    comparison : Comparison
        One line per result. Above: the distance of the tip from the goal after its
        arrival, and its path there. Below: the torques.

    Returns
    -------
    Picture
        A Matplotlib figure.

    """
    n = comparison.flexible.arm.n_joints
    figure = Picture(14, 10)
    above, below = figure.subfigures(2, 1, height_ratios=[1.25, 1])
    distance, path_axes = above.subplots(1, 2, width_ratios=[1.3, 1])
    if comparison.goal.size == 3:
        path_axes.remove()
        path_axes = above.add_subplot(1, 2, 2, projection='3d')
    torques = np.atleast_1d(below.subplots(1, n, sharey=True))
    results = comparison.results
    _draw_distance(distance, comparison)
    _draw_paths(path_axes, comparison)
    for joint, axes in enumerate(torques):
        _draw_torques(axes, comparison, joint)
    if results:
        handles, labels = distance.get_legend_handles_labels()
        figure.legend(handles, labels, loc='outside lower center', ncols=len(results))
    figure.suptitle(f'{plain(comparison.flexible.arm.name)}: one task, planned and carried out in '
                    f'{len(results)} modes')
    return figure


def _draw_distance(axes: Axes, comparison: Comparison) -> None:
    """Draw the distance of the tip from the goal, from the arrival on."""
    for result in comparison.results:
        times, tip = _after_arrival(result)
        distance = np.linalg.norm(tip - comparison.goal, axis=1) * _MILLI
        axes.semilogy(times, np.maximum(distance, _FLOOR), label=result.mode.value,
                      **_style(result))
    if not comparison.results:
        say(axes, 'neither plan was solved')
    axes.set(title=f'distance of the tip from the goal (below {_FLOOR:g} mm drawn there)',
             xlabel='time after arrival [s]', ylabel='distance [mm]')
    axes.grid(alpha=0.3)


def _draw_paths(axes: Any, comparison: Comparison) -> None:
    """Draw the path of the tip near the goal, from the arrival on."""
    near = [result for result in comparison.results if result.mode is not ExecutionMode.PD_ONLY]
    reach = 0.0
    for result in comparison.results:
        path = (_after_arrival(result)[1] - comparison.goal) * _MILLI
        axes.plot(*path.T, **_style(result))
        axes.plot(*path[:1].T, 'o', color=MODE_COLOURS[result.mode], markersize=5)
        if result in near:
            reach = max(reach, float(np.abs(path).max()))
    size = comparison.goal.size
    axes.plot(*np.zeros((size, 1)), '+', color='black', markersize=14, label='goal')
    axes.plot(*np.zeros((size, 0)), 'o', color=ASIDE, markersize=5, label='on arrival')
    if reach:
        limit = reach * (1 + _MARGIN)
        axes.set(**{f'{name}lim': (-limit, limit) for name in 'xyz'[:size]})
    if size == 3:
        axes.set_box_aspect((1, 1, 1))
        axes.set_zlabel('z [mm]')
    else:
        axes.set_aspect('equal', adjustable='box')
    finish(axes, 'path of the tip after arrival, from the goal', 'y [mm]', 'x [mm]')


def _draw_torques(axes: Axes, comparison: Comparison, joint: int) -> None:
    """Draw the torques of a joint's motor, and its bounds at the speeds of the plan."""
    results = comparison.results
    for result in results:
        execution = result.execution
        axes.plot(execution.times, execution.torques[:, joint], **_style(result))
    for arrival in sorted({result.arrival for result in results}):
        axes.axvline(arrival, color=ASIDE, linestyle=':', label='planned arrival')
    if comparison.flexible.solved:
        _draw_bounds(axes, comparison, joint)
    finish(axes, f'torque of joint {joint + 1}', 'torque [N m]')


def _draw_bounds(axes: Axes, comparison: Comparison, joint: int) -> None:
    """Draw the bounds of a motor as far as they are near its torques."""
    planned = comparison.flexible.uniform_samples(_POINTS)
    bounds = np.array([planned.lower_bounds[:, joint], planned.upper_bounds[:, joint]])
    torques = np.concatenate([one.execution.torques.ravel() for one in comparison.results]
                             or [planned.torques.ravel()])
    low, high = limits_beside(torques, bounds, _LEAST_TORQUE)
    if np.isfinite(bounds).all():
        label = 'bounds at the planned speeds'
        if bounds.min() < low or bounds.max() > high:
            label += f', {bounds.min():.3g} to {bounds.max():.3g} N m'
        axes.plot(planned.times, bounds.T, ':', color='black', linewidth=0.9, label=[label, None])
    axes.set_ylim(low, high)


def _style(result: ExecutionResult) -> dict[str, Any]:
    """Return how the lines of a mode of execution are drawn."""
    return {'color': MODE_COLOURS[result.mode], **(_DASHED if result.mode in OPEN_LOOP else _FULL)}


def _after_arrival(result: ExecutionResult) -> tuple[Array, Array]:
    """Return times since the arrival, and the tip."""
    times = result.execution.times - result.arrival
    after = times >= -1e-9
    return times[after], result.execution.tip[after]
