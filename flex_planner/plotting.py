"""Pictures of planned motions, of how they were carried out, and of the arm's modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flex_planner.arm import Arm
from flex_planner.kinematics import link_points
from flex_planner.model import ArmModel, Parameters
from flex_planner.statics import equilibrium, natural_modes
from flex_planner.validation import Array
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

_MILLI = 1e3
_POSTURES = 6
_NATURAL_MODES = 4
_STATIONS = 81
_SHOWN_BEND = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """
    A planned motion as arrays.

    Attributes
    ----------
    times : numpy.ndarray, shape (k,)
        [s].
    coordinates, rates : numpy.ndarray, shape (k, n_t)
        Joints [rad], then modes [m], and their rates.
    torques : numpy.ndarray, shape (k, n)
        [N m].
    tip : numpy.ndarray, shape (k, 2)
        [m].

    """

    times: Array
    coordinates: Array
    rates: Array
    torques: Array
    tip: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Execution:
    """
    What the arm did.

    Attributes
    ----------
    times : numpy.ndarray, shape (k,)
        Since the motion began [s].
    positions, speeds, torques : numpy.ndarray, shape (k, n)
        [rad], [rad/s], [N m].
    tip_times : numpy.ndarray, shape (j,)
        [s].
    tip : numpy.ndarray, shape (j, 2)
        [m].

    """

    times: Array
    positions: Array
    speeds: Array
    torques: Array
    tip_times: Array
    tip: Array


def draw_motion(path: Path, arm: Arm, joint_names: Sequence[str], motion: Motion,
                execution: Execution | None = None) -> None:
    """
    Write a picture of a motion as PNG.

    Parameters
    ----------
    path : Path
        File to write.
    arm : Arm
        n joints.
    joint_names : sequence of str
        For the legends.
    motion : Motion
        As planned: full lines.
    execution : Execution, optional
        As carried out: dashed lines.

    """
    figure = Figure(figsize=(15, 8.5), layout='constrained')
    axes = figure.subplots(2, 3)
    n = arm.n_joints
    done = execution
    _draw_joints(axes[0, 0], 'joint positions', 'angle [deg]', joint_names, motion.times,
                 np.degrees(motion.coordinates[:, :n]),
                 (done.times, np.degrees(done.positions)) if done else None)
    _draw_joints(axes[0, 1], 'joint speeds', 'speed [rad/s]', joint_names, motion.times,
                 motion.rates[:, :n], (done.times, done.speeds) if done else None)
    _draw_joints(axes[0, 2], 'motor torques and their bounds', 'torque [N m]', joint_names,
                 motion.times[:-1], motion.torques[:-1],
                 (done.times, done.torques) if done else None)
    _draw_bounds(axes[0, 2], arm, motion)
    _draw_tip(axes[1, 0], arm, motion, execution)
    _draw_modes(axes[1, 1], arm, motion)
    _draw_tip_error(axes[1, 2], motion, execution)
    figure.suptitle(arm.name)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)


def draw_mode_shapes(path: Path, model: ArmModel, posture: Array, payload_mass: float) -> None:
    """
    Write a picture of the assumed shapes of each link and of the arm's natural modes as PNG.

    Parameters
    ----------
    path : Path
        File to write.
    model : ArmModel
        n joints, at least one link with modes.
    posture : numpy.ndarray, shape (n,)
        Of the arm whose natural modes are drawn, joints locked [rad].
    payload_mass : float
        At its tip [kg].

    """
    arm = model.arm
    parameters = Parameters.of(arm, payload_mass=payload_mass)
    rest, _ = equilibrium(model, posture, parameters)
    frequencies, vectors = natural_modes(model, rest, parameters, locked=True)
    flexible = [i for i, link in enumerate(arm.links) if link.modes]
    shown = min(frequencies.size, _NATURAL_MODES)
    figure = Figure(figsize=(5 * max(len(flexible), shown), 8), layout='constrained')
    top, bottom = figure.subfigures(2, 1)
    for axes, i in zip(np.atleast_1d(top.subplots(1, len(flexible))), flexible, strict=True):
        _draw_link_shapes(axes, arm, i)
    for k, axes in enumerate(np.atleast_1d(bottom.subplots(1, shown))):
        _draw_natural_mode(axes, arm, rest, vectors[:, k], frequencies[k])
    figure.suptitle(f'{arm.name}, payload {payload_mass:g} kg')
    _save(figure, path)


def _draw_link_shapes(axes: Axes, arm: Arm, index: int) -> None:
    """Draw the assumed mode shapes of one link."""
    link = arm.links[index]
    x = np.linspace(0, link.length, _STATIONS, dtype=float)
    for j, shape in enumerate(link.mode_shapes().shape(x).T, 1):
        axes.plot(x, shape, label=f'mode {j}')
    _finish(axes, f'link {index + 1}: assumed shapes, {link.mode_family}',
            'deflection per unit of modal displacement', 'along the link [m]')


def _draw_natural_mode(axes: Axes, arm: Arm, rest: Array, vector: Array,
                       frequency: float) -> None:
    """Draw the arm bent to both sides in a natural mode, enlarged."""
    change = np.concatenate([np.zeros(arm.n_joints), vector])
    still = link_points(arm, rest, _STATIONS).reshape(-1, 2)
    moved = link_points(arm, rest + 1e-6 * change, _STATIONS).reshape(-1, 2)
    bend = (moved - still) / np.abs(moved - still).max() * _SHOWN_BEND * arm.reach
    axes.plot(*still.T, color='silver', linewidth=2)
    for side, style in ((1, '-'), (-1, '--')):
        axes.plot(*(still + side * bend).T, style, color='C0')
    axes.set_aspect('equal', adjustable='datalim')
    _finish(axes, f'natural mode, {frequency / (2 * np.pi):.4g} Hz, joints locked', 'y [m]',
            'x [m]')


def _draw_joints(axes: Axes, title: str, label: str, names: Sequence[str], times: Array,
                 values: Array, done: tuple[Array, Array] | None) -> None:
    """Draw one line a joint, and what was carried out."""
    for i, name in enumerate(names):
        axes.plot(times, values[:, i], color=f'C{i}', label=name)
        if done is not None:
            axes.plot(done[0], done[1][:, i], '--', color=f'C{i}', alpha=0.6,
                      label=f'{name}, simulated')
    _finish(axes, title, label)


def _draw_bounds(axes: Axes, arm: Arm, motion: Motion) -> None:
    """Draw the bounds of the torques at the planned speeds."""
    lower, upper = arm.torque_bounds(motion.rates[:-1, :arm.n_joints])
    for i in range(arm.n_joints):
        if np.isfinite(upper[:, i]).all():
            for bound in (lower, upper):
                axes.plot(motion.times[:-1], bound[:, i], ':', color=f'C{i}', linewidth=1)
    if np.isfinite(upper).any():
        axes.plot([], [], ':', color='gray', label='bounds')
    axes.legend(fontsize='small')


def _draw_tip(axes: Axes, arm: Arm, motion: Motion, execution: Execution | None) -> None:
    """Draw the tip's path with the arm on its way."""
    for k in np.linspace(0, motion.times.size - 1, _POSTURES).astype(int):
        points = link_points(arm, motion.coordinates[k], 15).reshape(-1, 2)
        axes.plot(*points.T, color='silver', linewidth=2 if k in (0, motion.times.size - 1) else 1)
    axes.plot(*motion.tip.T, color='C2', label='tip')
    if execution is not None:
        axes.plot(*execution.tip.T, '--', color='C3', label='tip, simulated')
    axes.plot(*motion.tip[0], 'o', color='C2', label='start')
    axes.plot(*motion.tip[-1], 's', color='C2', label='goal')
    axes.set_aspect('equal', adjustable='datalim')
    _finish(axes, 'path of the tip', 'y [m]', 'x [m]')


