"""A motion as it was planned, and as it was carried out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points
from flex_planner.base.validation import Array
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.plan import Samples
from flex_planner.plotting.figures import finish, plain, save, say
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

_MILLI = 1e3
_POSTURES = 6


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
        [N m]; the last may be what holds the arm and is not drawn.
    tip : numpy.ndarray, shape (k, 2)
        [m].

    """

    times: Array
    coordinates: Array
    rates: Array
    torques: Array
    tip: Array

    @classmethod
    def of(cls, samples: Samples) -> Motion:
        """Return a sampled plan."""
        return cls(times=samples.times, coordinates=samples.coordinates, rates=samples.rates,
                   torques=samples.torques, tip=samples.tip)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Execution:
    """
    The motion of the arm as carried out.

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
    draw_torques(axes[0, 2], arm, joint_names, motion, execution)
    draw_tip(axes[1, 0], arm, motion, execution)
    _draw_modes(axes[1, 1], arm, motion)
    _draw_distance(axes[1, 2], motion, execution)
    figure.suptitle(plain(arm.name))
    save(figure, path)


def _draw_joints(axes: Axes, title: str, label: str, names: Sequence[str], times: Array,
                 values: Array, done: tuple[Array, Array] | None) -> None:
    """Draw one line per joint, and the simulated motion."""
    for i, name in enumerate(map(plain, names)):
        axes.plot(times, values[:, i], color=f'C{i}', label=name)
        if done is not None:
            axes.plot(done[0], done[1][:, i], '--', color=f'C{i}', alpha=0.6,
                      label=f'{name}, simulated')
    finish(axes, title, label)


def draw_torques(axes: Axes, arm: Arm, joint_names: Sequence[str], motion: Motion,
                 execution: Execution | None = None) -> None:
    """Draw the torques between their bounds."""
    _draw_joints(axes, 'motor torques and their bounds', 'torque [N m]', joint_names,
                 motion.times[:-1], motion.torques[:-1],
                 (execution.times, execution.torques) if execution else None)
    _draw_bounds(axes, arm, motion)


def _draw_bounds(axes: Axes, arm: Arm, motion: Motion) -> None:
    """Draw the bounds of the torques at the planned speeds."""
    lower, upper = TorqueLimits.of(arm).bounds(motion.rates[:-1, :arm.n_joints])
    for i in range(arm.n_joints):
        if np.isfinite(upper[:, i]).all():
            for bound in (lower, upper):
                axes.plot(motion.times[:-1], bound[:, i], ':', color=f'C{i}', linewidth=1)
    if np.isfinite(upper).any():
        axes.plot([], [], ':', color='gray', label='bounds')
    axes.legend(fontsize='small')


def draw_tip(axes: Axes, arm: Arm, motion: Motion,
             execution: Execution | None = None) -> None:
    """Draw the tip's path, with the arm at some instants."""
    for k in np.linspace(0, motion.times.size - 1, _POSTURES).astype(int):
        points = link_points(arm, motion.coordinates[k], 15).reshape(-1, 2)
        axes.plot(*points.T, color='silver', linewidth=2 if k in (0, motion.times.size - 1) else 1)
    axes.plot(*motion.tip.T, color='C2', label='tip')
    if execution is not None:
        axes.plot(*execution.tip.T, '--', color='C3', label='tip, simulated')
    axes.plot(*motion.tip[0], 'o', color='C2', label='start')
    axes.plot(*motion.tip[-1], 's', color='C2', label='goal')
    axes.set_aspect('equal', adjustable='datalim')
    finish(axes, 'path of the tip', 'y [m]', 'x [m]')


def _draw_modes(axes: Axes, arm: Arm, motion: Motion) -> None:
    """Draw the modal displacements."""
    for j, name in enumerate(arm.passive_names):
        axes.plot(motion.times, motion.coordinates[:, arm.n_joints + j] * _MILLI,
                  label=name.replace('_', ', '))
    if not arm.n_modes:
        say(axes, 'rigid links')
    finish(axes, 'modal displacements, as planned', 'displacement [mm]')


def _draw_distance(axes: Axes, motion: Motion, execution: Execution | None) -> None:
    """Draw the distance of the tip from the goal; also after the arrival, if known."""
    tip = motion.tip if execution is None else execution.tip
    distance = np.linalg.norm(tip - motion.tip[-1], axis=1) * _MILLI
    if execution is None:
        axes.plot(motion.times, distance, color='C2')
        finish(axes, 'distance of the tip from the goal, as planned', 'distance [mm]')
        return
    axes.semilogy(execution.tip_times, np.maximum(distance, 1e-6), color='C3',
                  label='distance to the goal')
    axes.axvline(motion.times[-1], color='gray', linestyle=':', label='planned arrival')
    finish(axes, 'simulated tip', 'distance [mm]')
