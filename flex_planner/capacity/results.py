"""What searches for a limit return: the largest payload, the shortest duration."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from flex_planner.base.html_view import html_view
from flex_planner.base.validation import Array
from flex_planner.capacity.bracket import restart_point
from flex_planner.capacity.incremental import PayloadTrial
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.proofs import Proof
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.warnings import find_arm_warnings, PlanWarning
import numpy as np


class PayloadMethod(Enum):
    """How the maximum payload is found; the value is shown to people."""

    DIRECT = 'payload as an unknown at a rising price'
    INCREMENTAL = 'payload raised step by step'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadFront:
    """
    The cost of each payload met on the way to the largest.

    Attributes
    ----------
    payloads : numpy.ndarray, shape (k,)
        Ascending [kg].
    efforts : numpy.ndarray, shape (k,)
        Least integral of R-weighted squared torques that carries it, J of eq. (6) without
        weights but R [N^2 m^2 s].
    prices : numpy.ndarray, shape (k,)
        dJ/dm_p [N^2 m^2 s/kg].

    """

    payloads: Array = field(default_factory=lambda: np.zeros(0))
    efforts: Array = field(default_factory=lambda: np.zeros(0))
    prices: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LimitResult:
    """
    The outcome of a search for a limit, whether it succeeded or not.

    Attributes
    ----------
    task : Task
        What was asked.
    status : PlanStatus
        ``SOLVED`` if the limit is in the bracket.
    message : str
        The status in more words.
    plan : Plan or None
        The motion at the end of the bracket that is possible.
    extremals : tuple of Extremal
        Motions with values nearer and nearer to the limit, with their prices.
    kinds : tuple of KindOfMotion
        Kinds of motion that the search met, at most four, the best first; values of the arm
        made rigid. Empty where it started from a given motion, or followed one kind only.
    starts : int
        How many starts were explored.
    within_limits : bool
        Whether limits on the way bend the motion, or the motors' limits are in its barrier: the
        other end of the bracket is where no motion was found, which is no bound.
    warm : bool
        Whether it went on from the motion that it was given to start from.
    iterations : int
        Newton iterations.
    planning_time : float
        [s].

    """

    task: Task
    status: PlanStatus
    message: str
    plan: Plan | None = None
    extremals: tuple[Extremal, ...] = field(default=(), repr=False)
    kinds: tuple[KindOfMotion, ...] = field(default=(), repr=False)
    starts: int = 0
    within_limits: bool = False
    warm: bool = False
    iterations: int = 0
    planning_time: float = 0.0

    @property
    def solved(self) -> bool:
        """Return whether the limit is known to the accuracy asked for."""
        return self.status is PlanStatus.SOLVED

    @property
    def bracket_width(self) -> float:
        """Return how far the value is from where its kind of motion ends; inf if unknown."""
        return np.inf

    @property
    def warnings(self) -> tuple[PlanWarning, ...]:
        """Return the warnings of the plan, or of the arm alone where there is none."""
        return find_arm_warnings(self.task.arm) if self.plan is None else self.plan.warnings

    def _repr_html_(self) -> str:
        """Return the result as notebooks show it, with the motion at the limit."""
        rows = [('arm', self.task.arm.name), ('status', self.status.value), *self.limit_rows(),
                ('', self.message), ('searched in', f'{self.planning_time:.2f} s'),
                *(('warning', warning.sentence) for warning in self.warnings)]
        return html_view(rows, self.plan.svg() if self.plan is not None else '')

    def limit_rows(self) -> list[tuple[str, str]]:
        """Return the bracket in words: nothing here, for no limit is known."""
        return []

    @property
    def restart_point(self) -> Extremal | None:
        """Return the last motion that leaves some gap: a start for searches of its kind."""
        return restart_point(self.extremals)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MaxPayload(LimitResult):
    """
    The outcome of a search for the maximum payload, see `LimitResult`.

    Its status is ``INFEASIBLE`` if a proof shows that not even the task's own payload can be
    carried, ``NOT_FOUND`` if no motion that carries it was found.

    Attributes
    ----------
    method : PayloadMethod
        How it was searched.
    payload : float
        Lower end of the bracket: the largest payload with a certified plan; 0 if there is
        none [kg].
    local_upper : float
        Upper end: where this kind of motion ends, see `Extremal.gap`, or by the incremental method
        a payload with which no motion was found; ``inf`` if unknown. Motions of another kind may
        carry more. Within limits on the way (`within_limits`) an estimate, no bound [kg].
    proved_upper : float
        What no motion of the task exceeds; ``inf`` if nothing is proved [kg].
    proof : Proof or None
        Of `proved_upper`.
    limiting_joint : int or None
        Index of the joint whose motor is on its limit for the largest share of the time, see
        `Plan.saturation`, or that can hold no more at the goal.
    held : bool
        Whether the limit is what the motors hold at the goal: `local_upper`.
    front : PayloadFront
        Payloads and their cost; empty if not searched by the direct method.
    trials : tuple of PayloadTrial
        Payloads tried; empty if not searched by the incremental method.

    """

    method: PayloadMethod
    payload: float = 0.0
    local_upper: float = np.inf
    proved_upper: float = np.inf
    proof: Proof | None = None
    limiting_joint: int | None = None
    held: bool = False
    front: PayloadFront = field(default_factory=PayloadFront)
    trials: tuple[PayloadTrial, ...] = ()

    def limit_rows(self) -> list[tuple[str, str]]:
        """Return the largest payload, what is too much, and what is proved."""
        rows = [('largest payload', f'{self.payload:.6g} kg' if self.payload else 'none found')]
        if np.isfinite(self.local_upper):
            rows.append((self.upper_means, f'{self.local_upper:.6g} kg'))
        if np.isfinite(self.proved_upper):
            rows.append(('proved: no motion carries', f'more than {self.proved_upper:.6g} kg'))
        return rows

    @property
    def bracket_width(self) -> float:
        """Return the width of the bracket [kg]; inf if unknown."""
        return self.local_upper - self.payload

    @property
    def upper_means(self) -> str:
        """Return what `local_upper` is, in words that it follows."""
        if self.held:
            return 'the goal cannot be held with'
        if self.within_limits:
            return 'within the limits on the way the search ended near'
        if self.method is PayloadMethod.INCREMENTAL:
            return 'no motion was found with'
        return 'this kind of motion ends at'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MinDuration(LimitResult):
    """
    The outcome of a search for the shortest duration, see `LimitResult`.

    Attributes
    ----------
    duration : float
        Upper end of the bracket: the shortest with a certified plan; ``inf`` if there is
        none [s].
    local_lower : float
        Lower end: where this kind of motion ends, see `Extremal.gap`; 0 if unknown. Motions of
        another kind may be shorter. Within limits on the way a duration in which no motion was
        found [s].
    proved_lower : float
        What no motion of the task falls below; 0 if nothing is proved [s].

    """

    duration: float = np.inf
    local_lower: float = 0.0
    proved_lower: float = 0.0

    @property
    def bracket_width(self) -> float:
        """Return the width of the bracket [s]."""
        return self.duration - self.local_lower

    def limit_rows(self) -> list[tuple[str, str]]:
        """Return the shortest duration, what is too short, and what is proved."""
        found = f'{self.duration:.6g} s' if np.isfinite(self.duration) else 'none found'
        rows = [('shortest duration', found)]
        if self.local_lower:
            ends = ('within the limits on the way none was found in' if self.within_limits else
                    'this kind of motion ends at')
            rows.append((ends, f'{self.local_lower:.6g} s'))
        if self.proved_lower:
            rows.append(('proved: no motion takes', f'less than {self.proved_lower:.6g} s'))
        return rows


def describe_kinds(found: LimitResult) -> str:
    """Return among how many kinds of motion a limit is the best, in words."""
    if not found.kinds:
        return ''
    count = len(found.kinds)
    kinds = 'the only kind of motion' if count == 1 else f'the best of {count} kinds of motion'
    return f', {kinds} found from {found.starts} starts'


def say_lost_weights(task: Task, plan: Plan) -> str:
    """Return the words for a plan without the weights of the task; none if it has them."""
    lost = any(getattr(task, name).any() and not getattr(plan.task, name).any()
               for name in ('position_weights', 'velocity_weights'))
    return ('; with the weights of the task on positions and speeds no motion near the limit was '
            'solved, so that the plan is without them') if lost else ''
