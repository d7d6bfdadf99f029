"""
What a motion must keep besides its cost, and named kinds of cost: Korayem et al. 2009, fig. 1.

An objective is a largest value: of joint speeds, of the share of the motors' torque, of modal
rates. It is met by weights, see `flex_planner.planning.weight_search`.

"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import (
    InvalidSizeError,
    InvalidTaskError,
    InvalidValueError,
    NotFiniteError,
)
from flex_planner.base.validation import Array, number
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_TIME_WEIGHT, Task
from flex_planner.optimal_control.via_points import free_times
from flex_planner.planning.robust.objective import Robustness, RobustSearch
import numpy as np
from numpy.typing import ArrayLike

_MIN_TOLERANCE, _MAX_TOLERANCE = 1e-4, 1.0
_MAX_WEIGHT = 1e12
_LEAST_LIMIT, _MOST_LIMIT = 1e-9, 1e9
_BOUND = '> 0, or inf for no limit'
# points in an interval of the mesh at which peaks are looked for
_POINTS = np.linspace(0, 1, 129, dtype=np.float64)


class Objective(Enum):
    """What is limited; the value is shown to people."""

    JOINT_SPEEDS = 'joint speeds'
    TORQUE_SHARES = 'torque shares'
    MODAL_RATES = 'modal rates'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Objectives:
    """
    Largest values that a motion may have; empty, or ``inf`` at an entry, for no limit.

    Limits are within 1e-9 to 1e9.

    Parameters
    ----------
    max_joint_speeds : array_like, shape (n,)
        Of the absolute joint speeds, > 0 [rad/s]; met by W_2 of those joints.
    max_torque_shares : array_like, shape (n,)
        Of the torque, as a share of its bound at the speed it has, > 0; met by R of those joints.
    max_modal_rates : array_like, shape (n_f,)
        Of the absolute modal rates, > 0 [m/s]; met by W_2 of those modes.
    weight_tolerance : float
        delta W of condition (II): a weight is the smallest that meets its objective if the weight
        over 1 + weight_tolerance does not; 1e-4 to 1.
    robustness : Robustness or None
        Which errors of the model the residual vibration must forgive; met by an offset of the
        effort, see `flex_planner.planning.robust`.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    max_joint_speeds: Array = field(default_factory=lambda: np.zeros(0))
    max_torque_shares: Array = field(default_factory=lambda: np.zeros(0))
    max_modal_rates: Array = field(default_factory=lambda: np.zeros(0))
    weight_tolerance: float = 0.01
    robustness: Robustness | None = None

    if TYPE_CHECKING:
        # arrays are made of anything like one; type checkers would insist on arrays
        def __init__(self, *, max_joint_speeds: ArrayLike = ...,
                     max_torque_shares: ArrayLike = ...,
                     max_modal_rates: ArrayLike = ..., weight_tolerance: float = ...,
                     robustness: Robustness | None = ...) -> None:
            """Accept lists where arrays are kept."""

    def __post_init__(self) -> None:
        for name in ('max_joint_speeds', 'max_torque_shares', 'max_modal_rates'):
            object.__setattr__(self, name, _limits(name, getattr(self, name)))
        number('weight_tolerance', self.weight_tolerance, at_least=_MIN_TOLERANCE,
               at_most=_MAX_TOLERANCE)

    def check(self, task: Task) -> None:
        """
        Check that the limits go with a task.

        Raises
        ------
        InvalidSizeError
            If there are too few or too many.
        InvalidTaskError
            If the duration is free: it would grow where weights are raised; or if the time of a
            via point is; or if the robustness does not go with the task, see `Robustness.check`.

        """
        arm = task.arm
        for name, count in (('max_joint_speeds', arm.n_joints),
                            ('max_torque_shares', arm.n_joints),
                            ('max_modal_rates', arm.n_modes)):
            entries = getattr(self, name).size
            if entries not in (0, count):
                bound = f'a list of {count} numbers' if count else 'empty: the links are rigid'
                raise InvalidSizeError(name, f'{entries} entries', bound)
        if self.robustness is not None:
            self.robustness.check(task)
        if task.time_weight:
            raise InvalidTaskError(f'time_weight is {task.time_weight:g}, but must be 0 where '
                                   'objectives are given')
        if free_times(task.via_points):
            raise InvalidTaskError('a via point has no time, but must have one where objectives '
                                   'are given')

    def limits(self, objective: Objective, arm: Arm) -> Array:
        """Return the limits of all joints or modes, ``inf`` where there is none."""
        given: Array = getattr(self, _FIELDS[objective])
        count = arm.n_modes if objective is Objective.MODAL_RATES else arm.n_joints
        return given if given.size else np.full(count, np.inf)

    def limited(self, arm: Arm) -> tuple[Objective, ...]:
        """Return the objectives that have a limit."""
        return tuple(objective for objective in Objective
                     if np.isfinite(self.limits(objective, arm)).any())

    def shares(self, objective: Objective, problem: MotionProblem,
               solution: CollocationSolution) -> Array:
        """Return the peak of each joint or mode as a share of its limit; at most 1 is met."""
        peaks = _peaks(objective, problem, solution)
        shares: Array = peaks / self.limits(objective, problem.model.arm)
        return shares

    def pattern(self, objective: Objective, arm: Arm) -> Array:
        """Return the weight of each joint or mode in units of that of the tightest limit."""
        limits = self.limits(objective, arm)
        pattern: Array = (limits.min() / limits) ** 2
        return pattern


