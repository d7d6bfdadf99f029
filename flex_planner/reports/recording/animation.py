"""The moving arm of a report, as data for scripts: links as they bend, at even times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points, payload_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.colours import ARM, FLEXIBLE, PLANNED, REFUSED
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import PathConstraint
from flex_planner.planning.region_outlines import find_keep_outs, outline_region
from flex_planner.planning.spatial_outlines import outline_in_space
from flex_planner.reports.recording.contents import RecordedMotion
from flex_planner.reports.recording.space_view import space_view
import numpy as np

_FRAMES, _STATIONS, _DIGITS = 201, 13, 4
# of the reach, around all that is drawn
_MARGIN = 0.06


def animation(arm: Arm, motion: RecordedMotion,
              constraints: Sequence[PathConstraint] = ()) -> dict[str, Any]:
    """
    Return what arm.js draws of a motion in the plane, or space.js of one in space.

    Parameters
    ----------
    arm : Arm
        n joints.
    motion : RecordedMotion
        From its first sample, which may hold the arm, to the arrival.
    constraints : sequence of PathConstraint
        Limits on the way, of which the regions that are kept free are shown.

    Returns
    -------
    dict
        ``times`` (F,) [s]; ``links`` (F, n, 2 k), of each link the points x, y, x, y ... from its
        joint to its end [mm]; ``payload`` (F, 2) [mm]; ``tip`` (2 m,), its recorded path [mm];
        which links are ``flexible``; colours; ``keep_outs``, of each region the corners of its
        outline [mm], in space the lines that show it. In the plane ``box``, left, low, width and
        height [mm]. In space points have three coordinates, of a rigid link only its ends, and
        there is what `space_view` returns.

    """
    times, coordinates = _even(motion)
    points = link_points(arm, coordinates, _STATIONS)
    payload = payload_position(arm, coordinates)
    shown = {
        'times': times.round(6).tolist(), 'payload': [_flat(place) for place in payload],
        'tip': _flat(motion.tip), 'flexible': [bool(link.modes) for link in arm.links],
        'loaded': bool(motion.payload_mass),
        'colours': {'flexible': FLEXIBLE, 'rigid': '#444444', 'aside': ARM, 'tip': PLANNED,
                    'refused': REFUSED}}
    if isinstance(arm, SpatialArm):
        kept = [slice(None) if link.modes else [0, -1] for link in arm.links]
        everything = np.concatenate([points.reshape(-1, 3), payload, motion.tip])
        return {**shown, **space_view(arm, coordinates, everything), 'links': [
            [_flat(link[stations]) for link, stations in zip(frame, kept, strict=True)]
            for frame in points], 'keep_outs': [
            _flat(line) for one in find_keep_outs(constraints)
            for line in outline_in_space(one.region, arm.reach)]}
    return {**shown, 'links': [[_flat(link) for link in frame] for frame in points],
            'keep_outs': [_flat(outline_region(one.region, arm.reach))
                          for one in find_keep_outs(constraints)],
            'box': _box(np.concatenate([points.reshape(-1, 2), payload, motion.tip]), arm.reach)}


def _box(points: Array, reach: float) -> list[float]:
    """Return left, low, width and height of what holds points and the base [mm]."""
    everything = np.concatenate([points, np.zeros((1, 2))])
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = _MARGIN * reach
    return _flat(np.concatenate([low - margin, high - low + 2 * margin]))


def _even(motion: RecordedMotion) -> tuple[Array, Array]:
    """Return even times (F,) and the coordinates (F, n_t) then, without what follows arrival."""
    last = motion.times.size - 1
    times = np.linspace(motion.times[0], motion.times[last - 1], _FRAMES, dtype=np.float64)
    return times, np.stack([np.interp(times, motion.times[:last], column[:last])
                            for column in motion.coordinates.T], axis=-1)


def _flat(points: Array) -> list[float]:
    """Return points in millimetres as a flat list, to a tenth of a micrometre."""
    flat: list[float] = (points * 1e3).round(_DIGITS).ravel().tolist()
    return flat
