"""
What can be proved of all motions of a task, before one is looked for.

Every bound follows from the equations of motion and the motors' limits of eq. (15). Where a
premise does not hold there is none: payloads are then bounded by infinity, durations by 0.

"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flex_planner.base.errors import HoldingError
from flex_planner.optimal_control.holding import holding_bound
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.proofs.duration_bounds import (
    bound_by_energy,
    bound_by_power,
    DurationBound,
    SAFETY,
)
from flex_planner.planning.proofs.motion_facts import knows_bounds, MotionFacts
from flex_planner.planning.proofs.payload_bounds import (
    is_any_excluded,
    payload_by_energy,
    payload_by_power,
)
import numpy as np

# share of the duration from which on the bound by power calls for the closer one
_NEAR = 0.5
# square of a duration, in units of that of a constant acceleration over half of the way
_HASTY = 40.0


class ProofName(Enum):
    """What a proof rests on; the value is shown to people."""

    HOLDING = 'torque that holds the arm at its goal'
    POWER = 'power of the motors'
    ENERGY = 'energy that the torques of the motors can give and take'


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """
    Why no motion of a task exists, or none with more.

    Attributes
    ----------
    name : ProofName
        What it rests on.
    sentence : str
        In words, with numbers.

    """

    name: ProofName
    sentence: str

    def __str__(self) -> str:
        """Return it in words, with its name."""
        return f'{self.sentence} ({self.name.name})'


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadBound:
    """
    A payload that no motion of a task exceeds.

    Attributes
    ----------
    payload : float
        [kg]; infinite if nothing is proved.
    proof : Proof or None
        Why.
    joint : int or None
        Index of the joint that can hold no more, for ``HOLDING``.

    """

    payload: float = np.inf
    proof: Proof | None = None
    joint: int | None = None


def find_proof(problem: MotionProblem, *, thorough: bool = False) -> Proof | None:
    """
    Return the proof that no motion makes a task as it is given, if one is found.

    That the motors hold the arm at its goal is a premise of the problem, see
    `prove_not_held`.

    Parameters
    ----------
    problem : MotionProblem
        The task.
    thorough : bool
        Whether to look at the torques of the motors, which takes some milliseconds, where their
        power does not suggest it.

    """
    asked = problem.task.duration
    if problem.task.time_weight or not knows_bounds(problem.task.arm):
        return None
    facts = MotionFacts(problem)
    power = bound_by_power(facts)
    if power.seconds > asked:
        return Proof(name=ProofName.POWER, sentence=(
            f'the motors give at most {facts.power:.4g} W: {_too_short(power, asked)}'))
    if thorough or power.seconds > _NEAR * asked or _is_hasty(facts):
        energy = bound_by_energy(facts)
        if energy.seconds > asked:
            return Proof(name=ProofName.ENERGY, sentence=(
                f'within the torque of the motors {_too_short(energy, asked)}'))
    return None


def _is_hasty(facts: MotionFacts) -> bool:
    """Return whether motors with nothing but their joint to turn would be late, roughly."""
    if not (facts.rigid and facts.limited):
        return False
    payload = facts.problem.parameters.payload_mass
    mobilities = facts.inertia(payload).joint_mobilities
    hurry = facts.strokes()[0] / (mobilities * facts.stall.sum())
    return bool(_HASTY * hurry[facts.hard_joints].max(initial=0.0)
                > facts.problem.task.duration**2)


def bound_duration(problem: MotionProblem) -> float:
    """
    Return a duration [s] that no motion of a task undercuts; 0 if nothing is proved.

    Parameters
    ----------
    problem : MotionProblem
        Start, goal and payload; its duration does not matter.

    """
    if not knows_bounds(problem.task.arm):
        return 0.0
    facts = MotionFacts(problem)
    return max(bound(facts).seconds for bound in (bound_by_power, bound_by_energy))


def bound_payload(problem: MotionProblem, carried: float = 0.0) -> PayloadBound:
    """
    Return a payload that no motion of a task exceeds in its duration.

    Parameters
    ----------
    problem : MotionProblem
        Start, goal and duration; its payload does not matter.
    carried : float
        A payload that a motion carries, if one is known [kg].

    """
    bounds = [_bound_by_holding(problem)]
    if not problem.task.time_weight and knows_bounds(problem.task.arm):
        facts = MotionFacts(problem)
        bounds.append(_bounded(ProofName.POWER, payload_by_power(facts), facts))
        known = min(bound.payload for bound in bounds)
        bounds.append(_bounded(ProofName.ENERGY, payload_by_energy(facts, known, carried),
                               facts))
    return min(bounds, key=lambda bound: bound.payload)


def is_payload_bounded(problem: MotionProblem) -> bool:
    """Return whether `bound_payload` finds a bound, which takes a twentieth of its time."""
    if np.isfinite(_bound_by_holding(problem).payload):
        return True
    if problem.task.time_weight or not knows_bounds(problem.task.arm):
        return False
    facts = MotionFacts(problem)
    return bool(np.isfinite(payload_by_power(facts)) or is_any_excluded(facts))


def prove_not_held(error: HoldingError, payload: float) -> Proof:
    """
    Return the proof that a refused goal is.

    Parameters
    ----------
    error : HoldingError
        Of the problem that could not be made.
    payload : float
        That of its task [kg].

    """
    held = f'{payload:.4g} kg' if payload else 'the arm'
    needed, stall = _apart(abs(error.torque), error.stall)
    return Proof(name=ProofName.HOLDING, sentence=(
        f'joint {error.joint + 1} needs {needed} {error.unit} to hold {held} at the goal, its '
        f'motor gives {stall}: no motion can end there'))


def _bound_by_holding(problem: MotionProblem) -> PayloadBound:
    """Return the bound by what the motors hold at a goal where the arm comes to rest."""
    if not problem.task.ends_at_rest:
        return PayloadBound()
    limit, joint = holding_bound(problem.model, problem.task, problem.parameters)
    if not np.isfinite(limit):
        return PayloadBound()
    return PayloadBound(payload=limit * (1 + SAFETY), joint=joint, proof=Proof(
        name=ProofName.HOLDING,
        sentence=f'joint {joint + 1} can hold no more than {limit:.6g} kg at the goal'))


def _bounded(name: ProofName, payload: float, facts: MotionFacts) -> PayloadBound:
    """Return a bound of a payload with its sentence."""
    if not np.isfinite(payload):
        return PayloadBound()
    reason = (f'the motors give at most {facts.power:.4g} W: they' if name is ProofName.POWER
              else 'the torque of the motors')
    sentence = (f'{reason} can bring no more than {payload:.4g} kg to the goal in '
                f'{facts.problem.task.duration:.4g} s')
    return PayloadBound(payload=payload, proof=Proof(name=name, sentence=sentence))


def _too_short(bound: DurationBound, asked: float) -> str:
    """Say what takes longer than was asked for."""
    needed, given = _apart(bound.seconds, asked)
    return f'{bound.deed} takes at least {needed} s, and {given} s were asked for'


def _apart(more: float, less: float) -> tuple[str, str]:
    """Return two numbers with so many digits that they differ."""
    for digits in range(4, 17):
        texts = f'{more:.{digits}g}', f'{less:.{digits}g}'
        if texts[0] != texts[1]:
            break
    return texts
