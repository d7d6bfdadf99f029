"""
Where the motions of two neighbouring tasks lead: a guess for the next one along the line.

At the limit of the motors a motion hardly differs from its neighbour's but for the times at which
the motors switch. Between two instants, values at the same time are those before and after a
switch, and Newton's method fails. So the time of each motion is bent first until its switches are
where they will be; then values, too, are continued along a straight line.

"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

from flex_planner.base.validation import Array, number
from flex_planner.capacity.bracket import (
    bracket_width,
    collect_to_limit,
    continuation_solver,
    is_near_limit,
)
from flex_planner.capacity.results import LimitResult
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.collocation.mesh import defects, level_mesh
from flex_planner.optimal_control.motion_problem import Indices, MotionProblem
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.free_parameters import FreeParameter
from flex_planner.planning.strategies.price_continuation import continue_in_price
import numpy as np

# of the span: nodes nearer than this to a switch are moved onto it
_SAME = 1e-6
# a good guess needs no more Newton iterations
_FEW = 10
# of the tolerance, what a mesh is made for; how much coarser than its predecessor it may be
_MARGIN, _COARSER = 0.1, 0.5
_MOST_RATIO = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Neighbours:
    """
    Searches of two tasks that lie on a line with a third one, which starts from them.

    Attributes
    ----------
    near, far : LimitResult or None
        Of the nearer task and of the one before it; without both nothing is extrapolated.
    ratio : float
        Of the step from `near` to the third task to the step from `far` to `near`, within +-100.

    Raises
    ------
    InvalidValueError
        If the ratio breaks its bound.

    """

    near: LimitResult | None = None
    far: LimitResult | None = None
    ratio: float = 1.0

    def __post_init__(self) -> None:
        number('ratio', self.ratio, at_least=-_MOST_RATIO, at_most=_MOST_RATIO)

    @property
    def extremals(self) -> tuple[Extremal, Extremal] | None:
        """Return the motions nearest to both limits, the farther task's first."""
        if self.near is None or type(self.near) is not type(self.far):
            return None
        if not (self.near.extremals and self.far.extremals):
            return None
        return self.far.extremals[-1], self.near.extremals[-1]


def step_ratio(far: float, near: float, here: float) -> float:
    """Return the step from near to here over that from far to near, as far as allowed."""
    return float(np.clip((here - near) / (near - far), -_MOST_RATIO, _MOST_RATIO))


def extrapolate_to_limit(parameter: FreeParameter, problem: MotionProblem, neighbours: Neighbours,
                         accuracy: float, solver: Solver) -> list[Extremal]:
    """
    Return the motions up to a limit, from the one that two searches lead to; else none.

    Parameters
    ----------
    parameter, problem, neighbours, solver
        As of `extrapolate_extremal`.
    accuracy : float
        To which the limit is wanted [kg, s].

    """
    first = extrapolate_extremal(parameter, problem, neighbours, solver)
    if first is None:
        return []
    further = () if first.interrupted else continue_in_price(
        parameter, first.problem, first.result, continuation_solver(solver, accuracy),
        lambda value: bracket_width(accuracy, value))
    extremals = collect_to_limit(chain([first], further), accuracy)
    near = extremals[-1].interrupted or is_near_limit(extremals, accuracy)
    return extremals if near else []


def extrapolate_extremal(parameter: FreeParameter, problem: MotionProblem,
                         neighbours: Neighbours, solver: Solver) -> Extremal | None:
    """
    Return the motion at a limit that those of two tasks on a line lead to, or None.

    At the price of the later one, and as exact as a plan has to be.

    Parameters
    ----------
    parameter : FreeParameter
        What is free.
    problem : MotionProblem
        With the least demanding value that is of interest.
    neighbours : Neighbours
        The two tasks.
    solver : Solver
        Of the extremal.

    """
    if neighbours.extremals is None or problem.junctions.size:
        return None
    (before, here), ratio = neighbours.extremals, neighbours.ratio
    if not before.result.solution.nodes.shape[1] == here.problem.size == problem.size:
        return None
    value = max(here.value + ratio * (here.value - before.value), 0.0)

    def guess(near: MotionProblem) -> CollocationSolution:
        return extrapolate(thin_out(before, solver), thin_out(here, solver), ratio,
                           near.task.duration)

    return parameter.solve_beyond(problem, value, guess, here.price, solver.patient(_FEW))


def thin_out(extremal: Extremal, solver: Solver) -> SwitchedMotion:
    """Return a motion on as few intervals as its exactness needs: else meshes only grow."""
    solution, result = extremal.result.solution, extremal.result
    error = float(result.errors.max()) / (_MARGIN * solver.settings.error_tolerance)
    growth = float(np.clip(error ** (1 / (2 * solution.rule.stages)), _COARSER, 1.0))
    mesh = level_mesh(solution, defects(extremal.problem, solution), growth, result.switches,
                      fewest=extremal.problem.fewest_intervals(solution.rule.stages),
                      most=solution.intervals)
    return SwitchedMotion.of(extremal.problem, solution.on_mesh(mesh), result.switches)


