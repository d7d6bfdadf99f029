"""Which motions are of one kind, and how to say it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from flex_planner.arms.joint import Joint
from flex_planner.arms.joint_units import JointUnits, SLIDING, TURNING, units_of
from flex_planner.base.validation import Array
from flex_planner.planning.kinds.explorer import ExploredMotion
import numpy as np

# joint paths of one kind differ by less than this at every share of their times [rad]
_ALIKE = 0.35
# kinds that are shown
MOST_KINDS = 4
# a swing that is worth a word [rad], and how many are said
_SWING, _MOST_SWINGS = np.deg2rad(10.0), 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KindOfMotion:
    """
    A kind of motion that a search has met.

    Attributes
    ----------
    value : float
        J, the payload [kg] or the duration [s] of the best of its motions.
    sentence : str
        How it moves.
    met : int
        How many starts led to it.
    motion : ExploredMotion
        Its best motion; a start for `plan_path`.

    """

    value: float
    sentence: str
    met: int
    motion: ExploredMotion


def cluster(motions: Iterable[ExploredMotion],
            is_better: Callable[[float, float], bool]) -> list[KindOfMotion]:
    """Return the kinds among motions, the best first."""
    kinds: list[KindOfMotion] = []
    for motion in motions:
        kinds = merge(kinds, kind_of(motion), is_better)
    return kinds


def merge(kinds: list[KindOfMotion], kind: KindOfMotion,
          is_better: Callable[[float, float], bool]) -> list[KindOfMotion]:
    """Return kinds, the best first, with another one, which may be the same as one of them."""
    same = [one for one in kinds if are_alike(one.motion.angles, kind.motion.angles)]
    met = kind.met + sum(one.met for one in same)
    best = kind
    for one in same:
        best = one if is_better(one.value, best.value) else best
    merged = [*(one for one in kinds if one not in same), replace(best, met=met)]
    return sorted(merged, key=lambda one: one.value, reverse=is_better(1.0, 0.0))


def kind_of(motion: ExploredMotion) -> KindOfMotion:
    """Return the kind of a motion that was met once."""
    return KindOfMotion(value=motion.value, met=1, motion=motion,
                        sentence=describe_path(motion.angles, motion.problem.task.arm.joints))


def are_alike(one: Array, other: Array) -> bool:
    """Return whether joint paths (17, n) are of one kind."""
    return bool(np.abs(one - other).max() < _ALIKE)


def describe_path(angles: Array, joints: Sequence[Joint] = ()) -> str:
    """
    Return how the joints move, relative to their own strokes, angles (k, n) [rad].

    Joints turn unless they are given and slide.

    """
    units = [units_of(joint) for joint in joints] or [TURNING] * angles.shape[1]
    swings = [swing for i, (angle, unit) in enumerate(zip(angles.T, units, strict=True), 1)
              for swing in _swings(i, angle, unit)]
    largest = sorted(swings, key=lambda swing: swing[0], reverse=True)[:_MOST_SWINGS]
    return '; '.join(words for _, words in largest) or 'every joint goes straight to its goal'


def _swings(joint: int, angle: Array, units: JointUnits) -> list[tuple[float, str]]:
    """Return the swings of a joint behind its start and beyond its goal, with words."""
    stroke = angle[-1] - angle[0]
    along = (angle - angle[0]) * (1.0 if stroke >= 0 else -1.0)
    back, beyond = -float(along.min()), float(along.max() - abs(stroke))
    found = []
    if back > _SWING:
        first = beyond <= _SWING or along.argmin() < along.argmax()
        found.append((back, f'joint {joint} swings back {_say(back, units)} '
                            f'{"first" if first else "behind its start"}'))
    if beyond > _SWING:
        found.append((beyond, f'joint {joint} goes {_say(beyond, units)} too far and returns'))
    return found


def _say(way: float, units: JointUnits) -> str:
    """Return how far a joint moves, in words."""
    shown = units.scale * way
    return f'{shown:.2g} m' if units is SLIDING else f'{shown:.0f} {units.position}'
