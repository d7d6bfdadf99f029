"""What is proved for all motions of a task."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np


class ProofName(Enum):
    """Kinds of proofs; the value is shown to people."""

    HOLDING = 'holding at the goal'
    POWER = 'power of the motors'
    ENERGY = 'energy'


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """A proof."""

    name: ProofName
    sentence: str

    def __str__(self) -> str:
        """Return it in words."""
        return f'{self.sentence} ({self.name.name})'


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadBound:
    """A bound of the payload."""

    payload: float = np.inf
    proof: Proof | None = None
    joint: int | None = None


def find_proof(problem: MotionProblem) -> Proof | None:
    """Return the proof that a motion is impossible."""
    return None


def bound_payload(problem: MotionProblem) -> PayloadBound:
    """Return what no motion exceeds."""
    return PayloadBound()


def bound_duration(problem: MotionProblem) -> float:
    """Return what no motion falls below."""
    return 0.0
