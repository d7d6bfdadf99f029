"""The arm of a map over its workspace."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import logging
import math
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import arm_from_plain
from flex_planner.arms.inverse_kinematics import workspace
from flex_planner.arms.kinematics import link_points
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.base.yaml_text import parse_yaml
from flex_planner.maps.axes import Axis
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.end_points import End
from flex_planner.maps.pictures.data import MapAxis, MapData
from flex_planner.maps.pictures.panels import edges
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.study import Study
from flex_planner.maps.study_motion import StudyMotion
from flex_planner.optimal_control.task import Task
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
import numpy as np
from numpy.typing import NDArray
import xarray as xr

_ARM = '#202020'
_TIPS = {'o': '#2f9bff', '*': '#ff5a36'}
_EDGE = 0.05
# of no consequence for postures, but a study wants them
_ACCURACY, _PAYLOAD = 1e-3, 1.0
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """
    The arm of a map over its workspace.

    Attributes
    ----------
    arm : Arm
        n joints.
    given, best : numpy.ndarray, shape (n,)
        The posture at the end of the motion that is given, and at the best of those in the
        plane, if any [rad].
    given_name : str
        ``start`` or ``goal``.
    sides : tuple of int
        The coordinates of points that are shown, to the right and up.

    """

    arm: Arm
    given: Array
    best: Array | None
    given_name: str
    sides: tuple[int, int] = (0, 1)

    def joint_points(self, posture: Array) -> Array:
        """Return the ends of the unbent links in a posture, shape (n + 1, 2) [m]."""
        bent = np.concatenate([posture, np.zeros(self.arm.n_passive)])
        points = link_points(self.arm, bent)
        return np.concatenate([points[:1, 0], points[:, -1]])[:, self.sides]

    @property
    def lines(self) -> list[Array]:
        """Return the arm in all postures that are drawn."""
        return [self.joint_points(posture) for posture in (self.given, self.best)
                if posture is not None]


def study_of(dataset: xr.Dataset) -> Study | None:
    """
    Return the study of a store as far as postures depend on it, if it can be understood.

    It is made of what the store says alone, not of the file of its arm.

    """
    try:
        content = parse_yaml(dataset.attrs['study'])
        arm = arm_from_plain(parse_yaml(dataset.attrs['arm']))
        quantity = Quantity[str(dataset.attrs['quantity']).upper()]
        return Study(
            name=str(dataset.attrs['title']), quantity=quantity, text=dataset.attrs['study'],
            arm=arm,
            axes=tuple(Axis(name=str(name), values=dataset[name].values)
                       for name in dataset['code'].dims),
            motion=StudyMotion(start=_end('start', content, arm), goal=_end('goal', content, arm),
                               elbow=content.get('elbow', -1), payload_mass=_PAYLOAD),
            accuracy=_ACCURACY if quantity.is_searched else math.nan)
    except (FlexPlannerError, KeyError, TypeError, ValueError, AttributeError) as error:
        _log.warning('the arm is not drawn, because the study of the map cannot be read: %s',
                     error)
        return None


def _end(name: str, content: Mapping[str, Any], arm: Arm) -> End:
    """Return the common start or goal of the motions of a study."""
    angles = np.array(content.get(f'{name}_angles', []), dtype=float)
    point = np.array(content.get(name, [np.nan] * arm.dimension), dtype=float)
    return End(name=name, point=point, angles=angles)


def find_scene(data: MapData, plane: tuple[int, int], fixed: Mapping[int, int],
               study: Study) -> Scene | None:
    """Return the arm of a diagram over the workspace, if one of its cells has a task."""
    values, codes = data.cut(plane, fixed)
    known = bool(np.isfinite(values).any())
    best = np.unravel_index(data.best(values), values.shape) if known else None
    hopeful = np.argwhere(~np.isin(codes, (CellCode.UNREACHABLE, CellCode.INVALID)))
    task = _first_task(data, plane, fixed, study, hopeful if best is None else np.array([best]))
    if task is None:
        return None
    ends = {'start': task.start_positions, 'goal': task.goal_positions}
    names = [data.axes[place].name for place in plane]
    moved = names[0][:-2]
    right, up = ('xyz'.index(name[-1]) for name in names)
    given = 'start' if moved == 'goal' else 'goal'
    return Scene(arm=task.arm, given=ends[given], given_name=given,
                 best=ends[moved] if known else None, sides=(right, up))


def _first_task(data: MapData, plane: tuple[int, int], fixed: Mapping[int, int], study: Study,
                cells: NDArray[np.int64]) -> Task | None:
    """Return the task of the first cell of a diagram that has one."""
    for cell in cells:
        place = {**fixed, **dict(zip(plane, cell.tolist(), strict=True))}
        try:
            return study.task(tuple(place[axis] for axis in range(len(data.axes))))
        except FlexPlannerError:
            continue
    return None


def draw_arm(axes: Axes, scene: Scene) -> list[Artist]:
    """Draw the arm, and in the plane how far it reaches; return entries of a legend."""
    entries: list[Artist] = []
    if scene.best is not None:
        other = 'start' if scene.given_name == 'goal' else 'goal'
        entries.append(_posture(axes, scene, scene.best, '*', f'arm at the best {other}', 0.45))
    entries.append(_posture(axes, scene, scene.given, 'o', f'arm at the {scene.given_name}', 1))
    if scene.arm.dimension == 2:
        entries.append(_reach(axes, scene.arm))
    return entries[::-1]


def _reach(axes: Axes, arm: Arm) -> Artist:
    """Draw how near and how far a planar arm reaches; return an entry of a legend."""
    near, far = workspace(arm)
    for radius in {near, far} - {0.0}:
        axes.add_patch(Circle((0, 0), radius, fill=False, color=_ARM, linestyle='--',
                              linewidth=1))
    return Line2D([], [], color=_ARM, linestyle='--', linewidth=1, label='reach of the arm')


def frame(axes: Axes, x: MapAxis, y: MapAxis, scene: Scene | None) -> None:
    """Show all cells and all of the arm, as wide as high."""
    low, high = np.stack([edges(x.values)[[0, -1]], edges(y.values)[[0, -1]]], -1)
    if scene is not None:
        points = np.concatenate(scene.lines)
        margin = _EDGE * scene.arm.reach
        low = np.minimum(low, points.min(0) - margin)
        high = np.maximum(high, points.max(0) + margin)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect('equal', adjustable='box')


def _posture(axes: Axes, scene: Scene, posture: Array, marker: str, label: str,
             alpha: float) -> Artist:
    """Draw the arm in a posture, its tip marked; return an entry of a legend."""
    points = scene.joint_points(posture)
    halo = [withStroke(linewidth=6, foreground='white', alpha=alpha)]
    color = (*to_rgb(_ARM), alpha)
    axes.plot(*points.T, color=color, linewidth=3, path_effects=halo, zorder=4,
              solid_joinstyle='round')
    axes.plot(*points[:-1].T, 'o', color='white', markeredgecolor=_ARM, markersize=6,
              alpha=alpha, zorder=5)
    size = 15 if marker == '*' else 9
    # a start that is the best goal shows both
    order = 7 if marker == 'o' else 6
    axes.plot(*points[-1], marker, color=_TIPS[marker], markeredgecolor='white', markersize=size,
              zorder=order, linestyle='')
    return Line2D([], [], color=color, linewidth=3, label=label, marker=marker,
                  markerfacecolor=_TIPS[marker], markeredgecolor='white', markersize=size)
