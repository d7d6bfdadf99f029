"""How far the links bend on a motion, against what a linear beam may."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import bent_distances, link_bends
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import Deflection
from flex_planner.optimal_control.sampled_motion import sample_motion
from flex_planner.optimal_control.task import Task
import numpy as np

# shares of a link's length. The model keeps the links' lengths and their small slopes: at a tenth
# the slope of a cantilever's tip is 0.15 rad and the tip 0.6 % nearer than it is taken to be, at
# 0.3 it is 0.45 rad and 5 %, so that not even masses and torques are right
NOTABLE, LARGEST = 0.1, 0.3
_STATIONS = 21
# of the share that the model holds: between stations a link may bend a little more
_LIMIT = 0.995 * LARGEST
_LIMITED = (0.25, 0.4, 0.5, 0.6, 0.75, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bending:
    """
    Where a link bends furthest.

    Attributes
    ----------
    link : int
        Index, from 0.
    moment : int
        Index of the posture.
    share : float
        Largest deflection of any of its points from the axis of its frame (the chord of a pinned
        link, the tangent at the base of a clamped one), as a share of its length [-].

    """

    link: int
    moment: int
    share: float


@lru_cache(maxsize=2)
def find_bending(problem: MotionProblem, solution: CollocationSolution) -> tuple[Bending, float]:
    """Return where a link bends furthest on a motion, and when [s]; the last ones are kept."""
    points, arm = sample_motion(problem, solution), problem.model.arm
    found = find_largest_bending(arm, points.z[:, :arm.n_coordinates])
    return found, float(points.times[found.moment])


def find_largest_bending(arm: Arm, coordinates: Array) -> Bending:
    """
    Return where a link bends furthest for its length.

    Parameters
    ----------
    arm : Arm
        n_t coordinates.
    coordinates : numpy.ndarray, shape (k, n_t)
        Postures.

    """
    found = Bending(link=0, moment=0, share=0.0)
    for i, (link, modal) in enumerate(zip(arm.links, arm.modal_slices, strict=True)):
        if not link.modes:
            continue
        deflection = bent_distances(arm, i, coordinates[:, modal], _STATIONS)
        moment = int(deflection.max(axis=1).argmax())
        share = float(deflection[moment].max() / link.length)
        if share > found.share:
            found = Bending(link=i, moment=moment, share=share)
    return found


def limits_of_model(arm: Arm) -> tuple[Deflection, ...]:
    """Return how far the links of an arm may bend, as limits on the way."""
    return tuple(Deflection(link=i + 1, limit=_LIMIT, stations=_LIMITED)
                 for i, link in enumerate(arm.links)
                 if link_bends(arm, i, np.eye(link.modes)).any())  # others twist alone


def keeps_model(task: Task) -> bool:
    """Return whether a task is one that `bound_bending` has bounded."""
    limits = limits_of_model(task.arm)
    return bool(limits) and set(limits) <= set(task.path_constraints)
