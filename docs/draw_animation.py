"""
Draw the animated picture of README.md: one motion planned twice, carried out in a simulation.

The desk arm makes the same motion under the same joint controller, once by a plan that takes its
links as rigid and once by one that knows how they bend.

    tools/run python docs/draw_animation.py

"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flex_planner import load_arm, Task
from flex_planner.arms.kinematics import link_points
from flex_planner.base.validation import Array
from flex_planner.plotting import backend  # noqa: F401 - loads Matplotlib without a window
from flex_planner.simulation.comparison import compare, Comparison
from flex_planner.simulation.execution import ExecutionMode
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

PICTURE = Path(__file__).parent / 'images' / 'flexible_arm.gif'
SETTLING = 1.5  # [s] after the arrival
RATE = 20  # pictures per second; browsers show it in real time
ZOOM = 0.045  # [m] around the goal
FARTHEST = 60.0  # [mm] of the curves
SIDES = {'planned with rigid links': (ExecutionMode.RIGID, '#c44e52'),
         'planned with flexible links': (ExecutionMode.FLEXIBLE, '#2a7fb8')}


def simulate() -> Comparison:
    """Plan the motion with both models and carry it out on the flexible arm."""
    task = Task(arm=load_arm('desk_arm'), start_positions=np.radians([-90, 30]),
                goal_positions=np.radians([0, 60]), duration=1.0, payload_mass=0.3)
    return compare(task, settling=SETTLING)


class Side:
    """One of the two arms: the whole of it, its tip near the goal, and how far that is away."""

    def __init__(self, views: Sequence[Axes], title: str, color: str, comparison: Comparison,
                 mode: ExecutionMode) -> None:
        whole, near, distance = views
        self._arm, self._motion = comparison.arm, comparison.of(mode).execution
        self._far = 1e3 * np.linalg.norm(self._motion.tip - comparison.goal, axis=1)
        whole.set_title(title, color=color, fontsize=11, fontweight='bold')
        self._links, = whole.plot([], [], color=color, linewidth=4, solid_capstyle='round')
        self._joints, = whole.plot([], [], 'o', color='#333333', markersize=6)
        self._trail, = near.plot([], [], color=color, linewidth=1)
        self._tip, = near.plot([], [], 'o', color=color, markersize=7)
        self._curve, = distance.plot([], [], color=color, linewidth=1.5)
        x, y = comparison.goal
        _frame(whole, (-0.45, 1.15), (-1.2, 0.7), comparison.goal)
        _frame(near, (x - ZOOM, x + ZOOM), (y - ZOOM, y + ZOOM), comparison.goal)
        near.set_title(f'tip and goal, {2e3 * ZOOM:.0f} mm wide', fontsize=8, pad=3)
        distance.set(xlim=(0, self._motion.times[-1]), ylim=(0, FARTHEST))
        distance.set_title('mm from the goal, over s', fontsize=8, pad=3)
        distance.tick_params(labelsize=7)

    def draw(self, time: float) -> None:
        """Show the arm at a time [s]."""
        end = int(np.searchsorted(self._motion.times, time, side='right'))
        points = link_points(self._arm, self._motion.coordinates[end - 1], stations=12)
        self._links.set_data(*np.concatenate(list(points)).T)
        self._joints.set_data(*points[:, 0].T)
        self._trail.set_data(*self._motion.tip[:end:5].T)
        self._tip.set_data(*self._motion.tip[end - 1, :, None])
        self._curve.set_data(self._motion.times[:end:5], self._far[:end:5])


def _frame(axes: Axes, x: tuple[float, float], y: tuple[float, float], goal: Array) -> None:
    """Set the borders of a view, and mark the goal."""
    axes.set(xlim=x, ylim=y, xticks=[], yticks=[], aspect='equal')
    axes.plot(*goal, '+', color='black', markersize=12, zorder=0)


def animate(comparison: Comparison, path: Path) -> None:
    """Write the picture."""
    figure = Figure(figsize=(7.2, 5.6), dpi=80)
    grid = figure.add_gridspec(2, 4, height_ratios=[2.6, 1], width_ratios=[1, 1.3, 1, 1.3],
                               left=0.02, right=0.98, bottom=0.1, top=0.94, hspace=0.12)
    sides = []
    for i, (title, (mode, color)) in enumerate(SIDES.items()):
        views = [figure.add_subplot(grid[place]) for place in (
            (0, slice(2 * i, 2 * i + 2)), (1, 2 * i), (1, 2 * i + 1))]
        sides.append(Side(views, title, color, comparison, mode))
    clock = figure.text(0.5, 0.02, '', ha='center', fontsize=9)
    duration = comparison.flexible.task.duration

    def draw(index: int) -> Sequence[Artist]:
        time = index / RATE
        for side in sides:
            side.draw(time)
        clock.set_text(f'simulated: the same arm, payload and controller; {time:.2f} s'
                       + (', arrived' if time >= duration else ''))
        return ()

    frames = round((duration + SETTLING) * RATE) + 1
    FuncAnimation(figure, draw, frames=frames).save(path, writer=PillowWriter(fps=RATE))


if __name__ == '__main__':
    animate(simulate(), PICTURE)
    print(f'{PICTURE}: {PICTURE.stat().st_size / 1e3:.0f} kB')