def _draw_modes(axes: Axes, arm: Arm, motion: Motion) -> None:
    """Draw the modal displacements."""
    for j, name in enumerate(arm.modal_names):
        axes.plot(motion.times, motion.coordinates[:, arm.n_joints + j] * _MILLI,
                  label=name.replace('_', ', '))
    if not arm.n_modes:
        axes.text(0.5, 0.5, 'rigid links', transform=axes.transAxes, ha='center')
    _finish(axes, 'modal displacements, as planned', 'displacement [mm]')


def _draw_tip_error(axes: Axes, motion: Motion, execution: Execution | None) -> None:
    """Draw the distance of the tip from the goal after arrival."""
    if execution is None:
        axes.set_axis_off()
        return
    distance = np.linalg.norm(execution.tip - motion.tip[-1], axis=1) * _MILLI
    axes.semilogy(execution.tip_times, np.maximum(distance, 1e-6), color='C3',
                  label='distance to the goal')
    axes.axvline(motion.times[-1], color='gray', linestyle=':', label='planned arrival')
    _finish(axes, 'simulated tip', 'distance [mm]')


def _finish(axes: Axes, title: str, y_label: str, x_label: str = 'time [s]') -> None:
    axes.set(title=title, xlabel=x_label, ylabel=y_label)
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize='small')
