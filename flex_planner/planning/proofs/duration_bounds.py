"""Durations that no motion of a task undercuts: by the motors' power, and by their torque."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

from flex_planner.base.validation import Array
from flex_planner.dynamics.rigid_inertia import largest_form, RigidInertia
from flex_planner.planning.proofs.energy_growth import EnergyGrowth, EnergyLimits
from flex_planner.planning.proofs.motion_facts import MotionFacts
import numpy as np

# of distances and durations: a thousand times what the integrals lose to rounding
SAFETY = 1e-6
# slopes of bounds of the growth of energy, times the duration that they are made for
_SLOPES = np.geomspace(0.05, 512.0, 30, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class DurationBound:
    """
    A duration that no motion undercuts.

    Parameters
    ----------
    seconds : float
        [s]; 0 for none.
    deed : str
        What takes so long, in words.

    """

    seconds: float = 0.0
    deed: str = ''


def bound_by_power(facts: MotionFacts) -> DurationBound:
    """Return the bound of any arm by the power of its motors, in closed form."""
    if not np.isfinite(facts.power):
        return DurationBound()
    payload = facts.problem.parameters.payload_mass
    bounds = [DurationBound(seconds=(1 - SAFETY) * facts.energy_needed() / facts.power,
                            deed=_lifting(payload))]
    if facts.reaches and facts.knows_energies:
        start = facts.start_energy.most(payload)
        mass, way = payload + facts.tip_mass, float(facts.distances()[-1])
        bounds.append(DurationBound(
            seconds=_least_time(facts.power, start, mass, way), deed=_moving(payload, way)))
    return max(bounds, key=lambda bound: bound.seconds)


def _least_time(power: float, start: float, mass: float, way: float) -> float:
    """Return the least T with int_0^T sqrt(2 (E + P t) / m) dt = d [s]."""
    reached = (start**1.5 + 1.5 * power * way * (1 - SAFETY) * np.sqrt(mass / 2))**(2 / 3)
    # what is small against the energy at the start is lost in rounding
    return float(max((1 - SAFETY) * (reached - start * (1 + 1e-12)) / power, 0.0))


def way_by_power(power: float, start: float, mass: float, duration: float) -> float:
    """
    Return how far a mass can come in a time: int_0^T sqrt(2 (E + P t) / m) dt [m].

    Parameters
    ----------
    power, start, mass, duration : float
        P [W], E at the start [J], m [kg], T [s].

    """
    gained = (start + power * duration)**1.5 - start**1.5
    return float(np.sqrt(2 / mass) * gained / (1.5 * power))


def bound_by_energy(facts: MotionFacts) -> DurationBound:
    """Return the bound of a rigid arm by the torques of its motors, see `energy_limits`."""
    best = DurationBound()
    if not (facts.rigid and facts.limited):
        return best
    payload, guess = facts.problem.parameters.payload_mass, facts.problem.task.duration
    for _ in range(2):
        limits = energy_limits(facts, payload, guess)
        for seconds, deed in _requirements(facts, limits, payload):
            if seconds > best.seconds:
                best = DurationBound(seconds=(1 - SAFETY) * seconds, deed=deed)
        if not best.seconds:
            return best
        guess = best.seconds
    return best


def energy_limits(facts: MotionFacts, payload: float, duration: float,
                  heavier: bool = False) -> EnergyLimits:
    """
    Return how the energy of a rigid arm can grow and be taken out.

    The power of driving motors, ``sum K_1 |w| - D w^2``, with kinetic energy E or less, is at
    most ``slope E + k^T (slope M / 2 + D)^-1 k / 4`` for every slope, some signs k of K_1 and
    some posture; with caps in the place of K_1, D is friction alone. When they brake, D has the
    other sign, and Coulomb friction adds to K_1.

    Parameters
    ----------
    facts : MotionFacts
        Of a rigid arm all of whose motors have limits.
    payload : float
        [kg].
    duration : float
        Of motions for which the bounds are to be close [s].
    heavier : bool
        Whether they are to hold for larger payloads, too: per inertia at the tip.

    """
    inertia, drag = facts.inertia(payload), np.diag(facts.drag)
    sets = inertia.lower_bounds(facts.stall)
    signs = np.array(list(product((1.0, -1.0), repeat=facts.stall.size - 1)))
    signs = np.hstack([np.ones((len(signs), 1)), signs])
    slopes = _SLOPES / duration
    driving = _growth(sets, drag, signs * facts.stall, slopes)
    if (facts.caps < facts.stall).any():
        driving = _growth(sets, np.diag(facts.friction), signs * facts.caps, slopes, driving)
    ends = [facts.start_energy]
    braking = EnergyGrowth.below(np.zeros(0), np.zeros(0))
    if facts.stops:
        braking = _braking(facts, inertia, sets, signs, slopes)
        if not heavier:  # the speed at which caps end may be less of a speed for them
            braking = _braking_below_caps(facts, inertia, sets, signs, slopes, braking)
        ends.append(facts.goal_energy)
    if np.isfinite(facts.power):
        driving = EnergyGrowth.below(np.append(driving.slopes, 0.0),
                                     np.append(driving.offsets, facts.power))
    energies = [end.ceiling(payload, facts.tip_mass) if heavier else end.most(payload)
                for end in ends]
    return EnergyLimits(driving, braking, energies[0], energies[1] if facts.stops else 0.0)


def _braking(facts: MotionFacts, inertia: RigidInertia, sets: tuple[Array, ...], signs: Array,
             slopes: Array) -> EnergyGrowth:
    """Return how fast energy is taken out on the motors' lines."""
    # with less slope than that, braking grows faster than the energy lets it
    drained = 2 * float(facts.drag @ inertia.joint_mobilities)
    return _growth(sets, -np.diag(facts.drag), signs * facts.held, slopes + drained)


