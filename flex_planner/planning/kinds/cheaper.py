"""
Whether another kind of motion is cheaper than the one that a plan has found, or keeps limits.

Newton's method explores the rigid arm from paths with detours and zero costates on a coarse mesh,
which takes some ten milliseconds a start. What is cheaper there is solved for the arm itself.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.collocation import CollocationResult, CollocationSolution, INTERRUPTED, Solver
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.kinds.clusters import (
    are_alike,
    cluster,
    kind_of,
    KindOfMotion,
)
from flex_planner.planning.kinds.explorer import ExploredMotion, Explorer, sample_angles
from flex_planner.planning.kinds.paths import JointPath
from flex_planner.planning.kinds.search import has_settled, rigid_twin, starting_paths
from flex_planner.planning.kinds.windings import other_windings, say_turns
from flex_planner.planning.strategies.initial_guesses import lift
from flex_planner.planning.verdict import find_refusal
import numpy as np

# of the coarse mesh, and of Newton's method on it
_STAGES, _INTERVALS, _MOST_INTERVALS, _TOLERANCE, _ITERATIONS, _MESHES = 4, 16, 64, 1e-2, 30, 3
# starts at most, and Newton iterations: of a rigid arm (some 0.8 ms each), and in units of what
# the plan of a flexible one took
_STARTS, _RIGID_BUDGET, _FLEXIBLE_BUDGET = 16, 500, 5
# where Newton's method converges from less than this share of the starts, IPOPT tries the first
_FEW, _BY_IPOPT = 0.5, 4
# another kind is worth solving if it is cheaper by this share, and so many are
_CHEAPER, _SOLVED = 0.01, 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheapestMotion:
    """
    The cheapest motion found.

    Attributes
    ----------
    problem : MotionProblem
        The one that was given, or the same with its goal turned: another way round to a point.
    result : CollocationResult
        Of the problem; the one that was given unless another is cheaper, or keeps the arm's
        limits where that one does not.
    kinds : tuple of KindOfMotion
        Its own kind first, then the others that were met.
    starts : int
        How many starts were tried, that of the motion given included.

    """

    problem: MotionProblem
    result: CollocationResult
    kinds: tuple[KindOfMotion, ...]
    starts: int


def find_cheaper(problem: MotionProblem, found: CollocationResult,
                 solver: Solver) -> CheapestMotion:
    """
    Look for a cheaper kind of motion than one that is solved.

    Parameters
    ----------
    problem : MotionProblem
        Of the task.
    found : CollocationResult
        Its solution.
    solver : Solver
        Its monitor may end the search early: the best motion so far is returned.

    """
    rigid = rigid_twin(problem)
    own = _as_kind(problem, found.solution)
    if rigid is None:
        return CheapestMotion(problem=problem, result=found, kinds=(own,), starts=1)
    motions, starts = _explore(problem, rigid, own, solver)
    ways = _explore_other_ways(problem, solver)
    kinds = cluster([*motions, *(way.motion for way in ways)],
                    lambda value, other: value < other)
    kinds = [_with_turns(kind, problem, ways) for kind in kinds]
    best = _Best(problem=problem, result=found, kind=own,
                 refused=find_refusal(problem, found.solution) is not None)
    for kind in _worth_solving(kinds, own, best.refused):
        home = next((way.problem for way in ways if way.motion is kind.motion), problem)
        result = solver.solve(home, _guess(home, kind.motion.solution, solver))
        if result.status in INTERRUPTED:
            break
        if result.converged:
            best = best.or_better(home, result, kind)
    others = [kind for kind in kinds
              if not are_alike(kind.motion.angles, best.kind.motion.angles)]
    same = sum(kind.met for kind in kinds if kind not in others)
    return CheapestMotion(problem=best.problem, result=best.result, starts=starts + len(ways),
                          kinds=(replace(best.kind, met=max(same, 1)), *others))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Best:
    """The best motion of the arm itself so far, and whether the arm may not do it."""

    problem: MotionProblem
    result: CollocationResult
    kind: KindOfMotion
    refused: bool

    def or_better(self, home: MotionProblem, result: CollocationResult,
                  kind: KindOfMotion) -> _Best:
        """Return another solution if the arm may do it and it is cheaper, or the only such."""
        other = replace(_as_kind(home, result.solution), sentence=kind.sentence)
        kept = find_refusal(home, result.solution) is None
        if kept and (self.refused or other.value < self.kind.value):
            return _Best(problem=home, result=result, kind=other, refused=False)
        return self


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Way:
    """Another way round to a point, and the rigid arm's motion on it."""

    problem: MotionProblem
    motion: ExploredMotion


