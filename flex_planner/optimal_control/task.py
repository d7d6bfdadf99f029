"""What is asked of the planner: a point-to-point motion and how to judge it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.arms.inverse_kinematics import check_angle_limits
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array, listed, number, vector
from flex_planner.optimal_control.ends_at_points import ends_at_points, MAX_COORDINATE
from flex_planner.optimal_control.goal_in_pose import posture_in_pose
from flex_planner.optimal_control.path_constraints.path_constraint import PathConstraint
from flex_planner.optimal_control.via_points import check_via_points, ViaPoint
import numpy as np
from numpy.typing import ArrayLike

MAX_JOINT_ANGLE = 100.0
MIN_DURATION, MAX_DURATION = 1e-9, 1000.0
MAX_PAYLOAD = 1e6
MAX_VELOCITY = 1e3
MAX_DISPLACEMENT = 1e2
MAX_TIME_WEIGHT = 1e9
MIN_TOLERANCE = 1e-15
# of effort, where 0 is none; far beyond what searches for weights come to
MIN_WEIGHT, MAX_WEIGHT = 1e-18, 1e18
MIN_TORQUE_RATE = 1e-9
# of the duration, over which torques turn where their rates have bounds alone
_SMOOTHING = 1 / 200


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """
    A motion between two postures, with the weights of eqs. (6) and (7).

    By default it goes from rest to rest in a given time.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    start_positions, goal_positions : array_like, shape (n,)
        Joint angles, within +-100 rad; ways of joints that slide [m]. Where a point is given they
        only say from which posture that of the bent arm is found, see `posture_near_point`.
    start_point, goal_point : array_like, shape (2,), or (3,) of a spatial arm
        Where the tip of the arm is at rest, bent by gravity with its payload, in the base frame
        [m], within +-1e6; empty where joint angles are given. `MotionProblem` finds the posture.
    duration : float
        t_f, 1e-9 to 1000 [s]; a first guess of it if `time_weight` is not 0.
    payload_mass : float
        m_p, >= 0 and at most 1e6 [kg].
    payload_inertia : float
        Rotary inertia of the payload about its centre of mass, which is at the tip unless
        `Arm.payload_com` says otherwise, >= 0 and at most 1e6 [kg m^2]; by default
        `Arm.payload_inertia`. `SpatialArm.payload_tensor` adds what is not the same about every
        axis.
    effort_weights : array_like, shape (n,)
        Diagonal of R, 1e-18 to 1e18; empty for ones.
    position_weights, velocity_weights : array_like, shape (n,) or (n_t,)
        Diagonals of W_1 and W_2, 0 to 1e18; empty for zeros, n entries for the joints alone.
    torque_rate_weight : array_like, a number or shape (n,)
        Diagonal of S, 1e-18 to 1e18, one number for all joints; empty for none. With it
        ``r^T S r / 2`` is added to L of eq. (7), where r are the rates of the torques [N m/s], and
        torques start and end at those that hold the arm where it rests: they have no jumps.
    max_torque_rate : array_like, a number or shape (n,)
        Largest rates of the torques in either direction, > 0 [N m/s], ``inf`` for none, one
        number for all joints; empty for none. Without `torque_rate_weight` a small price on the
        rates is added, see `torque_rate_prices`; with `time_weight` the weight must be given.
    start_velocities, goal_velocities : array_like, shape (n,) or (n_t,)
        Rates at both ends [rad/s, m/s]; empty for zeros, n entries for the joints alone.
    start_modal_displacements : array_like, shape (n_f,)
        Of all links at the start, with joint angles and velocities the whole state of an arm that
        moves, within +-100 m; empty for those of the arm at rest.
    goal_position_weights, goal_velocity_weights : array_like, shape (n,) or (n_t,)
        Diagonals of W_p and W_v of eq. (6): the goal is approached at this price, and is free
        where the weight is 0; at most 1e18. ``inf`` means that it must be met, and is the default;
        n entries leave it so for the modal coordinates.
    time_weight : float
        Price of a second, >= 0 [1/s]: if not 0, the duration is free and this times t_f is
        added to eq. (6). The larger it is, the nearer the motion comes to minimum time.
    via_points : sequence of ViaPoint
        Joint angles or points of the tip that are passed on the way, in this order, without a
        stop; not with `time_weight`.
    tolerance : float
        eps of eq. (17) with W_p = W_v = 1, 1e-15 to 1.
    allow_large_bending : bool
        Whether a plan may bend links by more than 0.3 of their length, though they are linear
        beams.
    path_constraints : tuple of PathConstraint
        Limits that hold on the whole way, besides those of the arm; see
        `optimal_control.path_constraints`.

    Raises
    ------
    InvalidValueError
        Naming field, value and bound.

    """

    arm: Arm
    start_positions: Array
    goal_positions: Array
    duration: float
    payload_mass: float = 0.0
    payload_inertia: float = None  # type: ignore[assignment]  # set to that of the arm
    effort_weights: Array = field(default_factory=lambda: np.zeros(0))
    position_weights: Array = field(default_factory=lambda: np.zeros(0))
    velocity_weights: Array = field(default_factory=lambda: np.zeros(0))
    torque_rate_weight: Array = field(default_factory=lambda: np.zeros(0))
    max_torque_rate: Array = field(default_factory=lambda: np.zeros(0))
    start_velocities: Array = field(default_factory=lambda: np.zeros(0))
    goal_velocities: Array = field(default_factory=lambda: np.zeros(0))
    start_modal_displacements: Array = field(default_factory=lambda: np.zeros(0))
    start_point: Array = field(default_factory=lambda: np.zeros(0))
    goal_point: Array = field(default_factory=lambda: np.zeros(0))
    goal_position_weights: Array = field(default_factory=lambda: np.zeros(0))
    goal_velocity_weights: Array = field(default_factory=lambda: np.zeros(0))
    time_weight: float = 0.0
    via_points: tuple[ViaPoint, ...] = ()
    tolerance: float = 1e-3
    allow_large_bending: bool = False
    path_constraints: tuple[PathConstraint, ...] = ()

    if TYPE_CHECKING:
        # arrays are made of anything like one; type checkers would insist on arrays
        def __init__(
                self, *, arm: Arm, start_positions: ArrayLike, goal_positions: ArrayLike,
                duration: float, payload_mass: float = ..., payload_inertia: float | None = ...,
                effort_weights: ArrayLike = ..., position_weights: ArrayLike = ...,
                velocity_weights: ArrayLike = ..., torque_rate_weight: ArrayLike = ...,
                max_torque_rate: ArrayLike = ..., start_velocities: ArrayLike = ...,
                goal_velocities: ArrayLike = ..., start_modal_displacements: ArrayLike = ...,
                start_point: ArrayLike = ..., goal_point: ArrayLike = ...,
                goal_position_weights: ArrayLike = ..., goal_velocity_weights: ArrayLike = ...,
                time_weight: float = ..., via_points: Sequence[ViaPoint] = ...,
                tolerance: float = ..., allow_large_bending: bool = ...,
                path_constraints: Sequence[PathConstraint] = ...) -> None:
            """Accept lists where arrays are kept."""

    @classmethod
    def between_points(cls, arm: Arm, start: ArrayLike, goal: ArrayLike, *, duration: float,
                       elbow: int = -1, **others: Any) -> Task:
        """
        Return the motion between two points where the tip rests, see `ends_at_points`.

        Parameters
        ----------
        arm : Arm
            n joints.
        start, goal : array_like, shape (2,), or (3,) of a spatial arm
            Tip positions of the arm at rest, bent by gravity, in the base frame [m].
        duration : float
            As of `Task`.
        elbow : int
            Branch of the inverse kinematics, +1 or -1.
        others
            Further fields of `Task`.

        Raises
        ------
        UnreachableError, SingularError, InvalidValueError
            See `posture_near_point`; the message says which point.

        """
        return cls(arm=arm, duration=duration, **others,
                   **ends_at_points(arm, start, goal, elbow))

    @classmethod
    def to_point(cls, arm: Arm, start_positions: ArrayLike, goal: ArrayLike, *, duration: float,
                 elbow: int = -1, **others: Any) -> Task:
        """
        Return the motion from given joint angles to a point where the tip rests.

        Parameters
        ----------
        start_positions : array_like, shape (n,)
            Joint angles [rad].
        arm, goal, duration, elbow, others
            As of `between_points`.

        Raises
        ------
        UnreachableError, SingularError, InvalidValueError
            See `posture_near_point`; the message says which point.

        """
        start = vector('start_positions', start_positions, arm.n_joints, unit='rad')
        return cls(arm=arm, duration=duration, start_positions=start, **others,
                   **ends_at_points(arm, None, goal, elbow, start))

    @classmethod
    def to_pose(cls, arm: Arm, start_positions: ArrayLike, point: ArrayLike,
                orientation: ArrayLike, *, duration: float, **others: Any) -> Task:
        """
        Return the motion from given joint coordinates to a pose in which the tip rests.

        The goal of the task are joint coordinates: those of `posture_in_pose` with the payload of
        the task. A search that changes the payload keeps them, not the pose.

        Parameters
        ----------
        arm : Arm
            A spatial one of n joints.
        start_positions : array_like, shape (n,)
            [rad, m].
        point, orientation : array_like
            As of `posture_in_pose`.
        duration, others
            Fields of `Task`.

        Raises
        ------
        UnreachableError, SingularError, NoEquilibriumError, InvalidValueError
            See `posture_in_pose`.

        """
        start = vector('start_positions', start_positions, arm.n_joints, unit='rad')
        goal = posture_in_pose(arm, point, orientation, start,
                               payload_mass=others.get('payload_mass', 0.0),
                               payload_inertia=others.get('payload_inertia'))
        return cls(arm=arm, duration=duration, start_positions=start, goal_positions=goal,
                   **others)

    def __post_init__(self) -> None:
        n, n_t = self.arm.n_joints, self.arm.n_coordinates
        for name in ('start_positions', 'goal_positions'):
            self._set(name, vector(name, getattr(self, name), n, at_least=-MAX_JOINT_ANGLE,
                                   at_most=MAX_JOINT_ANGLE, unit='rad'))
            point = name.replace('positions', 'point')
            self._set(point, vector(point, getattr(self, point), (0, self.arm.dimension),
                                    at_least=-MAX_COORDINATE, at_most=MAX_COORDINATE, unit='m'))
            if not (getattr(self, point).size and self.arm.bends_at_rest):
                check_angle_limits(self.arm, name, getattr(self, name))
        number('duration', self.duration, above=0, at_most=MAX_DURATION, unit='s')
        number('duration', self.duration, at_least=MIN_DURATION, unit='s')
        number('payload_mass', self.payload_mass, at_least=0, at_most=MAX_PAYLOAD, unit='kg')
        given: float | None = self.payload_inertia
        object.__setattr__(self, 'payload_inertia',
                           self.arm.payload_inertia if given is None else given)
        number('payload_inertia', self.payload_inertia, at_least=0, at_most=MAX_PAYLOAD,
               unit='kg m^2')
        number('tolerance', self.tolerance, above=0, at_most=1)
        number('tolerance', self.tolerance, at_least=MIN_TOLERANCE)
        number('time_weight', self.time_weight, at_least=0, at_most=MAX_TIME_WEIGHT, unit='1/s')
        effort = vector('effort_weights', self.effort_weights, (0, n), above=0,
                        at_most=MAX_WEIGHT)
        vector('effort_weights', effort, effort.size, at_least=MIN_WEIGHT)
        self._set('effort_weights', effort if effort.size else vector('', np.ones(n), n))
        for name in ('position_weights', 'velocity_weights'):
            self._set(name, _pad(name, getattr(self, name), n, n_t, 0.0, at_least=0,
                                 at_most=MAX_WEIGHT))
        for name in ('start_velocities', 'goal_velocities'):
            self._set(name, _pad(name, getattr(self, name), n, n_t, 0.0,
                                 at_least=-MAX_VELOCITY, at_most=MAX_VELOCITY))
        for name in ('goal_position_weights', 'goal_velocity_weights'):
            self._set(name, _goal_weights(name, getattr(self, name), n, n_t))
        self._set('torque_rate_weight', _per_joint(
            'torque_rate_weight', self.torque_rate_weight, n, MIN_WEIGHT, MAX_WEIGHT))
        self._set('max_torque_rate', _per_joint(
            'max_torque_rate', self.max_torque_rate, n, MIN_TORQUE_RATE, np.inf, 'N m/s'))
        self._set_bending()
        self._set_constraints()
        self._set_via_points()

    @property
    def has_torque_rates(self) -> bool:
        """Return whether rates of torques have a price or a bound, and torques no jumps."""
        return bool(self.torque_rate_weight.size or self.max_torque_rate.size)

    @property
    def torque_rate_prices(self) -> Array:
        """
        Return the diagonal of S, shape (n,).

        Where rates have a bound but no weight it is ``R (T / 200)^2``, T the duration: rates would
        jump between their bounds else, and where they are within them have no condition.

        """
        if self.torque_rate_weight.size:
            return self.torque_rate_weight
        prices: Array = self.effort_weights * (_SMOOTHING * self.duration)**2
        return prices

    @property
    def torque_rate_bounds(self) -> Array:
        """Return the largest rates of the torques, infinite for none, shape (n,) [N m/s]."""
        if self.max_torque_rate.size:
            return self.max_torque_rate
        return np.full(self.arm.n_joints, np.inf)

    @property
    def ends_at_rest(self) -> bool:
        """Return whether the arm must come to rest at the goal, bent as gravity bends it."""
        hard = np.isinf(self.goal_position_weights) & np.isinf(self.goal_velocity_weights)
        return bool(hard.all()) and not bool(self.goal_velocities.any())

    @property
    def starts_at_rest(self) -> bool:
        """Return whether the arm rests at the start, bent as gravity bends it."""
        return not (self.start_modal_displacements.size or self.start_velocities.any())

    @property
    def must_reach_point(self) -> bool:
        """Return whether the tip must come to a point: not if it may pass by at a price."""
        return bool(self.goal_point.size) and bool(np.isinf(self.goal_position_weights).all())

    def _set_bending(self) -> None:
        """Check the modal displacements at the start."""
        name = 'start_modal_displacements'
        bending = vector(name, getattr(self, name), (0, self.arm.n_passive),
                         at_least=-MAX_DISPLACEMENT, at_most=MAX_DISPLACEMENT, unit='m')
        self._set(name, bending)
        if bending.size and self.start_point.size:
            raise InvalidValueError(name, 'given', 'left out where the start is a point: there '
                                    'the arm rests')

    def _set_constraints(self) -> None:
        """Check the limits on the way."""
        given = listed('path_constraints', self.path_constraints, 'of limits on the way')
        for i, one in enumerate(given):
            name = f'path_constraints[{i}]'
            if not isinstance(one, PathConstraint):
                raise InvalidValueError(name, one, 'a PathConstraint, such as KeepOut')
            one.check(name, self.arm)
        object.__setattr__(self, 'path_constraints', given)

    def _set_via_points(self) -> None:
        """Check the via points."""
        points = check_via_points(self.arm, listed('via_points', self.via_points, 'of via points'),
                                  self.duration,
                                  MAX_JOINT_ANGLE)
        object.__setattr__(self, 'via_points', points)
        if points and self.time_weight:
            raise InvalidValueError('time_weight', self.time_weight, '0 where there are via '
                                    'points: their times are those of a given duration')
        self._check_torque_rates()

    def _check_torque_rates(self) -> None:
        """Refuse bounds of rates whose small price would change with a free duration."""
        if self.time_weight and self.max_torque_rate.size and not self.torque_rate_weight.size:
            raise InvalidValueError('time_weight', self.time_weight, '0 where max_torque_rate is '
                                    'given without torque_rate_weight')

    def _set(self, name: str, value: Array) -> None:
        object.__setattr__(self, name, value)


def _pad(name: str, values: ArrayLike, n: int, n_t: int, rest: float,
         **bounds: float) -> Array:
    """Return n_t checked entries; those that are not given are `rest`."""
    given = vector(name, values, (0, n, n_t), **bounds)  # type: ignore[arg-type]
    padded: Array = np.concatenate([given, np.full(n_t - given.size, rest)])
    padded.setflags(write=False)
    return padded


def _per_joint(name: str, values: ArrayLike, n: int, least: float, most: float,
               unit: str = '') -> Array:
    """Return n checked entries > 0, of which one may stand for all, or none."""
    try:
        given = np.atleast_1d(np.array(values, dtype=float))
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(name, values, 'a number or a list of numbers') from None
    endless = np.isposinf(given) if np.isposinf(most) else np.zeros(given.shape, dtype=bool)
    checked = vector(name, np.where(endless, 1.0, given), (0, 1, n), above=0, unit=unit)
    vector(name, checked, checked.size, at_least=least, at_most=most, unit=unit)
    entries: Array = np.where(endless, np.inf, checked)
    entries = np.repeat(entries, n) if entries.size == 1 else entries
    entries.setflags(write=False)
    return entries


def _goal_weights(name: str, values: ArrayLike, n: int, n_t: int) -> Array:
    """Return n_t weights, >= 0 or infinite."""
    try:
        given = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        given = np.zeros(0)
    hard = np.isposinf(given)
    if given.ndim == 1 and hard.any():
        checked = _pad(name, np.where(hard, 0.0, given), n, n_t, np.inf, at_least=0,
                       at_most=MAX_WEIGHT)
        padded = np.where(np.pad(hard, (0, n_t - hard.size)), np.inf, checked)
        padded.setflags(write=False)
        return padded
    return _pad(name, values, n, n_t, np.inf, at_least=0, at_most=MAX_WEIGHT)


def postures_from_points(arm: Arm, start: ArrayLike, goal: ArrayLike,
                         elbow: int) -> tuple[Array, Array]:
    """
    Return the joint angles (n,) at start and goal of `ends_at_points` [rad].

    They put the tip of the unbent arm at the points; a task with nothing but these angles rests
    elsewhere where gravity bends the arm.

    """
    fields = ends_at_points(arm, start, goal, elbow)
    return fields['start_positions'], fields['goal_positions']
