"""The picture of an arm: postures, the shapes its links bend in, and its natural modes."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points
from flex_planner.base.colours import ARM, coordinate_colour, FLEXIBLE
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.plotting.figures import explain_lines, finish, Picture, plain
from flex_planner.plotting.posture import draw_posture
from flex_planner.plotting.spatial_arm import draw_spatial_arm
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
import numpy as np

_NATURAL_MODES = 4
_STATIONS = 81
_SHOWN_BEND = 0.1
_MILLI = 1e3
_WIDTH, _HEIGHT, _LEGEND_COLUMNS = 5, 4, 8


def draw_arm(model: ArmModel, postures: Sequence[Array], payload_mass: float = 0.0) -> Picture:
    """
    Draw an arm.

    It shows the arm at rest in each posture; the assumed shapes of each flexible link; and the
    natural modes in the last posture with joints locked, if anything bends or twists. A spatial
    arm is drawn in three dimensions, without the shapes.

    Parameters
    ----------
    model : ArmModel
        n joints.
    postures : sequence of numpy.ndarray, shape (n,)
        Joint angles, at least one [rad]; ways of joints that slide [m].
    payload_mass : float
        At its tip [kg].

    Returns
    -------
    Picture
        A Matplotlib figure.

    """
    arm = model.arm
    if arm.dimension == 3:
        return draw_spatial_arm(model, postures, payload_mass)
    parameters = Parameters.of(arm, payload_mass=payload_mass)
    flexible = [i for i, link in enumerate(arm.links) if link.modes]
    shown = min(arm.n_passive, _NATURAL_MODES)
    counts = [count for count in (len(postures), len(flexible), shown) if count]
    figure = Picture(_WIDTH * max(counts), _HEIGHT * len(counts))
    rows = iter(np.atleast_1d(figure.subfigures(len(counts), 1)))
    first = next(rows)
    for axes, posture in zip(_row(first, len(postures)), postures, strict=True):
        rest, _ = equilibrium(model, posture, parameters)
        draw_posture(axes, arm, rest, payload_mass)
    explain_lines(first, first.axes, _LEGEND_COLUMNS)
    if flexible:
        for axes, i in zip(_row(next(rows), len(flexible)), flexible, strict=True):
            _draw_link_shapes(axes, arm, i)
    if shown:
        frequencies, vectors = natural_modes(model, rest, parameters, locked=True)
        for k, axes in enumerate(_row(next(rows), shown)):
            _draw_natural_mode(axes, arm, rest, vectors[:, k], frequencies[k])
    figure.suptitle(f'{plain(arm.name)}, payload {payload_mass:g} kg')
    return figure


def _row(part: FigureBase, count: int) -> Sequence[Axes]:
    """Return diagrams beside one another."""
    return list(np.atleast_1d(part.subplots(1, count)))


def _draw_link_shapes(axes: Axes, arm: Arm, index: int) -> None:
    """Draw the assumed mode shapes of one link."""
    link = arm.links[index]
    x = np.linspace(0, link.length, _STATIONS, dtype=float)
    first = arm.modal_slices[index].start
    for j, shape in enumerate(link.mode_shapes().shape(x).T, 1):
        axes.plot(x, shape, color=coordinate_colour(first + j - 1), label=f'mode {j}')
    ends = np.cumsum([0.0, *(one.share for one in link.sections)]) * link.length
    for section, first, last in zip(link.sections, ends[:-1], ends[1:], strict=True):
        if np.isinf(section.rigidity):
            axes.axvspan(first, last, color='0.9', zorder=0)
    finish(axes, f'link {index + 1}: assumed shapes, {link.mode_family}',
           'deflection [mm per mm of displacement]', 'along the link [m]')


def _draw_natural_mode(axes: Axes, arm: Arm, rest: Array, vector: Array,
                       frequency: float) -> None:
    """Draw the arm bent to both sides in a natural mode, enlarged."""
    change = np.concatenate([np.zeros(arm.n_joints), vector])
    still = link_points(arm, rest, _STATIONS).reshape(-1, 2)
    moved = link_points(arm, rest + 1e-6 * change, _STATIONS).reshape(-1, 2)
    largest = _SHOWN_BEND * arm.reach
    bend = (moved - still) / np.linalg.norm(moved - still, axis=1).max() * largest
    axes.plot(*still.T, color=ARM, linewidth=2)
    for side, style in ((1, '-'), (-1, '--')):
        axes.plot(*(still + side * bend).T, style, color=FLEXIBLE)
    axes.set_aspect('equal', adjustable='datalim')
    finish(axes, f'natural mode, {frequency / (2 * np.pi):.4g} Hz, joints locked\n'
           f'drawn with {largest * _MILLI:.3g} mm where it moves most', 'y [m]', 'x [m]')
