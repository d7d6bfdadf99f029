"""A plan as markers, for RViz and Foxglove."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import PathConstraint
from flex_planner.planning.region_outlines import find_keep_outs, outline_region
from flex_planner.planning.sampling import SampledPlan
from flex_planner.planning.spatial_outlines import outline_in_space
from flex_planner.ros.messages.points import point_message
import numpy as np
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

_INSTANTS = 9
_STATIONS = 20  # points per link
_LONGEST_PATH = 500  # points
_SOON = 2e-9  # [s], as times of samples are rounded
_LINK, _PATH, _START, _GOAL = (0.2, 0.4, 0.8), (0.9, 0.5, 0.1), (0.2, 0.7, 0.2), (0.8, 0.2, 0.2)


def motion_markers(arm: Arm, reference: SampledPlan, frame: str,
                   constraints: Sequence[PathConstraint] = (),
                   via_times: Sequence[float] | Array = ()) -> MarkerArray:
    """
    Return the bent links at nine instants, the later the less transparent, and the tip's path.

    Namespaces: ``links``, ``tip_path``, ``start``, ``goal``, ``keep_out`` and
    ``via_points``. What a plan before has left is deleted first.

    Parameters
    ----------
    arm : Arm
        The arm.
    reference : SampledPlan
        Samples of the plan.
    frame : str
        Of the base.
    constraints : sequence of PathConstraint
        Of the task: the outlines of regions that are kept free are shown.
    via_times : array_like, shape (m,)
        When via points are passed, from the start of the motion: a ball is where the tip is [s].

    """
    times, tip, width = reference.times_ns, reference.samples.tip, _reach(arm) / 100
    chosen = np.searchsorted(times, np.linspace(0, times[-1], _INSTANTS))
    shapes = link_points(arm, reference.samples.coordinates[chosen], _STATIONS)
    steps = np.unique(np.linspace(0, len(tip) - 1, _LONGEST_PATH).astype(int))
    markers = [Marker(action=Marker.DELETEALL)]
    for k, links in enumerate(shapes):
        alpha = 0.2 + 0.8 * k / (_INSTANTS - 1)
        markers += [_line('links', k * arm.n_joints + i, points, (*_LINK, alpha), width)
                    for i, points in enumerate(links)]
    markers += [_line('tip_path', 0, tip[steps], (*_PATH, 1.0), width / 2),
                _ball('start', tip[0], (*_START, 1.0), 3 * width),
                _ball('goal', tip[-1], (*_GOAL, 1.0), 3 * width)]
    markers += [_line('keep_out', i, line, (*_GOAL, 1.0), width)
                for i, line in enumerate(_outlines(arm, constraints))]
    passed = np.searchsorted(times * 1e-9, reference.start_hold + np.array(via_times) - _SOON)
    markers += [_ball('via_points', tip[k], (*_PATH, 1.0), 2 * width, i)
                for i, k in enumerate(passed)]
    for marker in markers:
        marker.header.frame_id = frame
    return MarkerArray(markers=markers)


def arm_markers(arm: Arm, coordinates: Array, frame: str) -> MarkerArray:
    """
    Return the bent links as they are: namespaces ``links`` and ``tip``.

    Parameters
    ----------
    arm : Arm
        n_t coordinates.
    coordinates : numpy.ndarray, shape (n_t,)
        q.
    frame : str
        Of the base.

    """
    links, width = link_points(arm, coordinates, _STATIONS), _reach(arm) / 100
    markers = [_line('links', i, points, (*_LINK, 1.0), width) for i, points in enumerate(links)]
    markers.append(_ball('tip', links[-1][-1], (*_PATH, 1.0), 2 * width))
    for marker in markers:
        marker.header.frame_id = frame
    return MarkerArray(markers=markers)


def _outlines(arm: Arm, constraints: Sequence[PathConstraint]) -> Iterator[Array]:
    """Yield the lines of regions that are kept free."""
    for one in find_keep_outs(constraints):
        if one.region.dimension == 3:
            yield from outline_in_space(one.region, _reach(arm))
        else:
            yield outline_region(one.region, _reach(arm))


def _reach(arm: Arm) -> float:
    return float(sum(link.length for link in arm.links))


def _marker(namespace: str, number: int, kind: int, color: tuple[float, ...]) -> Marker:
    red, green, blue, alpha = color
    marker = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD,
                    color=ColorRGBA(r=red, g=green, b=blue, a=alpha))
    marker.pose.orientation.w = 1.0
    return marker


def _line(namespace: str, number: int, points: Array, color: tuple[float, ...],
          width: float) -> Marker:
    marker = _marker(namespace, number, Marker.LINE_STRIP, color)
    marker.points = [point_message(point) for point in points]
    marker.scale.x = width
    return marker


def _ball(namespace: str, place: Array, color: tuple[float, ...], size: float,
          number: int = 0) -> Marker:
    marker = _marker(namespace, number, Marker.SPHERE, color)
    marker.pose.position = point_message(place)
    marker.scale.x = marker.scale.y = marker.scale.z = size
    return marker
