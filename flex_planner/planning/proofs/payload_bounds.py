"""Payloads that no motion of a task exceeds: by the motors' power, and by their torque."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.planning.proofs.duration_bounds import energy_limits, SAFETY, way_by_power
from flex_planner.planning.proofs.motion_facts import MotionFacts
import numpy as np

# payloads below are not told from none [kg]
_LEAST = 1e-6


def payload_by_power(facts: MotionFacts) -> float:
    """Return the payload [kg] that the motors have not the power to exceed; inf for none."""
    if not (np.isfinite(facts.power) and facts.reaches and facts.knows_energies):
        return np.inf
    start, tip_mass = facts.start_energy, facts.tip_mass
    duration, way = facts.problem.task.duration, (1 - SAFETY) * facts.distances()[-1]

    def margin(payload: float) -> float:
        mass = payload + tip_mass
        if not (mass and way):
            return -np.inf
        return float(np.log(way / way_by_power(
            facts.power, start.ceiling(payload, tip_mass), mass, duration)))

    return min(_least_excluded(margin, 1e-9), _lifted_by_power(facts))


def _lifted_by_power(facts: MotionFacts) -> float:
    """Return the payload [kg] of a rigid arm that the motors can give the energy of its goal."""
    if not (facts.rigid and facts.stops):
        return np.inf
    start = facts.start_energy
    goal = facts.goal_energy
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
    margin = _margin_of_energy(facts)
    return np.inf if margin is None else _least_excluded(margin, 5e-3, known, carried)


def is_any_excluded(facts: MotionFacts) -> bool:
    """Return whether `payload_by_energy` is finite, which is quicker to tell."""
    margin = _margin_of_energy(facts)
    return margin is not None and margin(MAX_PAYLOAD) > 0


def _margin_of_energy(facts: MotionFacts) -> Callable[[float], float] | None:
    """
    Return a function of payloads that is positive if no motion carries that much or more.

    The logarithm of the time that it takes as a share of the duration; None if none is known.

    """
    if not (facts.rigid and facts.limited and facts.reaches):
        return None
    duration, way = facts.problem.task.duration, (1 - SAFETY) * facts.distances()[-1]

    def margin(payload: float) -> float:
        limits = energy_limits(facts, payload, duration, heavier=True)
        needed = limits.least_time(way * np.sqrt((payload + facts.tip_mass) / 2))
        return float(np.log(needed * (1 - SAFETY) / duration)) if needed else -np.inf

    return margin


def _least_excluded(margin: Callable[[float], float], accuracy: float,
                    known: float = MAX_PAYLOAD, carried: float = 0.0) -> float:
    """Return a payload whose margin is positive, close to the least one; inf for none [kg]."""
    margin = cache(margin)
    low = high = min(known, MAX_PAYLOAD)
    if not margin(high) > 0:
        return np.inf
    if _LEAST < carried < high:
        low = carried
    else:
        while low > _LEAST and margin(low) > 0:
            low, high = low / 4, low
        if low <= _LEAST and margin(0.0) > 0:
            return 0.0
    return _narrow(margin, low, high, accuracy)


def _narrow(margin: Callable[[float], float], low: float, high: float, accuracy: float) -> float:
    """
    Return the upper end of payloads around the least excluded one, closer than an accuracy.

    Steps aim a little beyond the zero of the secant, at the side of the farther end, so that
    both ends come close to it; a step that gains little is followed by a bisection.

    """
    width, slow = float(np.log1p(accuracy)), False
    while high > low * (1 + accuracy):
        gap = float(np.log(high / low))
        below, above = margin(low), margin(high)
        secant = not slow and -np.inf < below <= 0 and np.isfinite(above)
        share = -below / (above - below) if secant else 0.5
        if secant:
            share += (0.45 if share < 0.5 else -0.45) * width / gap
        middle = low * float(np.exp(share * gap))
        low, high = (low, middle) if margin(middle) > 0 else (middle, high)
        slow = secant and bool(np.log(high / low) > 0.5 * gap)
    return high
