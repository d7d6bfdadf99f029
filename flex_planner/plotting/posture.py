"""An arm as it stands: its beams and bodies, motors and masses, and how gravity bends it."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points, payload_position
from flex_planner.base.colours import ARM, COORDINATES, FLEXIBLE
from flex_planner.base.validation import Array
from matplotlib.axes import Axes
import numpy as np

_STATIONS = 201
# areas of marks [points^2]: that of the largest mass, and of what has none
_LARGEST, _SMALLEST = 500.0, 12.0
_ARROW = 0.15


def draw_posture(axes: Axes, arm: Arm, rest: Array, payload_mass: float) -> None:
    """
    Draw an arm at rest, with the shape that it would have without bending.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        To draw in.
    arm : Arm
        n joints, n_t coordinates.
    rest : numpy.ndarray, shape (n_t,)
        q.
    payload_mass : float
        At the tip [kg].

    """
    unbent = rest.copy()
    unbent[arm.n_joints:] = 0.0
    if rest[arm.n_joints:].any():
        axes.plot(*link_points(arm, unbent).reshape(-1, 2).T, color=ARM, linestyle='--',
                  label='without gravity')
    points = link_points(arm, rest, _STATIONS)
    _draw_links(axes, arm, points)
    _draw_masses(axes, arm, points, payload_mass, payload_position(arm, rest))
    axes.plot(*np.vstack([np.zeros(2), points[:-1, -1]]).T, 'o', color='black', markersize=5,
              markerfacecolor='white', label='joint')
    _draw_gravity(axes, arm)
    axes.set_aspect('equal', adjustable='datalim')
    degrees = ', '.join(f'{angle:.4g}' for angle in np.degrees(rest[:arm.n_joints]))
    axes.set(title=f'at ({degrees}) deg', xlabel='x [m]', ylabel='y [m]')
    axes.grid(alpha=0.3)


def _draw_links(axes: Axes, arm: Arm, points: Array) -> None:
    """Draw what bends thin and what does not thick."""
    along = np.linspace(0.0, 1.0, _STATIONS)
    for link, curve in zip(arm.links, points, strict=True):
        axes.plot(*curve.T, color=FLEXIBLE, linewidth=2,
                  label='flexible' if link.modes else None)
        ends = np.cumsum([0.0, *(one.share for one in link.sections)])
        stiff = [along >= 0.0] if not link.modes else [
            (along >= first - 1e-9) & (along <= last + 1e-9)
            for section, first, last in zip(link.sections, ends[:-1], ends[1:], strict=True)
            if np.isinf(section.rigidity)]
        for part in stiff:
            axes.plot(*curve[part].T, color='0.35', linewidth=5, solid_capstyle='butt',
                      label='rigid')


def _draw_masses(axes: Axes, arm: Arm, points: Array, payload_mass: float,
                 payload: Array) -> None:
    """Draw housings, nodes and payload with areas as their masses."""
    ends = np.vstack([np.zeros(2), points[:, -1]])
    kinds = {
        'mass at joint or tip': (COORDINATES[4], [node.mass for node in arm.nodes], ends),
        'housing': (COORDINATES[2], [joint.housing.mass for joint in arm.joints], ends[:-1]),
        'payload': (COORDINATES[6], [payload_mass], payload[None])}
    largest = max(max(masses) for _, masses, _ in kinds.values())
    for name, (color, masses, places) in kinds.items():
        some = np.array(masses) > 0
        if some.any():
            areas = _SMALLEST + _LARGEST * np.array(masses)[some] / largest
            x, y = places[some].T
            axes.scatter(x, y, s=areas, color=color, alpha=0.6, label=name, zorder=3)


def _draw_gravity(axes: Axes, arm: Arm) -> None:
    """Draw the direction of gravity from the base."""
    size = np.linalg.norm(arm.gravity)
    if not size:
        return
    x, y = _ARROW * arm.reach * arm.gravity / size
    axes.annotate('', (x, y), (0.0, 0.0), arrowprops={'arrowstyle': '->', 'color': COORDINATES[3]})
    axes.plot([], [], color=COORDINATES[3], label='gravity')