def _explore_other_ways(problem: MotionProblem, solver: Solver) -> list[_Way]:
    """Return straight motions of the rigid arm to a point, the other ways round."""
    found = []
    for other in other_windings(problem):
        rigid = rigid_twin(other)
        if rigid is None or solver.monitor.stop_reason():
            continue
        straight = next(starting_paths(rigid, 1))
        motion = _solve_from_path(rigid, straight, _coarse(solver))
        if motion is not None:
            found.append(_Way(problem=other, motion=motion))
    return found


def _with_turns(kind: KindOfMotion, problem: MotionProblem, ways: list[_Way]) -> KindOfMotion:
    """Return a kind whose sentence says if it goes another way round."""
    home = next((way.problem for way in ways if way.motion is kind.motion), problem)
    return replace(kind, sentence=say_turns(problem, home) or kind.sentence)


def _explore(problem: MotionProblem, rigid: MotionProblem, own: KindOfMotion,
             solver: Solver) -> tuple[list[ExploredMotion], int]:
    """Return motions of the rigid arm, its own included where it is rigid, and the starts."""
    is_rigid = rigid is problem
    paths = list(starting_paths(rigid, _STARTS))
    motions, starts = _explore_by_newton(
        rigid, paths[is_rigid:], [own.motion] if is_rigid else [],
        _RIGID_BUDGET if is_rigid else _FLEXIBLE_BUDGET * solver.monitor.iteration, solver)
    few = len(motions) < _FEW * starts or find_refusal(problem, own.motion.solution) is not None
    if is_rigid and few and not solver.monitor.stop_reason():
        explorer = Explorer(rigid, Free.NOTHING, solver.monitor)
        met = [explorer.explore(path) for path in paths[:_BY_IPOPT]]
        motions += [motion for motion in met if motion is not None]
        starts += _BY_IPOPT
    return motions, starts


def _explore_by_newton(rigid: MotionProblem, paths: list[JointPath],
                       motions: list[ExploredMotion], budget: int,
                       solver: Solver) -> tuple[list[ExploredMotion], int]:
    """Return motions known and met, until they have settled or a budget of iterations is used."""
    coarse, monitor, starts = _coarse(solver), solver.monitor, len(motions)
    began = monitor.iteration
    for path in paths:
        if (monitor.iteration - began >= budget or monitor.stop_reason()
                or has_settled(motions, starts, lambda value, other: value < other)):
            break
        starts += 1
        monitor.phase = f'kinds of motion, start {starts}'
        motion = _solve_from_path(rigid, path, coarse)
        if motion is not None:
            motions.append(motion)
    return motions, starts


def _coarse(solver: Solver) -> Solver:
    """Return a solver for motions that are compared."""
    return solver.with_settings(
        stages=_STAGES, intervals=_INTERVALS, max_intervals=_MOST_INTERVALS,
        error_tolerance=_TOLERANCE, max_iterations=_ITERATIONS, max_meshes=_MESHES)


def _solve_from_path(rigid: MotionProblem, path: JointPath,
                     solver: Solver) -> ExploredMotion | None:
    """Return the rigid arm's motion that Newton's method finds from a path, or None."""
    duration = rigid.task.duration
    mesh = np.linspace(0, 1, _INTERVALS + 1, dtype=np.float64)
    q, v, _ = path(mesh, duration)
    nodes = np.hstack([q, v, np.zeros((mesh.size, rigid.size // 2))])
    guess = CollocationSolution.from_values(mesh * duration, nodes, solver.settings.rule)
    result = solver.solve(rigid, guess)
    return _as_kind(rigid, result.solution).motion if result.converged else None


def _as_kind(problem: MotionProblem, solution: CollocationSolution) -> KindOfMotion:
    """Return a solution as a kind that was met once."""
    angles = sample_angles(solution.mesh, solution.nodes, problem.model.arm.n_joints)
    return kind_of(ExploredMotion(
        value=integrate_totals(problem, solution).cost, price=0.0, angles=angles,
        problem=problem, solution=solution))


def _worth_solving(kinds: list[KindOfMotion], own: KindOfMotion,
                   refused: bool) -> list[KindOfMotion]:
    """
    Return the kinds that may be better than the plan's own.

    Cheaper ones, both taken as rigid if possible; all others if the arm may not do its own.

    """
    mine = next((kind for kind in kinds if are_alike(kind.motion.angles, own.motion.angles)), own)
    others = [kind for kind in kinds if kind is not mine]
    if refused:
        return others
    return [kind for kind in others if kind.value < (1 - _CHEAPER) * mine.value][:_SOLVED]


def _guess(problem: MotionProblem, rigid: CollocationSolution,
           solver: Solver) -> CollocationSolution:
    """Return a rigid arm's motion as a guess for the arm itself."""
    return lift(problem, rigid, solver) if problem.model.arm.n_modes else rigid
