"""
How far a motion stays from its limits on the way, at the moment when it is nearest to each.

All limits count: joint angles, speeds and bending moments that the arm's file gives, and what the
task asks besides.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.problem import Indices
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion, slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import PathSlacks
import numpy as np

# by which a slack may be passed: less is rounding
MARGIN = 1e-6
# a limit is active where less than this share of its scale is left
ACTIVE = 0.01
# positions in an interval of the mesh, and around the smallest sample: each time the step is an
# eighth
_POSITIONS = np.linspace(0, 1, 25, dtype=np.float64)
_AROUND = np.linspace(-1, 1, 17, dtype=np.float64)
_ZOOMS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstraintMargin:
    """
    How near a motion comes to a limit on the way.

    Attributes
    ----------
    name : str
        Of the limit, e.g. ``'tip from post'``.
    constraint : int
        Index of the constraint it belongs to among the arm's own, then the task's
        `path_constraints`; then the motors of the joints, where torques are states.
    unit : str
        Of `margin`.
    margin : float
        What is left at the nearest, < 0 where the limit is passed [unit]. Of keep-outs, whose
        distance is rounded off at the centre, a little less than the distance where it is large.
    slack : float
        The same as a share of the limit's scale.
    time : float
        When [s].
    active : tuple of (float, float)
        Times between which less than a hundredth of the scale is left [s].
    price : float
        What a unit more of room would save of J, to first order; 0 of a motion that was planned
        without limits.

    """

    name: str
    constraint: int
    unit: str
    margin: float
    slack: float
    time: float
    active: tuple[tuple[float, float], ...]
    price: float = 0.0

    @property
    def kept(self) -> bool:
        """Return whether the limit is kept, but for rounding."""
        return self.slack >= -MARGIN

    def __str__(self) -> str:
        """Return the margin in a few words."""
        if self.kept:
            return f'{self.name}: {self.margin:.3g} {self.unit} left at {self.time:.4g} s'
        return (f'{self.name}: {-self.margin:.3g} {self.unit} beyond the limit at '
                f'{self.time:.4g} s')


def find_margins(problem: MotionProblem,
                 solution: CollocationSolution) -> tuple[ConstraintMargin, ...]:
    """
    Return the margin of every limit on the way, in their order.

    Parameters
    ----------
    problem : MotionProblem
        Its arm and its task have the limits.
    solution : CollocationSolution
        The motion, whose polynomials are looked at on a grid that is finer than the mesh, and
        finer still around the smallest value.

    """
    slacks = slacks_of(problem)
    if slacks is None:
        return ()
    times = solution.times_at(_POSITIONS)
    which = problem.layout.states
    states = solution.values_at(_POSITIONS)[..., which]
    values = slacks(states.reshape(-1, which.size))  # (N * 25, n_c)
    prices = _find_prices(problem, solution, slacks)
    return tuple(_margin(k, slacks, solution, times.ravel(), values[:, k], prices[k], which)
                 for k in range(slacks.count))


def smallest_slack(problem: MotionProblem, states: Array, torques: Array) -> float:
    """
    Return the smallest slack of all limits; inf without limits.

    Parameters
    ----------
    problem : MotionProblem
        Of n joints.
    states, torques : numpy.ndarray, shape (k, 2 n_t) and (k, n), or (k, 0)
        Of the motion, at the same moments; torques where they are states.

    """
    slacks = slacks_of(problem)
    if slacks is None:
        return np.inf
    return float(slacks(np.hstack([states, torques])).min())


def _margin(k: int, slacks: PathSlacks, solution: CollocationSolution, times: Array,
            values: Array, price: float, which: Indices) -> ConstraintMargin:
    """Return the margin of one slack, whose values at times are known."""
    label, nearest = slacks.labels[k], int(values.argmin())
    time, least = float(times[nearest]), float(values[nearest])
    step = float(np.diff(solution.mesh).max()) / (_POSITIONS.size - 1)
    for _ in range(_ZOOMS if least < ACTIVE else 0):
        near = np.clip(time + step * _AROUND, solution.mesh[0], solution.mesh[-1])
        found = slacks(solution(near)[:, which])[:, k]
        if found.min() <= least:
            time, least = float(near[found.argmin()]), float(found.min())
        step *= 2 / (_AROUND.size - 1)
    return ConstraintMargin(
        name=label.name, constraint=slacks.owners()[k], unit=label.unit,
        margin=least * label.scale, slack=least, time=time,
        active=find_active(times, values), price=price / label.scale)


def find_active(times: Array, slacks: Array) -> tuple[tuple[float, float], ...]:
    """Return the times between which a limit is active, from its slack (k,) at times (k,)."""
    padded = np.concatenate([[False], slacks < ACTIVE, [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)
    return tuple((float(times[first]), float(times[last - 1])) for first, last in edges)


def _find_prices(problem: MotionProblem, solution: CollocationSolution,
                 slacks: PathSlacks) -> Array:
    """Return the integral of each multiplier, 0 of a motion planned without limits."""
    if not isinstance(problem, ConstrainedMotion):
        return np.zeros(slacks.count)
    z = solution.stage_values().reshape(-1, problem.size)
    weights = (solution.steps[:, None] * solution.rule.weights).ravel()
    prices: Array = weights @ problem.multipliers(z)
    return prices