_FIELDS = {Objective.JOINT_SPEEDS: 'max_joint_speeds',
           Objective.TORQUE_SHARES: 'max_torque_shares',
           Objective.MODAL_RATES: 'max_modal_rates'}


def _limits(name: str, values: ArrayLike) -> Array:
    """Return limits as an array, each > 0."""
    try:
        limits = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(name, values, 'a list of numbers') from None
    if limits.ndim != 1:
        raise InvalidValueError(name, values, 'a list of numbers')
    for i, limit in enumerate(limits):
        if np.isnan(limit):
            raise NotFiniteError(f'{name}[{i}]', float(limit), _BOUND)
        if not limit > 0:
            raise InvalidValueError(f'{name}[{i}]', float(limit), _BOUND)
        if np.isfinite(limit):
            number(f'{name}[{i}]', limit, at_least=_LEAST_LIMIT, at_most=_MOST_LIMIT)
    limits.setflags(write=False)
    return limits


def _peaks(objective: Objective, problem: MotionProblem,
           solution: CollocationSolution) -> Array:
    """Return the largest values over the motion."""
    n, n_t = problem.model.arm.n_joints, problem.model.arm.n_coordinates
    z = solution.values_at(_POINTS).reshape(-1, problem.size)
    times = solution.times_at(_POINTS).ravel()
    if objective is Objective.MODAL_RATES:
        return _largest(z[:, 2 * n_t - problem.model.arm.n_modes:2 * n_t])
    rates = z[:, n_t:n_t + n]
    if objective is Objective.JOINT_SPEEDS:
        return _largest(rates)
    torque = problem.controls(times, z).torque
    return _largest(torque / problem.parameters.torque_limits.toward(torque, rates))


def _largest(values: Array) -> Array:
    """Return the largest absolute value of each column."""
    largest: Array = np.abs(values).max(axis=0)
    return largest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeightTrial:
    """
    A motion on the way to one that meets its objectives.

    Attributes
    ----------
    objective : Objective
        Whose weight was tried.
    weight : float
        Of the tightest limit, added to W_2; for `TORQUE_SHARES` the share by which R grows.
    share : float
        Largest peak of that objective as a share of its limit; ``inf`` if not solved.
    met : bool
        Whether it is at most 1.

    """

    objective: Objective
    weight: float
    share: float
    met: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Margin:
    """
    Condition (II): the weight meets its objective, the relaxed one does not.

    Attributes
    ----------
    objective : Objective
        Met.
    weight, relaxed_weight : float
        As of `WeightTrial`; the relaxed one is smaller by the tolerance at most.
    share, relaxed_share : float
        Largest peaks as shares of the limit, at most 1 and above 1.

    """

    objective: Objective
    weight: float
    relaxed_weight: float
    share: float
    relaxed_share: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectiveSearch:
    """
    How objectives were met, or why not.

    Attributes
    ----------
    objectives : Objectives
        What was asked.
    met : bool
        Whether all are.
    trials : tuple of WeightTrial
        The path of weights.
    margins : tuple of Margin
        One for each objective that needed a weight.
    robust : RobustSearch or None
        How errors of the model are forgiven; None if that was not asked for, or not come to.

    """

    objectives: Objectives
    met: bool
    trials: tuple[WeightTrial, ...] = ()
    margins: tuple[Margin, ...] = ()
    robust: RobustSearch | None = None


def minimum_effort(task: Task) -> Task:
    """Return the task with nothing but effort in its cost: W_1 = W_2 = 0, section 5.4."""
    return replace(task, position_weights=np.zeros(0), velocity_weights=np.zeros(0),
                   time_weight=0.0)


def minimum_effort_speed(task: Task, weight: float) -> Task:
    """Return the task with effort and joint speeds in its cost, eq. (34): W_2 at the joints."""
    number('weight', weight, above=0, at_most=_MAX_WEIGHT)
    return replace(minimum_effort(task), velocity_weights=np.full(task.arm.n_joints, weight))


def minimum_vibration(task: Task, weight: float) -> Task:
    """Return the task with effort and modal rates in its cost, section 5.5: W_2 at the modes."""
    number('weight', weight, above=0, at_most=_MAX_WEIGHT)
    if not task.arm.n_modes:
        raise InvalidTaskError('the links of the arm are rigid: there is no vibration')
    weights = np.zeros(task.arm.n_coordinates)
    weights[-task.arm.n_modes:] = weight
    return replace(minimum_effort(task), velocity_weights=weights)


def minimum_time(task: Task, price: float) -> Task:
    """
    Return the task with effort and a price per second in its cost, and a free duration.

    The higher the price, the nearer to the shortest duration, which `find_min_duration` finds.

    """
    number('price', price, above=0, at_most=MAX_TIME_WEIGHT, unit='1/s')
    return replace(minimum_effort(task), time_weight=price)
