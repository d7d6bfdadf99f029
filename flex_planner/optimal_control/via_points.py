"""Points that a motion passes on its way, as a task names them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.arms.inverse_kinematics import check_angle_limits, posture_near_point
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_inverse_kinematics import usual_rank
from flex_planner.base.errors import (
    InvalidSizeError,
    InvalidValueError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.validation import Array, number, vector
from flex_planner.optimal_control.ends_at_points import MAX_COORDINATE
import numpy as np
from numpy.typing import ArrayLike

MOST_VIA_POINTS = 100
# of the duration: via points are not nearer to one another or to the ends
MIN_VIA_GAP = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViaPoint:
    """
    Joint angles, or a point of the tip, that a motion passes without a stop.

    Parameters
    ----------
    positions : array_like, shape (n,)
        Joint angles [rad], NaN for a joint that may stand anywhere; empty where `point` is given.
    point : array_like, shape (2,), or (3,) for a spatial arm
        Where the tip of the bent arm is, in the base frame [m]; empty where `positions` are given.
    time : float or None
        When it is passed, from the start of the motion [s]; None for the time that is best, which
        takes at least two numbers of angles or coordinates: the time at which one joint passes
        one angle is not determined by it.

    Raises
    ------
    InvalidValueError
        Naming field, value and bound. What depends on the arm is checked by `Task`.

    """

    positions: Array = field(default_factory=lambda: np.zeros(0))
    point: Array = field(default_factory=lambda: np.zeros(0))
    time: float | None = None

    if TYPE_CHECKING:
        def __init__(self, *, positions: ArrayLike = ..., point: ArrayLike = ...,
                     time: float | None = ...) -> None:
            """Accept lists where arrays are kept."""

    def __post_init__(self) -> None:
        for name in ('positions', 'point'):
            object.__setattr__(self, name, _plain(name, getattr(self, name)))
        if bool(self.positions.size) == bool(self.point.size):
            given = 'both' if self.point.size else 'neither'
            raise InvalidValueError('positions and point', given, 'one of them, the other empty')
        if self.time is not None:
            object.__setattr__(self, 'time', number('time', self.time, above=0, unit='s'))

    @property
    def conditions(self) -> int:
        """Return how many numbers it fixes."""
        return self.point.size or int(np.isfinite(self.positions).sum())


def _plain(name: str, values: ArrayLike) -> Array:
    """Return values as a read-only array of one axis."""
    try:
        given = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(name, values, 'a list of numbers') from None
    if given.ndim != 1:
        raise InvalidSizeError(name, f'an array of {given.ndim} axes', 'a list of numbers')
    given.setflags(write=False)
    return given


def check_via_points(arm: Arm, points: Sequence[ViaPoint], duration: float,
                     most_angle: float) -> tuple[ViaPoint, ...]:
    """
    Return via points after a check that they go with an arm and a duration.

    Parameters
    ----------
    arm : Arm
        n joints.
    points : sequence of ViaPoint
        In the order in which they are passed.
    duration : float
        Of the motion [s].
    most_angle : float
        Largest joint angle [rad].

    Raises
    ------
    InvalidValueError, UnreachableError, SingularError
        Naming the via point, value and bound.

    """
    if len(points) > MOST_VIA_POINTS:
        raise InvalidValueError('via_points', len(points), f'at most {MOST_VIA_POINTS}')
    for k, via in enumerate(points):
        name = f'via_points[{k}]'
        if not isinstance(via, ViaPoint):
            raise InvalidValueError(name, via, 'a ViaPoint')
        _check_place(arm, via, name, most_angle)
        if via.time is None and via.conditions < 2:
            raise InvalidValueError(f'{name}.time', 'left out', 'given where a via point fixes '
                                    'one number only, which does not determine the time')
    _check_times(points, duration)
    return tuple(points)


def _check_place(arm: Arm, via: ViaPoint, name: str, most_angle: float) -> None:
    """Check that joints and tip can be there."""
    if via.point.size:
        vector(f'{name}.point', via.point, arm.dimension, at_least=-MAX_COORDINATE,
               at_most=MAX_COORDINATE, unit='m')
        if isinstance(arm, SpatialArm) and usual_rank(arm) < arm.dimension:
            raise InvalidValueError(f'{name}.point', via.point.tolist(), 'left out for an arm '
                                    'whose tip moves on a surface or a curve: give positions')
        _posture(arm, via, name, None)
        return
    known = np.isfinite(via.positions)
    if not known.any() or np.isinf(via.positions).any():
        raise InvalidValueError(f'{name}.positions', via.positions.tolist(),
                                'angles, NaN for some of the joints')
    angles = vector(f'{name}.positions', np.where(known, via.positions, 0.0), arm.n_joints,
                    at_least=-most_angle, at_most=most_angle, unit='rad')
    lower, upper = arm.angle_limits()
    check_angle_limits(arm, f'{name}.positions',
                       np.where(known, angles, np.clip(0.0, lower, upper)))


def _check_times(points: Sequence[ViaPoint], duration: float) -> None:
    """Check that times that are given leave room for all via points, in order."""
    gap = MIN_VIA_GAP * duration
    earliest = 0.0
    for k, via in enumerate(points):
        earliest += gap
        latest = duration - gap * (len(points) - k)
        if via.time is not None:
            if not earliest <= via.time <= latest:
                raise InvalidValueError(f'via_points[{k}].time', via.time, f'from {earliest:g} to '
                                        f'{latest:g} s, after the via point before and before '
                                        'the goal')
            earliest = via.time


def _posture(arm: Arm, via: ViaPoint, name: str, near: Array | None) -> Array:
    """Return joint angles (n,) of the unbent arm that put its tip at a via point, or near it."""
    elbow = -1 if near is None or arm.n_joints < 2 or np.sin(near[1]) <= 0 else 1
    try:
        return posture_near_point(arm, via.point, elbow, near)
    except (UnreachableError, SingularError) as error:
        raise type(error)(f'{name}.point: {error}') from None


def via_postures(arm: Arm, points: Sequence[ViaPoint], start: Array, goal: Array) -> Array:
    """
    Return joint angles at via points, of the arm unbent, shape (K, n) [rad].

    Angles that are not given lie between those of the via points, or ends, before and after.

    Parameters
    ----------
    arm : Arm
        n joints.
    points : sequence of ViaPoint
        K of them.
    start, goal : numpy.ndarray, shape (n,)
        Joint angles at both ends [rad].

    """
    angles = [start]
    for k, via in enumerate(points):
        near = np.where(np.isfinite(angles[-1]), angles[-1], start)
        angles.append(_posture(arm, via, f'via_points[{k}]', near) if via.point.size
                      else via.positions)
    angles.append(goal)
    filled, places = np.array(angles), np.arange(len(angles))
    for joint in range(start.size):
        known = np.isfinite(filled[:, joint])
        filled[:, joint] = np.interp(places, places[known], filled[known, joint])
    return filled[1:-1]


def guess_via_times(points: Sequence[ViaPoint], way: Array, duration: float) -> Array:
    """
    Return when via points are passed, shape (K,): free times by how far the joints turn [s].

    Parameters
    ----------
    points : sequence of ViaPoint
        K of them.
    way : numpy.ndarray, shape (K + 2, n)
        Joint angles at the start, the via points and the goal [rad].
    duration : float
        [s].

    """
    turned = np.abs(np.diff(way, axis=0)).max(axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(turned + 1e-3 * max(turned.max(), 1e-9))])
    times = np.array([0.0, *(np.nan if via.time is None else via.time for via in points),
                      duration])
    known = np.isfinite(times)
    guessed: Array = np.interp(travelled, travelled[known], times[known])
    return guessed[1:-1]


def free_times(points: Sequence[ViaPoint]) -> bool:
    """Return whether the time of a via point is free."""
    return any(via.time is None for via in points)


def say_via_points(points: Sequence[ViaPoint], times: Array) -> Iterator[str]:
    """Yield each via point in words, with the time at which it is passed."""
    for via, time in zip(points, times, strict=True):
        place = (f'({", ".join(f"{x:.6g}" for x in via.point)}) m' if via.point.size else
                 f'({", ".join(_say_angle(angle) for angle in via.positions)}) deg')
        yield f'{place} at {time:.6g} s{" (free)" if via.time is None else ""}'


def _say_angle(angle: float) -> str:
    return f'{np.degrees(angle):.6g}' if np.isfinite(angle) else 'any'
