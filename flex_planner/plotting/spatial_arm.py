"""The picture of a spatial arm: at rest in some postures, and its natural modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint_units import units_of
from flex_planner.arms.kinematics import link_points, payload_position
from flex_planner.base.colours import ARM, COORDINATES, FLEXIBLE, PLANNED
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.plotting.figures import explain_lines, Picture, plain
from flex_planner.plotting.spatial_motion import show_space
from matplotlib.figure import FigureBase
import numpy as np

_NATURAL_MODES, _STATIONS = 4, 41
_SHOWN_BEND, _ARROW = 0.1, 0.15  # of the reach
_MILLI, _SIDE, _LEGEND_COLUMNS = 1e3, 4.6, 8
_SMALL_CHANGE = 1e-6
# no layout of Matplotlib knows how far the numbers at axes of space reach
_ZOOM, _AWAY, _NUMBERS = 0.88, 8, 5


def draw_spatial_arm(model: ArmModel, postures: Sequence[Array], payload_mass: float) -> Picture:
    """
    Draw a spatial arm at rest in each posture, and its natural modes in the last one.

    Parameters
    ----------
    model : ArmModel
        Of a spatial arm with n joints.
    postures : sequence of numpy.ndarray, shape (n,)
        Joint coordinates, at least one [rad, m].
    payload_mass : float
        At its tip [kg].

    Returns
    -------
    Picture
        A Matplotlib figure.

    """
    arm, parameters = model.arm, Parameters.of(model.arm, payload_mass=payload_mass)
    shown = min(arm.n_passive, _NATURAL_MODES)
    rows = 1 + bool(shown)
    figure = Picture(_SIDE * max(len(postures), shown), _SIDE * rows)
    first, *others = np.atleast_1d(figure.subfigures(rows, 1))
    for axes, posture in zip(_spaces(first, len(postures)), postures, strict=True):
        rest, _ = equilibrium(model, posture, parameters)
        _draw_rest(axes, arm, rest, payload_mass)
    explain_lines(first, first.axes, _LEGEND_COLUMNS)
    if shown:
        frequencies, vectors = natural_modes(model, rest, parameters, locked=True)
        for k, axes in enumerate(_spaces(others[0], shown)):
            _draw_mode(axes, arm, rest, vectors[:, k], frequencies[k])
    figure.suptitle(f'{plain(arm.name)}, payload {payload_mass:g} kg')
    return figure


def _spaces(part: FigureBase, count: int) -> list[Any]:
    """Return diagrams of space beside one another."""
    return list(np.ravel(part.subplots(1, count, subplot_kw={'projection': '3d'})))


def _show(axes: Any, points: Array) -> None:
    """Show points (k, 3) [m], the names and numbers of the axes within the diagram."""
    show_space(axes, points)
    axes.set_box_aspect((1, 1, 1), zoom=_ZOOM)
    axes.locator_params(nbins=_NUMBERS)
    axes.zaxis.labelpad = _AWAY


def _draw_rest(axes: Any, arm: Arm, rest: Array, payload_mass: float) -> None:
    """Draw the arm as gravity bends it, with the shape that it would have without."""
    n = arm.n_joints
    points = link_points(arm, rest, _STATIONS)
    if rest[n:].any():
        unbent = np.concatenate([rest[:n], np.zeros(arm.n_passive)])
        axes.plot(*link_points(arm, unbent).reshape(-1, 3).T, color=ARM, linestyle='--',
                  label='without gravity')
    for link, curve in zip(arm.links, points, strict=True):
        axes.plot(*curve.T, color=FLEXIBLE if link.modes else '0.35',
                  linewidth=2 if link.modes else 4,
                  label='flexible' if link.modes else 'rigid')
    axes.plot(*points[:, 0].T, 'o', color='black', markersize=5, markerfacecolor='white',
              label='joint')
    carried = payload_position(arm, rest)
    if payload_mass:
        axes.plot(*carried[:, None], 'o', color=PLANNED, label='payload')
    shown = [points.reshape(-1, 3), carried[None], _draw_gravity(axes, arm, points[0, 0])]
    _show(axes, np.concatenate(shown))
    units = [units_of(joint) for joint in arm.joints]
    values = ', '.join(f'{unit.scale * value:.4g}'
                       for unit, value in zip(units, rest[:n], strict=True))
    names = ', '.join(dict.fromkeys(unit.position for unit in units))
    axes.set_title(f'at ({values}) {names}', fontsize='medium')


def _draw_gravity(axes: Any, arm: Arm, base: Array) -> Array:
    """Draw the direction of gravity from the base; return both ends of the line (2, 3)."""
    size = float(np.linalg.norm(arm.gravity))
    if not size:
        return base[None]
    line = np.stack([base, base + _ARROW * arm.reach * arm.gravity / size])
    axes.plot(*line.T, color=COORDINATES[3], label='gravity')
    return line


def _draw_mode(axes: Any, arm: Arm, rest: Array, vector: Array, frequency: float) -> None:
    """Draw the arm bent to both sides in a natural mode, enlarged."""
    change = _SMALL_CHANGE * np.concatenate([np.zeros(arm.n_joints), vector])
    still, moved = (link_points(arm, q, _STATIONS).reshape(-1, 3) for q in (rest, rest + change))
    moves, largest = moved - still, _SHOWN_BEND * arm.reach
    size = float(np.linalg.norm(moves, axis=1).max())
    # twisting moves no point of a link's axis
    bend = moves / size * largest if size > _SMALL_CHANGE * 1e-6 * np.abs(vector).max() else moves
    axes.plot(*still.T, color=ARM, linewidth=2)
    for side, style in ((1, '-'), (-1, '--')):
        axes.plot(*(still + side * bend).T, style, color=FLEXIBLE)
    _show(axes, np.concatenate([still, still + bend, still - bend]))
    axes.set_title(f'natural mode, {frequency / (2 * np.pi):.4g} Hz, joints locked\n'
                   f'drawn with {largest * _MILLI:.3g} mm where it moves most',
                   fontsize='medium')