@dataclass(frozen=True, slots=True, eq=False)
class SwitchedMotion:
    """
    A motion with its switches.

    Attributes
    ----------
    solution : CollocationSolution
        Of a `MotionProblem`.
    times : numpy.ndarray, shape (k,)
        When motors reach or leave their limits.
    kinds : numpy.ndarray of int, shape (k,)
        Which limit, see `MotionProblem.switches`.

    """

    solution: CollocationSolution
    times: Array
    kinds: Indices

    @classmethod
    def of(cls, problem: MotionProblem, solution: CollocationSolution,
           times: Array) -> SwitchedMotion:
        """Find out which limit is met at each of the times."""
        values = np.abs(problem.switches(times, solution(times))) if times.size else np.zeros(
            (0, 1))
        return cls(solution, times, values.argmin(axis=1))

    def stretch(self, span: float) -> SwitchedMotion:
        """Return the same motion stretched to another duration."""
        factor = span / self.solution.mesh[-1]
        return SwitchedMotion(self.solution.stretched(factor), self.times * factor, self.kinds)


def extrapolate(before: SwitchedMotion, here: SwitchedMotion, ratio: float,
                span: float) -> CollocationSolution:
    """
    Return the motion that two motions lead to.

    Between switches that both have, both are continued along a straight line; where one of them
    has more, such as a motor that leaves its limit for a moment, the later motion is kept.

    Parameters
    ----------
    before, here : SwitchedMotion
        Of two tasks on a line.
    ratio : float
        Of the step to come to the step between them.
    span : float
        Duration of the motion to come [s].

    """
    first, second = before.stretch(span), here.stretch(span)
    start, now, aim = _order(_match(first, second), ratio, span)
    there, other = _bend(second, now, aim), _bend(first, start, aim)
    other = other.on_mesh(there.mesh, there.rule)
    pieces = np.searchsorted(aim, there.mesh[:-1] + there.steps / 2) - 1
    strange = np.concatenate([_unmatched_pieces(first, start), _unmatched_pieces(second, now)])
    share = np.where(np.isin(pieces, strange), 0.0, ratio)
    nodes = there.nodes + np.append(share, share[-1])[:, None] * (there.nodes - other.nodes)
    stages = there.stages + share[:, None, None] * (there.stages - other.stages)
    return CollocationSolution(there.mesh, nodes, stages, there.rule)


def _match(first: SwitchedMotion, second: SwitchedMotion) -> Array:
    """Return the switches that both have, in the order of the second, shape (k, 2)."""
    pairs: list[tuple[float, float]] = []
    for kind in np.union1d(first.kinds, second.kinds):
        one, two = (list(each.times[each.kinds == kind]) for each in (first, second))
        count = min(len(one), len(two))
        pairs += zip(_longest(one, count), _longest(two, count), strict=False)
    return np.array(sorted(pairs, key=lambda pair: pair[1])).reshape(-1, 2)


def _order(pairs: Array, ratio: float, span: float) -> tuple[Array, Array, Array]:
    """Return both times of the pairs and those to come, ends included, each ascending."""
    kept = [(0.0, 0.0, 0.0)]
    for start, now in pairs:
        times = start, now, now + ratio * (now - start)
        if all(last + _SAME * span < time < span * (1 - _SAME)
               for last, time in zip(kept[-1], times, strict=True)):
            kept.append(times)
    start, now, aim = np.array([*kept, (span, span, span)]).T
    return start, now, aim


def _longest(times: list[float], count: int) -> list[float]:
    """Return so many of the times, or one less, without the shortest excursions."""
    while len(times) > count:
        k = int(np.argmin(np.diff(times))) if len(times) > 1 else 0
        times = times[:k] + times[k + 2:]
    return times


def _unmatched_pieces(motion: SwitchedMotion, breaks: Array) -> Indices:
    """Return the pieces between breaks that hold other switches of the motion."""
    pieces: Indices = np.searchsorted(breaks, motion.times[~np.isin(motion.times, breaks)]) - 1
    return pieces


def _bend(motion: SwitchedMotion, times: Array, aim: Array) -> CollocationSolution:
    """Return the motion with its time bent so that `times` come to lie at `aim`."""
    solution = _on_switches(motion.solution, motion.times)
    mesh: Array = np.interp(solution.mesh, times, aim)
    stages = solution.stages * (solution.steps / np.diff(mesh))[:, None, None]
    return CollocationSolution(mesh, solution.nodes, stages, solution.rule)


def _on_switches(solution: CollocationSolution, times: Array) -> CollocationSolution:
    """Return the function with nodes on the switches, moved there where some are near."""
    mesh = solution.mesh
    if not times.size:
        return solution
    inner = mesh[1:-1]
    apart = np.abs(inner[:, None] - times).min(axis=1) > _SAME * mesh[-1]
    nodes = np.concatenate([mesh[:1], np.sort(np.concatenate([inner[apart], times])), mesh[-1:]])
    return solution.on_mesh(nodes)
