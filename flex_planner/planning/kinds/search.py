"""The kinds of motion of a task, from many starts: for a limit, and for a plan that is hard."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from itertools import chain, islice

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import Solver
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import cluster, kind_of, KindOfMotion, merge
from flex_planner.planning.kinds.explorer import ExploredMotion, Explorer
from flex_planner.planning.kinds.paths import fixed_paths, JointPath, random_paths
from flex_planner.planning.strategies.initial_guesses import rigid_problem
from flex_planner.planning.way_limits import find_limit_violations
import numpy as np

# kinds that are confirmed on finer meshes, and how many are tried for that
_CONFIRMED, _TRIED = 3, 8
# an exploration for a plan ends once the best value came so often, after some starts; IPOPT, which
# leaves bad paths for good ones, needs fewer of them
_FEWEST, _FEWEST_BY_IPOPT, _OFTEN, _SAME = 8, 5, 3, 0.01


def find_kinds(problem: MotionProblem, free: Free, starts: int,
               solver: Solver) -> list[KindOfMotion]:
    """
    Return the kinds of motion of a task, taken as rigid, the best first.

    Parameters
    ----------
    problem : MotionProblem
        Of the arm, rigid or not.
    free : Free
        Payload or duration for the limit of a task; nothing for motions of least effort.
    starts : int
        How many starts to explore.
    solver : Solver
        Its monitor receives progress, and no mesh is larger than its settings allow.

    Returns
    -------
    list of KindOfMotion
        Values that stand on a mesh twice as fine, those that keep the arm's limits on the way
        before those that do not; empty where the rigid arm cannot do the task, or the goal is
        approached at a price only.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    rigid = rigid_twin(problem)
    if rigid is None or not starts:
        return []
    most = np.inf
    if free is Free.PAYLOAD:
        most = holding_limit(problem.model, problem.task, problem.parameters)[0]
    explorer = Explorer(rigid, free, solver.monitor, most, solver.settings.max_intervals)
    motions = list(_explore(explorer, rigid, free, starts, solver.monitor))
    better = is_better(free)
    kinds = _confirm(explorer, cluster(motions, better), better)
    return sorted(kinds, key=lambda kind: bool(find_limit_violations(
        kind.motion.problem, kind.motion.solution)))


def is_better(free: Free) -> Callable[[float, float], bool]:
    """Return whether a value is better than another: payloads count up, others down."""
    if free is Free.PAYLOAD:
        return lambda value, other: value > other
    return lambda value, other: value < other


def rigid_twin(problem: MotionProblem) -> MotionProblem | None:
    """Return the problem of the arm made rigid; None where that is no motion to explore."""
    if np.isfinite(problem.goal_weights).any():
        return None
    if not problem.model.arm.n_modes:
        return problem
    try:
        return rigid_problem(problem)
    except InvalidTaskError:  # motors that hold the bent arm may be too weak for the straight one
        return None


def starting_paths(problem: MotionProblem, count: int) -> Iterator[JointPath]:
    """Yield the first paths of an exploration of a rigid arm."""
    n, gravity = problem.model.arm.n_joints, bool(problem.model.arm.gravity.any())
    start, goal = problem.start[:n], problem.goal[:n]
    return islice(chain(fixed_paths(start, goal, gravity=gravity), random_paths(start, goal)),
                  count)


def has_settled(motions: list[ExploredMotion], starts: int,
                better: Callable[[float, float], bool], fewest: int = _FEWEST) -> bool:
    """Return whether the best value came often, after some starts."""
    if starts < fewest or not motions:
        return False
    best = motions[0].value
    for motion in motions:
        best = motion.value if better(motion.value, best) else best
    return sum(abs(one.value - best) <= _SAME * abs(best) for one in motions) >= _OFTEN


def _explore(explorer: Explorer, rigid: MotionProblem, free: Free, starts: int,
             monitor: Monitor) -> Iterator[ExploredMotion]:
    """Yield the motions met; for a limit from all starts, for a plan until it has settled."""
    met: list[ExploredMotion] = []
    monitor.phase = f'kinds of motion, start 1 of {starts}'
    with closing(explorer.explore(list(starting_paths(rigid, starts)))) as motions:
        for i, motion in enumerate(motions, 1):
            if motion is not None:
                met.append(motion)
                yield motion
            if free is Free.NOTHING and has_settled(
                    met, i, is_better(free), _FEWEST_BY_IPOPT):
                return
            monitor.phase = f'kinds of motion, start {min(i + 1, starts)} of {starts}'


def _confirm(explorer: Explorer, kinds: list[KindOfMotion],
             better: Callable[[float, float], bool]) -> list[KindOfMotion]:
    """Return the best kinds with values that stand on finer meshes."""
    confirmed: list[KindOfMotion] = []
    for kind in kinds[:_TRIED]:
        if len(confirmed) >= _CONFIRMED and not better(kind.value, confirmed[-1].value):
            break
        motion = explorer.confirm(kind.motion)
        if motion is None:
            continue
        confirmed = merge(confirmed, replace(kind_of(motion), met=kind.met), better)
    return confirmed
