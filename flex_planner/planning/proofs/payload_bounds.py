"""Payloads that no motion of a task exceeds: by the motors' power, and by their torque."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.planning.proofs.duration_bounds import energy_limits, SAFETY, way_by_power
from flex_planner.planning.proofs.motion_facts import MotionFacts
import numpy as np

# payloads below are not told from none [kg]
_LEAST = 1e-6
# how far above what is carried a bound is looked for first
_FIRST_FACTOR = 1.1


def payload_by_power(facts: MotionFacts) -> float:
    """Return the payload [kg] that the motors have not the power to exceed; inf for none."""
    if not (np.isfinite(facts.power) and facts.reaches and facts.knows_energies):
        return np.inf
    start, tip_mass = facts.end_energy(facts.problem.start), facts.tip_mass()
    duration, way = facts.problem.task.duration, (1 - SAFETY) * facts.distances()[-1]

    def excluded(payload: float) -> bool:
        """Return whether no motion carries this payload or more."""
        mass = payload + tip_mass
        if not mass:
            return False
        reached = way_by_power(facts.power, start.ceiling(payload, tip_mass), mass, duration)
        return bool(reached < way)

    return min(_least_excluded(excluded, 1e-9), _lifted_by_power(facts))


def _lifted_by_power(facts: MotionFacts) -> float:
    """Return the payload [kg] of a rigid arm that the motors can give the energy of its goal."""
    if not (facts.rigid and facts.stops):
        return np.inf
    start = facts.end_energy(facts.problem.start)
    goal = facts.end_energy(facts.problem.goal)
    bare, one = (goal.least(payload) - start.most(payload) for payload in (0.0, 1.0))
    spare = facts.power * facts.problem.task.duration - bare
    return float(max(spare, 0.0) / (one - bare) * (1 + SAFETY)) if one > bare else np.inf


def payload_by_energy(facts: MotionFacts, known: float = MAX_PAYLOAD,
                      carried: float = 0.0) -> float:
    """
    Return the payload [kg] that no motion of a rigid arm exceeds, see `energy_limits`.

    Parameters
    ----------
    facts : MotionFacts
        Of the task.
    known : float
        A bound to be improved, infinite if it is not [kg].
    carried : float
        A payload that a motion carries: the search begins there [kg].

    """
    excluded = _excluded_by_energy(facts)
    return np.inf if excluded is None else _least_excluded(excluded, 5e-3, known, carried)


def is_any_excluded(facts: MotionFacts) -> bool:
    """Return whether `payload_by_energy` is finite, which is quicker to tell."""
    excluded = _excluded_by_energy(facts)
    return excluded is not None and excluded(MAX_PAYLOAD)


def _excluded_by_energy(facts: MotionFacts) -> Callable[[float], bool] | None:
    """Return whether no motion carries a payload or more, as a function; None if none is known."""
    if not (facts.rigid and facts.limited and facts.reaches):
        return None
    duration, way = facts.problem.task.duration, (1 - SAFETY) * facts.distances()[-1]
    tip_mass = facts.tip_mass()

    def excluded(payload: float) -> bool:
        limits = energy_limits(facts, payload, duration, heavier=True)
        needed = limits.least_time(way * np.sqrt((payload + tip_mass) / 2))
        return needed * (1 - SAFETY) > duration

    return excluded


def _least_excluded(excluded: Callable[[float], bool], accuracy: float,
                    known: float = MAX_PAYLOAD, carried: float = 0.0) -> float:
    """Return a payload that is excluded, close to the least one; inf for none [kg]."""
    low = high = min(known, MAX_PAYLOAD)
    if not excluded(high):
        return np.inf
    if _LEAST < carried < high:
        low, high = _bracket_above(excluded, carried, high)
    else:
        while low > _LEAST and excluded(low):
            low, high = low / 4, low
        if low <= _LEAST and excluded(0.0):
            return 0.0
    while high > low * (1 + accuracy):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if excluded(middle) else (middle, high)
    return high


def _bracket_above(excluded: Callable[[float], bool], low: float,
                   most: float) -> tuple[float, float]:
    """Return payloads around the least excluded one above a payload, `most` at most [kg]."""
    factor = _FIRST_FACTOR
    while (high := low * factor) < most and not excluded(high):
        low, factor = high, factor**2
    return low, min(high, most)
