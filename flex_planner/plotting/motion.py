"""A motion as it was planned, and as it was carried out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint_units import label_joints, position_scales
from flex_planner.arms.kinematics import link_points
from flex_planner.arms.planar_only import require_planar
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.colours import ARM, ASIDE, CARRIED_OUT, coordinate_colour, PLANNED
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import limits_of_arm, PathConstraint
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.constraint_margins import ConstraintMargin
from flex_planner.planning.plan import Plan
from flex_planner.plotting.curves import draw_columns, limits_beside, settle_limits
from flex_planner.plotting.figures import explain_lines, finish, Picture, plain, say
from flex_planner.plotting.limits import (
    draw_angle_limits,
    draw_keep_outs,
    draw_speed_limits,
    draw_via_points,
    mark_via_times,
    shade_active,
)
from flex_planner.plotting.spatial_motion import draw_limits_in_space, draw_path_in_space
from matplotlib.axes import Axes
import numpy as np

_MILLI = 1e3
_POSTURES, _STATIONS, _SAMPLES = 6, 15, 2001
_COLUMNS, _FEWER_COLUMNS = 8, 6  # fewer beside names of limits, which are long
# the least heights of diagrams: what is less is rounding, or of no consequence
_LEAST_ANGLE, _LEAST_SPEED = 0.1, 1e-3  # [deg], [rad/s]
_LEAST_TORQUE, _LEAST_BENDING = 1e-3, 1e-2  # [N m], [mm]
_LEAST_DISTANCE = 1e-4  # [mm], lowest on a logarithmic axis
# the planned curve beneath the one that was carried out
_BENEATH: Mapping[str, Any] = {'linewidth': 4.0, 'alpha': 0.3}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """
    A planned motion as arrays.

    Attributes
    ----------
    arm : Arm
        n joints.
    times : numpy.ndarray, shape (k,)
        [s].
    coordinates, rates : numpy.ndarray, shape (k, n_t)
        Joints [rad], then modes [m], and their rates.
    torques : numpy.ndarray, shape (k, n)
        [N m]; the last may be what holds the arm and is not drawn.
    tip : numpy.ndarray, shape (k, 2), or (k, 3) of a spatial arm
        [m].
    joint_names : sequence of str
        For the legends; empty for numbers.
    constraints : tuple of PathConstraint
        Limits on the way, those of the arm included.
    margins : tuple of ConstraintMargin
        How near the motion comes to them.
    via_times : numpy.ndarray, shape (m,)
        When it passes its via points [s].

    """

    arm: Arm
    times: Array
    coordinates: Array
    rates: Array
    torques: Array
    tip: Array
    joint_names: Sequence[str] = ()
    constraints: tuple[PathConstraint, ...] = ()
    margins: tuple[ConstraintMargin, ...] = ()
    via_times: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, plan: Plan, joint_names: Sequence[str] = (), count: int = _SAMPLES) -> Motion:
        """Return the motion of a plan with a solution, at evenly spaced times."""
        samples = plan.uniform_samples(count)
        return cls(arm=plan.arm, times=samples.times, coordinates=samples.coordinates,
                   rates=samples.rates, torques=samples.torques, tip=samples.tip,
                   joint_names=joint_names, margins=plan.constraints, via_times=plan.via_times,
                   constraints=(*limits_of_arm(plan.arm), *plan.task.path_constraints))

    @property
    def names(self) -> list[str]:
        """Return the names of the joints, as Matplotlib shows them."""
        return list(map(plain, self.joint_names or [
            f'joint {i}' for i in range(1, self.arm.n_joints + 1)]))


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


def draw_motion(motion: Motion | Plan, execution: Execution | None = None) -> Picture:
    """
    Draw a motion: joints, torques within their bounds, path of the tip, bending.

    Parameters
    ----------
    motion : Motion or Plan
        As planned: full lines; a plan needs a solution.
    execution : Execution, optional
        As carried out: thin lines upon wide ones.

    Returns
    -------
    Picture
        A Matplotlib figure, for `flex_planner.plotting.save` or a notebook.

    """
    motion = motion if isinstance(motion, Motion) else Motion.of(motion)
    figure = Picture(15, 8.8)
    axes = figure.subplots(2, 3)
    draw_angles(axes[0, 0], motion, execution)
    draw_speeds(axes[0, 1], motion, execution)
    draw_torques(axes[0, 2], motion, execution)
    if isinstance(motion.arm, SpatialArm):
        axes[1, 0].remove()
        axes[1, 0] = figure.add_subplot(2, 3, 4, projection='3d')
        draw_path_in_space(axes[1, 0], motion.arm, motion.coordinates, motion.tip)
        draw_limits_in_space(axes[1, 0], motion.constraints, motion.arm.reach)
        draw_via_points(axes[1, 0], motion.times, motion.tip, motion.via_times)
    else:
        draw_tip(axes[1, 0], motion, execution)
    draw_modes(axes[1, 1], motion)
    draw_distance(axes[1, 2], motion, execution)
    met = any(one.active for one in motion.margins)
    explain_lines(figure, axes.ravel(), _FEWER_COLUMNS if met else _COLUMNS)
    figure.suptitle(plain(motion.arm.name))
    return figure


def draw_angles(axes: Axes, motion: Motion, execution: Execution | None = None) -> None:
    """Draw the joint angles in a diagram."""
    n = motion.arm.n_joints
    scale = position_scales(motion.arm)
    _draw_joints(axes, motion, scale * motion.coordinates[:, :n], execution,
                 scale * execution.positions if execution else None)
    settle_limits(axes, _LEAST_ANGLE)
    draw_angle_limits(axes, motion.constraints, position_scales(motion.arm))
    _mark_way(axes, motion)
    finish(axes, 'joint angles', label_joints(motion.arm, 'angle [deg]', 'way [mm]'))


def draw_speeds(axes: Axes, motion: Motion, execution: Execution | None = None) -> None:
    """Draw the joint speeds in a diagram."""
    _draw_joints(axes, motion, motion.rates[:, :motion.arm.n_joints], execution,
                 execution.speeds if execution else None)
    settle_limits(axes, _LEAST_SPEED)
    draw_speed_limits(axes, motion.constraints)
    _mark_way(axes, motion)
    finish(axes, 'joint speeds', label_joints(motion.arm, 'speed [rad/s]', '[m/s]'))


def draw_torques(axes: Axes, motion: Motion, execution: Execution | None = None) -> None:
    """Draw the torques in a diagram, with those of their bounds that are near."""
    torques = motion.torques[:-1]
    _draw_joints(axes, motion, torques, execution, execution.torques if execution else None)
    n = motion.arm.n_joints
    bounds = np.array(TorqueLimits.of(motion.arm).bounds(motion.rates[:-1, :n]))
    shown = [torques, *([] if execution is None else [execution.torques])]
    low, high = limits_beside(np.concatenate(shown), bounds, _LEAST_TORQUE)
    _draw_bounds(axes, motion, bounds, (low, high))
    axes.set_ylim(low, high)
    _mark_way(axes, motion)
    axes.ticklabel_format(axis='y', useOffset=False)
    finish(axes, 'motor torques and their bounds',
           label_joints(motion.arm, 'torque [N m]', 'force [N]'))


def _mark_way(axes: Axes, motion: Motion) -> None:
    """Mark when limits are active, and when via points are passed, in a diagram over time."""
    shade_active(axes, motion.margins)
    mark_via_times(axes, motion.via_times)


def _draw_joints(axes: Axes, motion: Motion, values: Array, execution: Execution | None,
                 done: Array | None) -> None:
    """Draw one line per joint, and what was carried out upon it."""
    times, names = motion.times[:len(values)], motion.names
    colours = [coordinate_colour(i) for i in range(len(names))]
    if execution is None or done is None:
        draw_columns(axes, times, values, names, colours)
        return
    for i, (name, colour) in enumerate(zip(names, colours, strict=True)):
        axes.plot(times, values[:, i], color=colour, label=f'{name}, planned', **_BENEATH)
    draw_columns(axes, execution.times, done, [f'{name}, simulated' for name in names], colours)


def _draw_bounds(axes: Axes, motion: Motion, bounds: Array, shown: tuple[float, float]) -> None:
    """Draw the bounds (2, k, n) of the torques; say how far those go that are cut off."""
    low, high = shown
    seen = (bounds >= low) & (bounds <= high)
    for i, name in enumerate(motion.names):
        if not np.isfinite(bounds[..., i]).all():
            continue
        for bound in bounds[..., i]:
            axes.plot(motion.times[:-1], bound, ':', color=coordinate_colour(i), linewidth=1.2)
        least, most = bounds[0, :, i].min(), bounds[1, :, i].max()
        if least < low or most > high:
            axes.plot([], [], ':', color=coordinate_colour(i),
                      label=f'bounds of {name}: {least:.3g} to {most:.3g} N m')
    if seen.any():
        axes.plot([], [], ':', color=ASIDE, label='bounds of the torques')


def draw_tip(axes: Axes, motion: Motion, execution: Execution | None = None) -> None:
    """
    Draw the path of the tip in a diagram, with the arm at some instants.

    Raises
    ------
    PlanarOnlyError
        If the arm is a spatial one; see `draw_path_in_space`.

    """
    require_planar(motion.arm, 'diagrams of the plane')
    last = motion.times.size - 1
    draw_keep_outs(axes, motion.constraints, motion.arm.reach)
    for k in np.linspace(0, last, _POSTURES).astype(int):
        points = link_points(motion.arm, motion.coordinates[k], _STATIONS).reshape(-1, 2)
        axes.plot(*points.T, color=ARM, linewidth=2.5 if k in (0, last) else 1)
    beneath: Mapping[str, Any] = {'linewidth': 1.5} if execution is None else _BENEATH
    axes.plot(*motion.tip.T, color=PLANNED, label='tip, planned', **beneath)
    if execution is not None:
        axes.plot(*execution.tip.T, color=CARRIED_OUT, linewidth=1.2, label='tip, simulated')
    draw_via_points(axes, motion.times, motion.tip, motion.via_times)
    axes.plot(*motion.tip[0], 'o', color=PLANNED, label='start')
    axes.plot(*motion.tip[-1], 's', color=PLANNED, label='goal')
    axes.set_aspect('equal', adjustable='datalim')
    finish(axes, 'path of the tip', 'y [m]', 'x [m]')


def draw_modes(axes: Axes, motion: Motion) -> None:
    """Draw the modal displacements, and the twists of elastic joints, in a diagram."""
    arm, n = motion.arm, motion.arm.n_joints
    bending = motion.coordinates[:, n:] * _MILLI
    if arm.n_passive:
        draw_columns(axes, motion.times, bending,
                     [name.replace('_', ', ') for name in arm.passive_names],
                     [coordinate_colour(n + j) for j in range(arm.n_passive)])
        settle_limits(axes, _LEAST_BENDING)
        _mark_way(axes, motion)
    else:
        say(axes, 'rigid links')
    twists = any('twist' in name for name in arm.passive_names)
    finish(axes, 'modal displacements and twists, as planned' if twists
           else 'modal displacements, as planned',
           'displacement [mm, mrad]' if twists else 'displacement [mm]')


def draw_distance(axes: Axes, motion: Motion, execution: Execution | None = None) -> None:
    """Draw the distance of the tip from the goal; also after the arrival, if known."""
    tip = motion.tip if execution is None else execution.tip
    distance = np.linalg.norm(tip - motion.tip[-1], axis=1) * _MILLI
    if execution is None:
        axes.plot(motion.times, distance, color=PLANNED, label='tip, planned')
        settle_limits(axes, _LEAST_BENDING)
        finish(axes, 'distance of the tip from the goal, as planned', 'distance [mm]')
        return
    axes.semilogy(execution.tip_times, np.maximum(distance, _LEAST_DISTANCE), color=CARRIED_OUT,
                  label='tip, simulated')
    axes.axvline(motion.times[-1], color=ASIDE, linestyle=':', label='planned arrival')
    finish(axes, f'simulated tip from the goal (≥ {_LEAST_DISTANCE:g} mm)',
           'distance [mm]')
