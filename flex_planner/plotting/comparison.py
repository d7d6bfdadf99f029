"""A task carried out as planned with flexible and with rigid links."""

from __future__ import annotations

from pathlib import Path

from flex_planner.base.validation import Array
from flex_planner.plotting.figures import finish, plain, save, say
from flex_planner.simulation.comparison import Comparison
from flex_planner.simulation.execution import ExecutionMode, ExecutionResult
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

_MILLI = 1e3
_STYLES = {ExecutionMode.FLEXIBLE_OPEN: ('C0', '--'), ExecutionMode.RIGID_OPEN: ('C3', '--'),
           ExecutionMode.FLEXIBLE: ('C0', '-'), ExecutionMode.RIGID: ('C3', '-'),
           ExecutionMode.PD_ONLY: ('C1', '-')}
# of the tip's distance from the goal: less is rounding and sampling
_FLOOR = 1e-6  # [mm]
_MARGIN = 0.15
_POINTS = 201


def draw_comparison(path: Path, comparison: Comparison) -> None:
    """
    Write a picture of a comparison as PNG.

    Parameters
    ----------
    path : Path
        File to write.
    comparison : Comparison
        One line per result. Above: the distance of the tip from the goal after its
        arrival, and its path there. Below: the torques.

    """
    n = comparison.flexible.arm.n_joints
    figure = Figure(figsize=(14, 10), layout='constrained')
    above, below = figure.subfigures(2, 1, height_ratios=[1.25, 1])
    distance, path_axes = above.subplots(1, 2, width_ratios=[1.3, 1])
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
    save(figure, path)


def _draw_distance(axes: Axes, comparison: Comparison) -> None:
    """Draw the distance of the tip from the goal, from the arrival on."""
    for result in comparison.results:
        color, style = _STYLES[result.mode]
        times, tip = _after_arrival(result)
        distance = np.linalg.norm(tip - comparison.goal, axis=1) * _MILLI
        axes.semilogy(times, np.maximum(distance, _FLOOR), style, color=color, linewidth=1.2,
                      label=result.mode.value)
    if not comparison.results:
        say(axes, 'neither plan was solved')
    axes.set(title='distance of the tip from the goal', xlabel='time after arrival [s]',
             ylabel='distance [mm]')
    axes.grid(alpha=0.3)


def _draw_paths(axes: Axes, comparison: Comparison) -> None:
    """Draw the path of the tip near the goal, from the arrival on."""
    near = [result for result in comparison.results if result.mode is not ExecutionMode.PD_ONLY]
    reach = 0.0
    for result in comparison.results:
        color, style = _STYLES[result.mode]
        path = (_after_arrival(result)[1] - comparison.goal) * _MILLI
        axes.plot(*path.T, style, color=color, linewidth=1)
        axes.plot(*path[0], 'o', color=color, markersize=5)
        if result in near:
            reach = max(reach, float(np.abs(path).max()))
    axes.plot(0, 0, '+', color='black', markersize=14, label='goal')
    axes.plot([], [], 'o', color='gray', markersize=5, label='on arrival')
    if reach:
        limit = reach * (1 + _MARGIN)
        axes.set(xlim=(-limit, limit), ylim=(-limit, limit))
    axes.set_aspect('equal', adjustable='box')
    finish(axes, 'path of the tip after arrival, from the goal', 'y [mm]', 'x [mm]')


def _draw_torques(axes: Axes, comparison: Comparison, joint: int) -> None:
    """Draw the torques of a joint's motor, and its bounds at the speeds of the plan."""
    results = comparison.results
    for result in results:
        color, style = _STYLES[result.mode]
        execution = result.execution
        axes.plot(execution.times, execution.torques[:, joint], style, color=color, linewidth=1)
    for arrival in sorted({result.arrival for result in results}):
        axes.axvline(arrival, color='gray', linestyle=':', label='planned arrival')
    if comparison.flexible.solved:
        planned = comparison.flexible.uniform_samples(_POINTS)
        for label, bound in (('bounds at the planned speeds', planned.lower_bounds[:, joint]),
                             ('', planned.upper_bounds[:, joint])):
            if np.isfinite(bound).all():
                axes.plot(planned.times, bound, ':', color='black', linewidth=0.9,
                          label=label or None)
    finish(axes, f'torque of joint {joint + 1}', 'torque [N m]')


def _after_arrival(result: ExecutionResult) -> tuple[Array, Array]:
    """Return times since the arrival, and the tip."""
    times = result.execution.times - result.arrival
    after = times >= -1e-9
    return times[after], result.execution.tip[after]
