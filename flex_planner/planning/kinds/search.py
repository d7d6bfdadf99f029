"""The kinds of motion of a task, from many starts: for a limit, and for a plan that is hard."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import replace
from itertools import chain, islice

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import Solver
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import are_alike, cluster, kind_of, KindOfMotion, merge
from flex_planner.planning.kinds.explorer import ExploredMotion, Explorer
from flex_planner.planning.kinds.paths import (
    AnyPath,
    DetourFrom,
    fixed_paths,
    JointPath,
    random_paths,
)
from flex_planner.planning.kinds.shortest import seems_too_short
from flex_planner.planning.strategies.initial_guesses import rigid_problem
from flex_planner.planning.way_limits import find_limit_violations
import numpy as np

# kinds that are confirmed on finer meshes, and how many are tried for that
_CONFIRMED, _TRIED = 3, 8
# an exploration for a plan ends once the best value came so often, after some starts; IPOPT, which
# leaves bad paths for good ones, needs fewer of them
_FEWEST, _FEWEST_BY_IPOPT, _OFTEN, _SAME = 8, 5, 3, 0.01
# starts of motions with a free payload, for one of least effort near the largest payload
_NEAR_STARTS = 16
# starts between which the best motion is looked up
_ROUND = 4
# starts in vain after which it is asked whether the time is too short
_IN_VAIN = 3


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
    search = _Search(explorer, is_better(free), starts, solver.monitor,
                     lambda: is_too_short(rigid, free, solver))
    if free is Free.NOTHING:
        search.explore_until_settled(rigid)
    else:
        search.explore_from_the_best(rigid)
    return sorted(search.best_kinds(), key=lambda kind: bool(find_limit_violations(
        kind.motion.problem, kind.motion.solution)))


def explore_near_limit(rigid: MotionProblem,
                       solver: Solver) -> Generator[ExploredMotion, None, None]:
    """
    Yield motions of least effort that others of the same arm with more or less payload lead to.

    Near the largest payload hardly a path leads to a motion of least effort, while motions with a
    free payload are easy to find.

    Parameters
    ----------
    rigid : MotionProblem
        Of the rigid arm.
    solver : Solver
        Its monitor may stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    most, finest = holding_limit(rigid.model, rigid.task, rigid.parameters)[0], (
        solver.settings.max_intervals)
    heavy = Explorer(rigid, Free.PAYLOAD, solver.monitor, most, finest)
    search = _Search(heavy, is_better(Free.PAYLOAD), _NEAR_STARTS, solver.monitor,
                     lambda: is_too_short(rigid, Free.PAYLOAD, solver))
    met = search.explore_paths(rigid)
    asked = Explorer(rigid, Free.NOTHING, solver.monitor, most_intervals=finest)
    for kind in cluster(met, is_better(Free.PAYLOAD)):
        yield from asked.adapt(kind.motion)


def is_too_short(rigid: MotionProblem, free: Free, solver: Solver) -> bool:
    """Return whether the time of a task seems too short, with no payload where that is free."""
    if free is Free.DURATION:
        return False
    asked = rigid.with_changes(payload_mass=0.0) if free is Free.PAYLOAD else rigid
    return seems_too_short(asked, starting_paths(rigid, _NEAR_STARTS), solver)


def is_better(free: Free) -> Callable[[float, float], bool]:
    """Return whether a value is better than another: payloads count up, others down."""
    if free is Free.PAYLOAD:
        return lambda value, other: value > other
    return lambda value, other: value < other


def rigid_twin(problem: MotionProblem) -> MotionProblem | None:
    """Return the problem of the arm made rigid; None where that is no motion to explore."""
    if np.isfinite(problem.goal_weights).any():
        return None
    if not problem.model.arm.n_passive:
        return problem
    try:
        return rigid_problem(problem)
    except InvalidTaskError:  # motors that hold the bent arm may be too weak for the straight one
        return None


def starting_paths(problem: MotionProblem, count: int) -> Iterator[JointPath]:
    """Yield the first paths of an exploration of a rigid arm."""
    n = problem.model.arm.n_joints
    return islice(chain(_fixed_paths(problem), random_paths(problem.start[:n], problem.goal[:n])),
                  count)


def _fixed_paths(problem: MotionProblem) -> Iterator[JointPath]:
    n, gravity = problem.model.arm.n_joints, bool(problem.model.arm.gravity.any())
    return fixed_paths(problem.start[:n], problem.goal[:n], gravity=gravity)


