"""Limits on the way and via points in the plots of a report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flex_planner.arms.joint_units import position_scales
from flex_planner.base.colours import coordinate_colour, REFUSED, VIA
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import JointRange, JointSpeed
from flex_planner.planning.region_outlines import find_keep_outs, outline_region
from flex_planner.planning.spatial_outlines import outline_in_space
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
from flex_planner.reports.recording.plot_data import Bands, Plot, Series
from flex_planner.reports.recording.way_limits import find_active_limits
import numpy as np

_OVER_TIME = 'time'


def add_limits(request: RecordedRequest, motion: RecordedMotion,
               plots: Sequence[Plot]) -> list[Plot]:
    """
    Return plots of a motion with its limits on the way and its via points.

    Times at which a limit is active are marked in all plots over time, bounds of angles and speeds
    are lines, regions that are kept free are shaded beside the path of the tip.

    """
    added = {'positions': [*_angle_bounds(request, motion), *_passed_angles(request, motion)],
             'speeds': _speed_bounds(request, motion),
             'tip': [*_regions(request), *_passed_points(request, motion, (0, 1))]}
    if motion.tip.shape[1] == 3:
        added |= {f'tip_{"xyz"[i]}{"xyz"[j]}': [*_lines(request, (i, j)), *_passed_points(
            request, motion, (i, j))] for i, j in ((0, 1), (0, 2), (1, 2))}
    bands = _active_bands(request, motion)
    return [replace(plot, series=[*plot.series, *added.get(plot.key, [])],
                    bands=bands if plot.group == _OVER_TIME else plot.bands) for plot in plots]


def _active_bands(request: RecordedRequest, motion: RecordedMotion) -> Bands | None:
    """Return when limits are active; None if none ever is."""
    found = [(name, [first, last]) for name, spans in find_active_limits(request, motion)
             for first, last in spans]
    if not found:
        return None
    return Bands(name='at a limit on the way', labels=[name for name, _ in found],
                 ranges=[span for _, span in found])


def _angle_bounds(request: RecordedRequest, motion: RecordedMotion) -> list[Series]:
    """Return the finite limits of joint angles [deg], or of ways [mm]."""
    scales = position_scales(request.arm)
    return [_bound(request, motion, one.joint, name, float(scales[one.joint - 1] * angle))
            for one in request.path_constraints if isinstance(one, JointRange)
            for name, angle in (('lower limit', one.lower), ('upper limit', one.upper))
            if np.isfinite(angle)]


def _speed_bounds(request: RecordedRequest, motion: RecordedMotion) -> list[Series]:
    """Return the limits of joint speeds in both directions [rad/s]."""
    return [_bound(request, motion, one.joint, name, speed)
            for one in request.path_constraints if isinstance(one, JointSpeed)
            for name, speed in (('limit', one.limit), ('limit backwards', -one.limit))]


def _bound(request: RecordedRequest, motion: RecordedMotion, joint: int, name: str,
           value: float) -> Series:
    """Return a bound of a joint, counted from 1, as a line."""
    return Series(name=f'{request.joint_names[joint - 1]} {name}', x=motion.times,
                  y=np.full(motion.times.size, value), dashed=True, bound=True,
                  colour=coordinate_colour(joint - 1))


def _regions(request: RecordedRequest) -> list[Series]:
    """Return the outlines of regions that are kept free [m]."""
    drawn = []
    for one in find_keep_outs(request.path_constraints):
        if one.region.dimension == 3:
            continue
        corners = outline_region(one.region, request.arm.reach)
        drawn.append(Series(name=one.name or 'kept free', x=corners[:, 0], y=corners[:, 1],
                            colour=REFUSED, bound=True, filled=True))
    return drawn


def _lines(request: RecordedRequest, sides: tuple[int, int]) -> list[Series]:
    """Return the outlines of regions in space as seen along one of the axes [m]."""
    return [Series(name=one.name or 'kept free', x=line[:, sides[0]], y=line[:, sides[1]],
                   colour=REFUSED, bound=True)
            for one in find_keep_outs(request.path_constraints)
            for line in outline_in_space(one.region, request.arm.reach)]


def find_via_times(request: RecordedRequest, motion: RecordedMotion) -> Array:
    """Return when via points are passed, as the samples count; older recordings have none [s]."""
    passed: Array = motion.begin + np.asarray(getattr(request.report, 'via_times', ()),
                                              dtype=np.float64)
    return passed


def _passed_points(request: RecordedRequest, motion: RecordedMotion,
                   sides: tuple[int, int]) -> list[Series]:
    """Return two of the tip's coordinates at via points."""
    times = find_via_times(request, motion)
    x, y = (np.interp(times, motion.times, column) for column in motion.tip[:, sides].T)
    return [Series(name='via points', x=x, y=y, colour=VIA, dots=True)] if times.size else []


def _passed_angles(request: RecordedRequest, motion: RecordedMotion) -> list[Series]:
    """Return the joint angles at via points [deg], or ways [mm]."""
    times, scales = find_via_times(request, motion), position_scales(request.arm)
    return [Series(name=f'{name} at via points', x=times, dots=True, colour=coordinate_colour(i),
                   y=scales[i] * np.interp(times, motion.times, motion.coordinates[:, i]))
            for i, name in enumerate(request.joint_names)] if times.size else []