def _braking_below_caps(facts: MotionFacts, inertia: RigidInertia, sets: tuple[Array, ...],
                        signs: Array, slopes: Array, lines: EnergyGrowth) -> EnergyGrowth:
    """
    Return how fast energy is taken out where motors brake with no more than their caps.

    A motor that is driven faster than ``(K_1 + cap) / K_2`` brakes with more. With so little
    energy that none is, the bounds of caps and lines hold both.

    """
    limits = facts.problem.parameters.torque_limits
    some = limits.capped
    if not some.any():
        return lines
    drag = np.where(some, facts.friction, facts.drag)
    held = np.where(some, limits.cap, facts.stall) + facts.held - facts.stall
    mobilities = inertia.joint_mobilities
    drained = 2 * float(drag @ mobilities)
    caps = _growth(sets, -np.diag(drag), signs * held, slopes + drained, lines)
    fastest = (facts.stall + limits.cap)[some] / limits.slope[some]
    return caps.until(float((fastest**2 / (2 * mobilities[some])).min()), lines)


def _growth(sets: tuple[Array, ...], drag: Array, torques: Array, slopes: Array,
            other: EnergyGrowth | None = None) -> EnergyGrowth:
    """Return the bound of growth by lines of these slopes, and by those of another bound."""
    steep = slopes[:, None, None, None]
    scaled = tuple(steep / 2 * matrices + drag for matrices in sets)
    offsets = largest_form(scaled, torques).max(-1) / 4
    if other is None:
        return EnergyGrowth.below(slopes, offsets)
    return EnergyGrowth.below(np.append(other.slopes, slopes), np.append(other.offsets, offsets))


def _requirements(facts: MotionFacts, limits: EnergyLimits,
                  payload: float) -> Iterator[tuple[float, str]]:
    """Return the times that parts of the motion take at least, with what they are."""
    inertia, n = facts.inertia(payload), facts.arm.n_joints
    if facts.reaches:
        mobilities = [*inertia.point_mobilities[:-1], inertia.carried_mobility]
        ways = facts.distances()
        for i in range(n):
            yield (_time_for(limits, ways[i], mobilities[i]),
                   _moving(payload, ways[i]) if i == n - 1
                   else f'moving the end of link {i + 1} by {ways[i]:.3g} m')
    joints, links = facts.strokes()
    of_joints, of_links = inertia.joint_mobilities, inertia.turning_mobilities
    for i in np.flatnonzero(facts.hard_joints):
        yield (_time_for(limits, joints[i], of_joints[i]),
               f'turning joint {i + 1} by {np.degrees(joints[i]):.3g} deg')
        if i and facts.hard_joints[:i].all():
            yield (_time_for(limits, links[i], of_links[i]),
                   f'turning link {i + 1} by {np.degrees(links[i]):.3g} deg')
    if facts.stops:
        ends = [end.least(payload) for end in (facts.start_energy, facts.goal_energy)]
        yield limits.change_time(max(ends)), _lifting(payload)


def _time_for(limits: EnergyLimits, way: float, mobility: float) -> float:
    """Return the time that a way takes whose speed is at most sqrt(2 mobility E) [s]."""
    if not np.isfinite(mobility):
        return 0.0
    return limits.least_time(way * (1 - SAFETY) / np.sqrt(2 * mobility))


def _moving(payload: float, way: float) -> str:
    carried = f'{payload:.4g} kg' if payload else 'the tip'
    return f'moving {carried} by {way:.3g} m'


def _lifting(payload: float) -> str:
    with_payload = f' with {payload:.4g} kg' if payload else ''
    return f'bringing the arm{with_payload} to the energy of its goal'
