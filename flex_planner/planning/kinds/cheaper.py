"""
Whether another kind of motion is cheaper than the one that a plan has found, or keeps limits.

What is cheaper by Newton's method on the rigid arm, see `newton_explorer`, is solved for the arm
itself.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from flex_planner.collocation import CollocationResult, CollocationSolution, INTERRUPTED, Solver
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import (
    are_alike,
    cluster,
    KindOfMotion,
    merge,
    MOST_KINDS,
)
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.explorer import ExploredMotion
from flex_planner.planning.kinds.newton_explorer import (
    as_kind,
    explore_from_plan,
    explore_other_ways,
    newton_budget,
    OtherWay,
)
from flex_planner.planning.kinds.search import is_better, rigid_twin
from flex_planner.planning.kinds.windings import say_turns
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.strategies.homotopies import has_weights
from flex_planner.planning.strategies.initial_guesses import lift
from flex_planner.planning.verdict import find_refusal

# another kind is worth solving if it is cheaper by this share, and so many are: a motion is called
# the cheapest beside the values of the others
_CHEAPER, _SOLVED = 1e-4, MOST_KINDS - 1


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


def find_cheaper(problem: MotionProblem, found: CollocationResult, solver: Solver,
                 effort: SearchEffort = SearchEffort.NORMAL,
                 known: Sequence[KindOfMotion] = ()) -> CheapestMotion:
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
        cheapest kind came three times.
    known : sequence of KindOfMotion
        What an exploration of the rigid arm has met already: another one is not begun then,
        unless this one was of another motion or leaves the arm's limits.

    """
    own, rigid = as_kind(problem, found.solution), rigid_twin(problem)
    if rigid is None:
        return CheapestMotion(problem=problem, result=found, kinds=(own,), starts=1)
    refusal = find_refusal(problem, found.solution)
    best = _Best(problem=problem, result=found, kind=own, refused=refusal is not None)
    # a motion that leaves a limit on the way can be bent
    hard = refusal is not None and refusal[0] is not PlanStatus.LIMIT_VIOLATED
    own_rigid = own if rigid is problem else None
    met = [kind for kind in known if _is_of(kind.motion, problem)]
    motions, starts = ([] if own_rigid is None else [own.motion]), 1
    if not met or best.refused or effort is SearchEffort.THOROUGH:
        motions, starts = explore_from_plan(rigid, own_rigid, newton_budget(problem, found),
                                            solver, effort, hard=hard)
    ways = explore_other_ways(problem, solver)
    better = is_better(Free.NOTHING)
    every = cluster([*motions, *(way.motion for way in ways)], better)
    for kind in met:
        every = merge(every, kind, better)
    kinds = [_with_turns(kind, problem, ways) for kind in every]
    for kind in _worth_solving(kinds, own, best.refused):
        home = next((way.problem for way in ways if way.motion is kind.motion), problem)
        result = solver.solve(home, _guess(home, kind.motion.solution, solver))
        if result.status in INTERRUPTED:
            break
        if result.converged:
            solved = as_kind(home, result.solution)
            best = best.or_better(home, result, solved, say_turns(problem, home))
            kinds[kinds.index(kind)] = _with_exact_value(kind, solved)
    return CheapestMotion(problem=best.problem, result=best.result, starts=starts + len(ways),
                          kinds=_list_kinds(best.kind, own, kinds))


def _is_of(motion: ExploredMotion, problem: MotionProblem) -> bool:
    """Return whether a motion of the rigid arm is one of least effort for a problem."""
    one, other = motion.problem.task, problem.task
    return (not motion.price and one.duration == other.duration
            and one.payload_mass == other.payload_mass and not has_weights(problem))


def _list_kinds(best: KindOfMotion, own: KindOfMotion,
                kinds: list[KindOfMotion]) -> tuple[KindOfMotion, ...]:
    """Return the kinds, the best first; of the arm's own motions the exact values count."""
    others = [kind for kind in kinds if not are_alike(kind.motion.angles, best.motion.angles)]
    met = max(sum(kind.met for kind in kinds if kind not in others), 1)
    exact = [replace(own, met=kind.met) if are_alike(kind.motion.angles, own.motion.angles)
             else kind for kind in others]
    return (replace(best, met=met), *exact)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Best:
    """The best motion of the arm itself so far, and whether the arm may not do it."""

    problem: MotionProblem
    result: CollocationResult
    kind: KindOfMotion
    refused: bool

    def or_better(self, home: MotionProblem, result: CollocationResult, solved: KindOfMotion,
                  turns: str) -> _Best:
        """Return another solution if the arm may do it and it is cheaper, or the only such."""
        better = self.refused or solved.value < self.kind.value
        if not better or find_refusal(home, result.solution) is not None:
            return self
        kind = replace(solved, sentence=turns or solved.sentence)
        return _Best(problem=home, result=result, kind=kind, refused=False)


def _with_exact_value(kind: KindOfMotion, solved: KindOfMotion) -> KindOfMotion:
    """Return a kind with the value of its exact motion, unless that is of another arm or kind."""
    same_arm = solved.motion.problem.model.arm is kind.motion.problem.model.arm
    alike = are_alike(kind.motion.angles, solved.motion.angles)
    return replace(kind, value=solved.value) if same_arm and alike else kind


def _with_turns(kind: KindOfMotion, problem: MotionProblem,
                ways: list[OtherWay]) -> KindOfMotion:
    """Return a kind whose sentence says if it goes another way round."""
    home = next((way.problem for way in ways if way.motion is kind.motion), problem)
    return replace(kind, sentence=say_turns(problem, home) or kind.sentence)


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
    return lift(problem, rigid, solver) if problem.model.arm.n_passive else rigid