def has_settled(motions: list[ExploredMotion], starts: int,
                better: Callable[[float, float], bool], fewest: int = _FEWEST) -> bool:
    """Return whether the best value came often, after some starts."""
    if starts < fewest or not motions:
        return False
    best = motions[0].value
    for motion in motions:
        best = motion.value if better(motion.value, best) else best
    return sum(abs(one.value - best) <= _SAME * abs(best) for one in motions) >= _OFTEN


class _Search:
    """
    An exploration: what was met, and what stands on finer meshes.

    Parameters
    ----------
    explorer : Explorer
        Of the rigid arm.
    better : callable
        Whether a value is better than another.
    starts : int
        How many to explore.
    monitor : Monitor
        Receives progress.
    is_vain : callable
        Whether nothing may be found at all; asked once, where some starts led to nothing.

    """

    def __init__(self, explorer: Explorer, better: Callable[[float, float], bool], starts: int,
                 monitor: Monitor, is_vain: Callable[[], bool]) -> None:
        self._explorer, self._better, self._most = explorer, better, starts
        self._monitor, self._starts, self._is_vain = monitor, 0, is_vain
        self._in_vain = False
        self._met: list[ExploredMotion] = []
        # the best of a kind, and what was confirmed of it
        self._tried: list[tuple[ExploredMotion, ExploredMotion | None]] = []

    def explore_until_settled(self, rigid: MotionProblem) -> None:
        """Explore until the best motion came often, or all starts are used."""
        self._explore(starting_paths(rigid, self._most),
                      lambda: has_settled(self._met, self._starts, self._better,
                                          _FEWEST_BY_IPOPT))

    def explore_from_the_best(self, rigid: MotionProblem) -> None:
        """
        Explore the fixed paths, then detours from the best motion so far, in rounds.

        A better kind often lies near a good one: where the best of many kinds is met by one
        straight path with detours in thirty, several detours in ten from a good motion meet it.

        """
        others = starting_paths(rigid, self._most)
        self._explore(islice(others, sum(1 for _ in _fixed_paths(rigid))))
        while not self._in_vain and (paths := list(islice(others, _ROUND))):
            stands = self._confirm(kept=1)
            self._explore([DetourFrom(stands[0].motion.solution, path.detours) for path in paths]
                          if stands else paths)

    def explore_paths(self, rigid: MotionProblem) -> list[ExploredMotion]:
        """Explore all paths, and return what was met."""
        self._explore(starting_paths(rigid, self._most))
        return self._met

    def best_kinds(self) -> list[KindOfMotion]:
        """Return the best kinds with values that stand on finer meshes."""
        return self._confirm(kept=_CONFIRMED)

    def _explore(self, paths: Iterable[AnyPath],
                 enough: Callable[[], bool] = lambda: False) -> None:
        """Add what paths lead to, until it is enough."""
        self._announce()
        with closing(self._explorer.explore(list(paths))) as motions:
            for motion in motions:
                self._starts += 1
                self._met += [] if motion is None else [motion]
                if self._starts == _IN_VAIN and not self._met:
                    self._in_vain = self._is_vain()
                if self._in_vain or enough():
                    return
                self._announce()

    def _announce(self) -> None:
        now = min(self._starts + 1, self._most)
        self._monitor.phase = f'kinds of motion, start {now} of {self._most}'

    def _confirm(self, kept: int) -> list[KindOfMotion]:
        """Confirm the best kinds until so many stand, and none that is left may be better."""
        stands = self._standing()
        for kind in cluster(self._met, self._better)[:_TRIED]:
            if len(stands) >= kept and not self._better(kind.value, stands[kept - 1].value):
                break
            if not any(one is kind.motion for one, _ in self._tried):
                # of a kind that was confirmed before there is a better motion now
                self._tried = [pair for pair in self._tried
                               if not are_alike(pair[0].angles, kind.motion.angles)]
                self._tried.append((kind.motion, self._explorer.confirm(kind.motion)))
                stands = self._standing()
        return stands

    def _standing(self) -> list[KindOfMotion]:
        """Return the kinds whose values stand, the best first."""
        stands: list[KindOfMotion] = []
        for one, confirmed in self._tried:
            if confirmed is not None:
                met = sum(are_alike(each.angles, one.angles) for each in self._met)
                stands = merge(stands, replace(kind_of(confirmed), met=met), self._better)
        return stands
