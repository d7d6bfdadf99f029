"""
Motions of least effort of a rigid arm from many starts, by Newton's method on a coarse mesh.

It begins on paths with zero costates and takes some ten milliseconds a start.

"""

from __future__ import annotations

from contextlib import closing, suppress
from dataclasses import dataclass

from flex_planner.base.progress import StoppedError
from flex_planner.collocation import CollocationResult, CollocationSolution, Solver
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.kinds.clusters import kind_of, KindOfMotion
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.explorer import ExploredMotion, Explorer, sample_angles
from flex_planner.planning.kinds.paths import JointPath
from flex_planner.planning.kinds.search import (
    explore_near_limit,
    has_settled,
    is_better,
    rigid_twin,
    starting_paths,
)
from flex_planner.planning.kinds.windings import other_windings
import numpy as np

# of the coarse mesh, and of Newton's method on it
_STAGES, _INTERVALS, _MOST_INTERVALS, _TOLERANCE, _ITERATIONS, _MESHES = 4, 16, 64, 1e-2, 30, 3
# starts at most, and Newton iterations of some 0.8 ms each
_STARTS, _BUDGET, _LEAST_BUDGET = 16, 500, 10
# where Newton's method converges from less than this share of so many starts, IPOPT goes on
_FEW, _JUDGED, _BY_IPOPT = 0.5, 8, 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OtherWay:
    """
    Another way round to a point.

    Attributes
    ----------
    problem : MotionProblem
        Of the arm, its goal turned.
    motion : ExploredMotion
        The straight motion of the rigid arm on it.

    """

    problem: MotionProblem
    motion: ExploredMotion


def explore_from_plan(rigid: MotionProblem, own: KindOfMotion | None, budget: int, solver: Solver,
                      effort: SearchEffort, *, hard: bool) -> tuple[list[ExploredMotion], int]:
    """
    Return motions of least effort of a rigid arm, and from how many starts.

    Parameters
    ----------
    rigid : MotionProblem
        The motion.
    own : KindOfMotion or None
        A motion that is known already, that of the straight start.
    budget : int
        Newton iterations.
    solver : Solver
        Its monitor may end the exploration.
    effort : SearchEffort
        ``THOROUGH`` takes all starts, whatever the budget and what was met.
    hard : bool
        Whether IPOPT is asked, too; it is if Newton's method seldom converges.

    """
    thorough = effort is SearchEffort.THOROUGH
    paths = list(starting_paths(rigid, effort.starts if thorough else _STARTS))
    motions = [] if own is None else [own.motion]
    # of an arm that bends this would take longer than its plan
    by_ipopt = own is not None
    motions, starts = _explore(rigid, paths[len(motions):], motions,
                               None if thorough else budget, solver, patient=not by_ipopt)
    if by_ipopt and (hard or _seldom_converges(motions, starts)):
        motions, starts = _explore_by_ipopt(rigid, paths[:_BY_IPOPT], motions, starts, solver)
    return motions, starts


def explore_other_ways(problem: MotionProblem, solver: Solver) -> list[OtherWay]:
    """Return straight motions of the rigid arm to a point, the other ways round."""
    found = []
    for other in other_windings(problem):
        rigid = rigid_twin(other)
        if rigid is None or solver.monitor.stop_reason():
            continue
        straight = next(starting_paths(rigid, 1))
        motion = _solve_from_path(rigid, straight, _coarse(solver))
        if motion is not None:
            found.append(OtherWay(problem=other, motion=motion))
    return found


def newton_budget(problem: MotionProblem, found: CollocationResult) -> int:
    """Return as many iterations for a rigid arm as take about as long as a plan's own did."""
    if not problem.model.arm.n_passive:
        return _BUDGET
    points = found.solution.intervals * found.solution.rule.stages
    own = found.iterations * points / (_INTERVALS * _STAGES)
    return int(np.clip(own, _LEAST_BUDGET, _BUDGET))


def as_kind(problem: MotionProblem, solution: CollocationSolution) -> KindOfMotion:
    """Return a solution as a kind that was met once."""
    angles = sample_angles(solution.mesh, solution.nodes, problem.model.arm.n_joints)
    return kind_of(ExploredMotion(
        value=integrate_totals(problem, solution).cost, price=0.0, angles=angles,
        problem=problem, solution=solution))


def _explore(rigid: MotionProblem, paths: list[JointPath], motions: list[ExploredMotion],
             budget: int | None, solver: Solver, *, patient: bool,
             ) -> tuple[list[ExploredMotion], int]:
    """
    Return motions known and met, until they have settled or the budget is used, if any.

    Without patience it also ends where Newton's method seldom converges.

    """
    coarse, monitor, starts = _coarse(solver), solver.monitor, len(motions)
    began = monitor.iteration
    for path in paths:
        enough = budget is not None and (
            monitor.iteration - began >= budget
            or has_settled(motions, starts, is_better(Free.NOTHING))
            or not patient and starts >= _JUDGED and _seldom_converges(motions, starts))
        if enough or monitor.stop_reason():
            break
        starts += 1
        monitor.phase = f'kinds of motion, start {starts}'
        motion = _solve_from_path(rigid, path, coarse)
        if motion is not None:
            motions.append(motion)
    return motions, starts


def _seldom_converges(motions: list[ExploredMotion], starts: int) -> bool:
    """Return whether Newton's method finds a motion from few of its starts."""
    return len(motions) < _FEW * starts


def _explore_by_ipopt(rigid: MotionProblem, paths: list[JointPath], motions: list[ExploredMotion],
                      starts: int, solver: Solver) -> tuple[list[ExploredMotion], int]:
    """Return motions known and met, as far as it comes in time."""
    monitor, every = solver.monitor, list(motions)
    explorer = Explorer(rigid, Free.NOTHING, monitor,
                        most_intervals=solver.settings.max_intervals)
    with closing(explorer.explore(paths)) as found, suppress(StoppedError):
        for _ in paths:
            starts += 1
            monitor.phase = f'kinds of motion, start {starts}'
            motion = next(found)
            every += [] if motion is None else [motion]
        if len(every) == len(motions):
            for motion in explore_near_limit(rigid, solver):
                starts += 1
                every.append(motion)
    return every, starts


def _coarse(solver: Solver) -> Solver:
    """Return a solver for motions that are compared."""
    finest = min(_MOST_INTERVALS, solver.settings.max_intervals)
    return solver.with_settings(
        stages=_STAGES, intervals=min(_INTERVALS, finest), max_intervals=finest,
        error_tolerance=_TOLERANCE, max_iterations=_ITERATIONS, max_meshes=_MESHES)


def _solve_from_path(rigid: MotionProblem, path: JointPath,
                     solver: Solver) -> ExploredMotion | None:
    """Return the rigid arm's motion that Newton's method finds from a path, or None."""
    duration = rigid.task.duration
    mesh = np.linspace(0, 1, solver.settings.intervals + 1, dtype=np.float64)
    q, v, _ = path(mesh, duration)
    nodes = np.hstack([q, v, np.zeros((mesh.size, rigid.size // 2))])
    guess = CollocationSolution.from_values(mesh * duration, nodes, solver.settings.rule)
    result = solver.solve(rigid, guess)
    return as_kind(rigid, result.solution).motion if result.converged else None
