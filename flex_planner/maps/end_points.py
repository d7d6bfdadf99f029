"""Start and goal of the motions of a map: points of the tip, some of them moved by axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from flex_planner.arms.arm import Arm
from flex_planner.arms.inverse_kinematics import check_angle_limits, posture_near_point, workspace
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_inverse_kinematics import farthest_reach
from flex_planner.base.errors import InvalidValueError, SingularError, UnreachableError
from flex_planner.base.validation import Array, number, vector
from flex_planner.maps.axes import Axis, MAX_COORDINATE
from flex_planner.optimal_control.task import MAX_JOINT_ANGLE, Task
import numpy as np

_CANDIDATES = 25
_MOST = 3  # coordinates of a point


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class End:
    """
    The start or the goal of every motion of a map.

    Attributes
    ----------
    name : str
        ``start`` or ``goal``; its axes are called ``start_x`` and so on.
    point : numpy.ndarray, shape (2,), or (3,) of a spatial arm
        Of the tip; NaN where an axis gives it [m].
    angles : numpy.ndarray, shape (n,)
        Of the joints, instead of the point; empty if there is one [rad].

    """

    name: str
    point: Array = field(default_factory=lambda: np.full(2, np.nan))
    angles: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        for name in ('point', 'angles'):
            copy = np.array(getattr(self, name), dtype=np.float64)
            copy.setflags(write=False)
            object.__setattr__(self, name, copy)

    @property
    def axes(self) -> tuple[str, ...]:
        """Return the names of the axes that may move it."""
        return axes_of(self.name, self.point.size)

    def check(self, arm: Arm, axes: Sequence[Axis]) -> None:
        """
        Refuse what does not fit an arm or the axes.

        Raises
        ------
        InvalidValueError
            Naming the field as in a study file.

        """
        moved = [axis.name for axis in axes if axis.name in axes_of(self.name, _MOST)]
        if self.angles.size:
            field = f'{self.name}_angles'
            vector(field, self.angles, arm.n_joints, at_least=-MAX_JOINT_ANGLE,
                   at_most=MAX_JOINT_ANGLE, unit='rad')
            check_angle_limits(arm, field, self.angles)
            if moved:
                raise InvalidValueError(f'axes.{moved[0]}', 'given',
                                        f'left out: {field} gives the {self.name}')
            return
        for name in moved:
            if name not in axes_of(self.name, arm.dimension):
                raise InvalidValueError(f'axes.{name}', 'given', 'left out: the arm is planar')
        vector(self.name, np.nan_to_num(self.point), arm.dimension)
        for entry, name in zip(self.point, self.axes, strict=True):
            if name not in moved or not np.isnan(entry):
                number(self.name, float(entry), at_least=-MAX_COORDINATE, at_most=MAX_COORDINATE,
                       unit='m')

    def at(self, values: Mapping[str, float]) -> Array:
        """Return the point (2,), or (3,) of a spatial arm, for values of the axes [m]."""
        return np.array([values.get(name, entry)
                         for name, entry in zip(self.axes, self.point, strict=True)])

    def posture(self, arm: Arm, values: Mapping[str, float], elbow: int,
                near: Array | None) -> Array:
        """
        Return the joint angles (n,) for values of the axes, see `posture_near_point` [rad].

        Raises
        ------
        UnreachableError, SingularError
            Saying which end it is.

        """
        if self.angles.size:
            return self.angles
        try:
            return posture_near_point(arm, self.at(values), elbow, near)
        except (UnreachableError, SingularError) as error:
            raise type(error)(f'{self.name}: {error}') from None

    def is_too_far(self, arm: Arm, values: Mapping[str, float]) -> bool:
        """Return whether a point is farther from the base, or nearer, than the tip gets."""
        if self.angles.size:
            return False
        if isinstance(arm, SpatialArm):
            away = float(np.linalg.norm(self.at(values) - arm.base))
            return away > farthest_reach(arm)
        nearest, farthest = workspace(arm)
        return not nearest <= float(np.hypot(*self.at(values))) <= farthest


def axes_of(name: str, count: int) -> tuple[str, ...]:
    """Return the names of the axes of an end's point with so many coordinates."""
    return tuple(f'{name}_{letter}' for letter in 'xyz'[:count])


def middle_posture(arm: Arm, end: End, axes: tuple[Axis, ...], elbow: int) -> Array | None:
    """
    Return the posture at a reachable point in the middle of an end's axes.

    Postures that are taken close to it jump by a full turn only half a turn away from it. None
    if no axis moves the end, or if it finds no point that can be reached.

    """
    given = {axis.name: axis.values for axis in axes if axis.name in end.axes}
    if not given or end.angles.size:
        return None
    middle = {name: float(values.mean()) for name, values in given.items()}
    grid = np.meshgrid(*(_thin(values) for values in given.values()))
    points = np.stack([part.ravel() for part in grid], axis=1)
    distances = np.linalg.norm(points - np.array(list(middle.values())), axis=1)
    for place in np.argsort(distances, kind='stable'):
        try:
            values = dict(zip(given, points[place].tolist(), strict=True))
            return posture_near_point(arm, end.at(values), elbow)
        except (UnreachableError, SingularError):
            continue
    return None


def _thin(values: Array) -> Array:
    """Return some of the values, not more than a few dozen."""
    return values[::max(1, values.size // _CANDIDATES)]


def are_close(first: Task, second: Task) -> bool:
    """
    Return whether no joint of two motions is half a turn or more apart at start and goal.

    Between neighbouring cells that are not, the arm turns the other way round: neither motion
    is a start for the other.

    """
    return all(bool(np.abs(getattr(first, name) - getattr(second, name)).max() < np.pi)
               for name in ('start_positions', 'goal_positions'))
