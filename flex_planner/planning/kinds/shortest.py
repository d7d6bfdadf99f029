"""
Whether a rigid arm has too little time, by the shortest durations that many paths lead to.

The interior-point method takes some ten milliseconds for each, while IPOPT takes longest where
there is no motion to find.

"""

from __future__ import annotations

from collections.abc import Iterable

from flex_planner.collocation import CollocationSolution, GaussRule, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.paths import JointPath
from flex_planner.planning.strategies.free_parameters import DURATION
from flex_planner.planning.strategies.limit_barrier import limit_from_guess, STAGES
import numpy as np

_INTERVALS = 20
# the shortest duration must have come so often, within a share, and be longer by another
_OFTEN, _SAME, _LONGER = 3, 0.01, 0.003


def seems_too_short(rigid: MotionProblem, paths: Iterable[JointPath], solver: Solver) -> bool:
    """
    Return whether all durations found are longer than that of a task: a hint, no proof.

    Parameters
    ----------
    rigid : MotionProblem
        Of a rigid arm, without via points.
    paths : iterable of JointPath
        Where to start from.
    solver : Solver
        Its monitor may stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    durations = list[float]()
    for path in paths:
        found = limit_from_guess(DURATION, rigid, _guess(rigid, path), solver)
        if found is None:
            continue
        if found <= (1 + _LONGER) * rigid.task.duration:
            return False
        durations.append(found)
    return sum(one <= (1 + _SAME) * min(durations) for one in durations) >= _OFTEN


def _guess(rigid: MotionProblem, path: JointPath) -> CollocationSolution:
    """Return a path in the time of the task, with costates that are zero."""
    mesh = np.linspace(0, 1, _INTERVALS + 1, dtype=np.float64)
    q, v, _ = path(mesh, rigid.task.duration)
    nodes = np.hstack([q, v, np.zeros((mesh.size, rigid.size // 2))])
    return CollocationSolution.from_values(mesh * rigid.task.duration, nodes,
                                           GaussRule.of(STAGES))
