"""
Whether another kind of motion is cheaper than the one that a plan has found.

Newton's method explores the rigid arm from paths with detours and zero costates on a coarse mesh,
which takes some ten milliseconds a start. What is cheaper there is solved for the arm itself.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.collocation import CollocationResult, CollocationSolution, INTERRUPTED, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.kinds.clusters import (
    are_alike,
    cluster,
    kind_of,
    KindOfMotion,
)
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.explorer import ExploredMotion, sample_angles
from flex_planner.planning.kinds.paths import JointPath
from flex_planner.planning.kinds.search import has_settled, rigid_twin, starting_paths
from flex_planner.planning.strategies.initial_guesses import lift
import numpy as np

# of the coarse mesh, and of Newton's method on it
_STAGES, _INTERVALS, _MOST_INTERVALS, _TOLERANCE, _ITERATIONS, _MESHES = 4, 16, 64, 1e-2, 30, 3
# starts at most, and Newton iterations: of a rigid arm (some 0.8 ms each), and in units of what
# the plan of a flexible one took
_STARTS, _RIGID_BUDGET, _FLEXIBLE_BUDGET = 12, 500, 5
# another kind is worth solving if it is cheaper by this share, and so many are
_CHEAPER, _SOLVED = 0.01, 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheapestMotion:
    """
    The cheapest motion found.

    Attributes
    ----------
    result : CollocationResult
        Of the problem; the one that was given unless another is cheaper.
    kinds : tuple of KindOfMotion
        Its own kind first, then the others that were met.
    starts : int
        How many starts were tried, that of the motion given included.

    """

    result: CollocationResult
    kinds: tuple[KindOfMotion, ...]
    starts: int


def find_cheaper(problem: MotionProblem, found: CollocationResult, solver: Solver,
                 effort: SearchEffort = SearchEffort.NORMAL) -> CheapestMotion:
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
    effort : SearchEffort
        ``THOROUGH`` takes all starts; else they end within a budget of iterations, or once the
        cheapest kind came twice.

    """
    rigid = rigid_twin(problem)
    own = _as_kind(problem, found.solution)
    if rigid is None:
        return CheapestMotion(result=found, kinds=(own,), starts=1)
    motions, starts = _explore(problem, rigid, own, solver, effort)
    kinds = cluster(motions, lambda value, other: value < other)
    for kind in _cheaper_kinds(kinds, own)[:_SOLVED]:
        result = solver.solve(problem, _guess(problem, kind.motion.solution, solver))
        if result.status in INTERRUPTED:
            break
        if result.converged:
            other = _as_kind(problem, result.solution)
            if other.value < own.value:
                found, own = result, other
    others = [kind for kind in kinds if not are_alike(kind.motion.angles, own.motion.angles)]
    same = sum(kind.met for kind in kinds if kind not in others)
    return CheapestMotion(result=found, starts=starts,
                          kinds=(replace(own, met=max(same, 1)), *others))


def _explore(problem: MotionProblem, rigid: MotionProblem, own: KindOfMotion, solver: Solver,
             effort: SearchEffort) -> tuple[list[ExploredMotion], int]:
    """Return motions of the rigid arm, its own included where it is rigid, and the starts."""
    finest = min(_MOST_INTERVALS, solver.settings.max_intervals)
    coarse = solver.with_settings(
        stages=_STAGES, intervals=min(_INTERVALS, finest), max_intervals=finest,
        error_tolerance=_TOLERANCE, max_iterations=_ITERATIONS, max_meshes=_MESHES)
    is_rigid, monitor = rigid is problem, solver.monitor
    motions = [own.motion] if is_rigid else []
    budget = _RIGID_BUDGET if is_rigid else _FLEXIBLE_BUDGET * monitor.iteration
    thorough = effort is SearchEffort.THOROUGH
    began, starts = monitor.iteration, 1
    for path in list(starting_paths(rigid, effort.starts if thorough else _STARTS))[is_rigid:]:
        enough = not thorough and (monitor.iteration - began >= budget
                                   or has_settled(motions, lambda value, other: value < other))
        if enough or monitor.stop_reason():
            break
        starts += 1
        monitor.phase = f'kinds of motion, start {starts}'
        motion = _solve_from_path(rigid, path, coarse)
        if motion is not None:
            motions.append(motion)
    return motions, starts


def _solve_from_path(rigid: MotionProblem, path: JointPath,
                     solver: Solver) -> ExploredMotion | None:
    """Return the rigid arm's motion that Newton's method finds from a path, or None."""
    duration = rigid.task.duration
    mesh = np.linspace(0, 1, solver.settings.intervals + 1, dtype=np.float64)
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


def _cheaper_kinds(kinds: list[KindOfMotion], own: KindOfMotion) -> list[KindOfMotion]:
    """Return the kinds that are cheaper than the plan's own, both taken as rigid if possible."""
    mine = next((kind for kind in kinds if are_alike(kind.motion.angles, own.motion.angles)), own)
    return [kind for kind in kinds if kind is not mine
            and kind.value < (1 - _CHEAPER) * mine.value]


def _guess(problem: MotionProblem, rigid: CollocationSolution,
           solver: Solver) -> CollocationSolution:
    """Return a rigid arm's motion as a guess for the arm itself."""
    return lift(problem, rigid, solver) if problem.model.arm.n_modes else rigid
