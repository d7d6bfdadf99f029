"""
Where the motions of two neighbouring tasks lead: a guess for the next one along the line.

At the limit of the motors a motion hardly differs from its neighbour's but for the times at which
the motors switch. Between two instants, values at the same time are those before and after a
switch, and Newton's method fails. So the time of each motion is bent first until its switches are
where they will be; then values, too, are continued along a straight line.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, number
from flex_planner.capacity.limit_search import collected, is_near, way_to, width
from flex_planner.collocation import CollocationSolution, SolverSettings
from flex_planner.collocation.mesh import defects, levelled
from flex_planner.optimal_control.motion_problem import Indices, MotionProblem
from flex_planner.planning.strategies.price_continuation import (
    changed,
    durations,
    Extremal,
    payloads,
    worth,
    worth_time,
)
import numpy as np

# of the span: nodes nearer than this to a switch are moved onto it
_SAME = 1e-6
# a good guess needs no more Newton iterations
_FEW = 10
# of the tolerance, what a mesh is made for; how much coarser than its predecessor it may be
_MARGIN, _COARSER = 0.1, 0.5
_MOST_RATIO = 100.0


def check_ratio(ratio: float) -> None:
    """Raise InvalidValueError unless motions may be continued so far."""
    number('ratio', ratio, at_least=-_MOST_RATIO, at_most=_MOST_RATIO)


def step_ratio(far: float, near: float, here: float) -> float:
    """Return the step from near to here over that from far to near, as far as allowed."""
    return float(np.clip((here - near) / (near - far), -_MOST_RATIO, _MOST_RATIO))


def continued_stops(problem: MotionProblem, before: Sequence[Extremal], here: Sequence[Extremal],
                    ratio: float, accuracy: float, settings: SolverSettings, monitor: Monitor, *,
                    payload: bool) -> list[Extremal]:
    """
    Return the motions up to a limit, from the one that two searches lead to; else none.

    Parameters
    ----------
    problem, ratio, settings, monitor, payload
        As of `foreseen`.
    before, here : sequence of Extremal
        Of the two searches, ending near the limits of their tasks.
    accuracy : float
        To which the limit is wanted [kg, s].

    """
    if not (before and here):
        return []
    first = foreseen(problem, before[-1], here[-1], ratio, settings, monitor, payload=payload)
    if first is None:
        return []
    family = payloads if payload else durations
    further = () if first.stopped else family(
        first.problem, first.result, way_to(accuracy, settings), monitor,
        lambda value: width(accuracy, value))
    stops = collected(chain([first], further), accuracy)
    return stops if stops[-1].stopped or is_near(stops, accuracy) else []


def foreseen(problem: MotionProblem, before: Extremal, here: Extremal, ratio: float,
             settings: SolverSettings,
             monitor: Monitor, *, payload: bool) -> Extremal | None:
    """
    Return the motion at a limit that those of two tasks on a line lead to, or None.

    At the price of the later one, and as exact as a plan has to be.

    Parameters
    ----------
    problem : MotionProblem
        With the least payload, or the longest duration, that is of interest.
    before, here : Extremal
        Near the limits of the two tasks.
    ratio : float
        Of the step to come to the step between them.
    settings, monitor
        Of the solver.
    payload : bool
        Whether the payload is free, else the duration.

    """
    if not before.result.solution.nodes.shape[1] == here.problem.size == problem.size:
        return None
    value = max(here.value + ratio * (here.value - before.value), 0.0)
    few = replace(settings, max_iterations=min(_FEW, settings.max_iterations))
    try:
        near = (changed(problem, payload_mass=value) if payload
                else changed(problem, duration=value))
        guess = continued(thinned(before, settings), thinned(here, settings), ratio,
                          near.task.duration)
        found = (worth if payload else worth_time)(near, guess, here.price, few, monitor)
    except FlexPlannerError:  # too heavy to hold, or no duration
        return None
    if found is None or found.stopped:
        return found
    beyond = (found.value > problem.task.payload_mass if payload
              else found.value < problem.task.duration)
    return found if beyond else None


def thinned(stop: Extremal, settings: SolverSettings) -> Switched:
    """Return a motion on as few intervals as its exactness needs: else meshes only grow."""
    solution, result = stop.result.solution, stop.result
    error = float(result.errors.max()) / (_MARGIN * settings.error_tolerance)
    growth = float(np.clip(error ** (1 / (2 * solution.rule.stages)), _COARSER, 1.0))
    mesh = levelled(solution, defects(stop.problem, solution), growth, result.switches,
                    fewest=stop.problem.fewest_intervals(solution.rule.stages),
                    most=solution.intervals)
    return Switched.of(stop.problem, solution.on_mesh(mesh), result.switches)


@dataclass(frozen=True, slots=True, eq=False)
class Switched:
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
           times: Array) -> Switched:
        """Find out which limit is met at each of the times."""
        values = np.abs(problem.switches(times, solution(times))) if times.size else np.zeros(
            (0, 1))
        return cls(solution, times, values.argmin(axis=1))

    def lasting(self, span: float) -> Switched:
        """Return the same motion stretched to another duration."""
        factor = span / self.solution.mesh[-1]
        return Switched(self.solution.stretched(factor), self.times * factor, self.kinds)


def continued(before: Switched, here: Switched, ratio: float,
              span: float) -> CollocationSolution:
    """
    Return what two motions lead to.

    Between switches that both have, both are continued along a straight line; where one of them
    has more, such as a motor that leaves its limit for a moment, the later motion is kept.

    Parameters
    ----------
    before, here : Switched
        Of two tasks on a line.
    ratio : float
        Of the step to come to the step between them.
    span : float
        Duration of the motion to come [s].

    """
    first, second = before.lasting(span), here.lasting(span)
    start, now, aim = _in_order(_matched(first, second), ratio, span)
    there, other = _bent(second, now, aim), _bent(first, start, aim)
    other = other.on_mesh(there.mesh, there.rule)
    pieces = np.searchsorted(aim, there.mesh[:-1] + there.steps / 2) - 1
    strange = np.concatenate([_strange(first, start), _strange(second, now)])
    share = np.where(np.isin(pieces, strange), 0.0, ratio)
    nodes = there.nodes + np.append(share, share[-1])[:, None] * (there.nodes - other.nodes)
    stages = there.stages + share[:, None, None] * (there.stages - other.stages)
    return CollocationSolution(there.mesh, nodes, stages, there.rule)


def _matched(first: Switched, second: Switched) -> Array:
    """Return the switches that both have, in the order of the second, shape (k, 2)."""
    pairs: list[tuple[float, float]] = []
    for kind in np.union1d(first.kinds, second.kinds):
        one, two = (list(each.times[each.kinds == kind]) for each in (first, second))
        count = min(len(one), len(two))
        pairs += zip(_longest(one, count), _longest(two, count), strict=False)
    return np.array(sorted(pairs, key=lambda pair: pair[1])).reshape(-1, 2)


def _in_order(pairs: Array, ratio: float, span: float) -> tuple[Array, Array, Array]:
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


def _strange(motion: Switched, breaks: Array) -> Indices:
    """Return the pieces between breaks that hold other switches of the motion."""
    pieces: Indices = np.searchsorted(breaks, motion.times[~np.isin(motion.times, breaks)]) - 1
    return pieces


def _bent(motion: Switched, times: Array, aim: Array) -> CollocationSolution:
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
