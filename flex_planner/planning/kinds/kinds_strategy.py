"""Kinds of motion as a strategy: many starts of the rigid arm by IPOPT, for hard tasks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    INTERRUPTED,
    Solver,
)
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import cluster, KindOfMotion, merge
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.search import (
    explore_near_limit,
    find_kinds,
    is_better,
    is_too_short,
    rigid_twin,
)
from flex_planner.planning.strategies.homotopies import (
    drop_weights,
    has_weights,
    raise_weights_from,
)
from flex_planner.planning.strategies.initial_guesses import lift
from flex_planner.planning.strategies.interior_point import applies, pass_barrier_from
from flex_planner.planning.strategies.strategy import Attempt

# kinds that Newton's method is tried from
_TRIED = 3
# where a smaller share of the starts leads to a motion, and motors are on their limits, others
# are asked, too
_SELDOM = 0.25
_LESS = is_better(Free.NOTHING)
# a task is out of sight if the heaviest payload found, links included, is less than this share of
# its own, or the shortest duration more than its own by as much; of a flexible arm, whose rigid
# twin is explored, too
_NEAR, _NEAR_FLEXIBLE = 0.98, 0.9


def explore_kinds(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """Start from motions of the rigid arm that IPOPT finds from many paths, the cheapest first."""
    if problem.junctions.size:  # paths are looked for without via points
        return None
    bare = drop_weights(problem)
    rigid, starts = rigid_twin(bare), SearchEffort.NORMAL.starts
    if rigid is None:
        return None
    kinds = find_kinds(bare, Free.NOTHING, starts, solver)
    late = not kinds and is_too_short(rigid, Free.NOTHING, solver)
    seldom = sum(kind.met for kind in kinds) < _SELDOM * starts
    if seldom and not late and (not kinds or _reaches_limits(kinds[0])):
        near = cluster(explore_near_limit(rigid, solver), _LESS)
        kinds = reduce(lambda known, kind: merge(known, kind, _LESS), near, kinds)
    attempt = _solve_first(problem, bare, kinds, solver)
    if attempt.decides:
        return attempt
    wanted = problem.task.payload_mass
    # without a payload there is none to spare
    heaviest = find_kinds(bare, Free.PAYLOAD, starts, solver) if wanted or not late else []
    enough = [kind for kind in heaviest if kind.value >= wanted]
    again = _solve_first(problem, bare, enough, solver)
    again = replace(again, kinds=(*kinds, *again.kinds), starts=2 * starts)
    if again.decides:
        return again
    if again.kinds:  # motions of the rigid arm do the task: no limit speaks against it
        return replace(again, result=replace(again.result, message=_not_reached(again, attempt)))
    limits = _Limits(bare=bare, starts=starts, heaviest=heaviest,
                     shortest=find_kinds(bare, Free.DURATION, starts, solver))
    return replace(again, result=replace(again.result, message=limits.sentence),
                   not_found=True, hopeless=limits.hopeless)


def _reaches_limits(kind: KindOfMotion) -> bool:
    """Return whether motors reach their limits; a motion that needs no more is not near one."""
    motion = kind.motion.solution
    found = kind.motion.problem.controls(motion.mesh, motion.nodes)
    return bool((found.torque != found.free_torque).any())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Limits:
    """The heaviest payloads and the shortest durations that were found near a task."""

    bare: MotionProblem
    starts: int
    heaviest: list[KindOfMotion]
    shortest: list[KindOfMotion]

    @property
    def hopeless(self) -> bool:
        """Return whether both limits speak against the task."""
        task = self.bare.task
        near = _NEAR_FLEXIBLE if self.bare.model.arm.n_passive else _NEAR
        late = bool(self.shortest) and near * self.shortest[0].value > task.duration
        if not self.heaviest:
            return late
        # the price of payload goes with the mass of the links, so does the gap
        links = self.bare.model.arm.link_mass
        return late or self.heaviest[0].value + links < near * (task.payload_mass + links)

    @property
    def sentence(self) -> str:
        """Return what was found, and that it proves nothing."""
        task, parts = self.bare.task, []
        if self.heaviest and task.payload_mass:
            parts.append(f'the heaviest payload found in {task.duration:g} s is '
                         f'{self.heaviest[0].value:.4g} kg')
        if self.shortest:
            parts.append(f'the shortest duration found with {task.payload_mass:g} kg is '
                         f'{self.shortest[0].value:.4g} s')
        rigid = ' (of the arm made rigid)' if self.bare.model.arm.n_passive else ''
        found = f'{", ".join(parts)}{rigid}' if parts else 'nor near it'
        return (f'no motion with {task.payload_mass:g} kg in {task.duration:g} s was found from '
                f'{self.starts} starts; {found}. This does not show that there is none')


def _not_reached(again: Attempt, first: Attempt) -> str:
    """Say that motions were found, and why none of them leads to one that is exact."""
    last = first if again.kinds == first.kinds else again
    return (f'{len(again.kinds)} kinds of motion were found from {again.starts} starts on the arm '
            f'made rigid, but none leads to a solution: {last.result.message}')


def _solve_first(problem: MotionProblem, bare: MotionProblem, kinds: list[KindOfMotion],
                 solver: Solver) -> Attempt:
    """Return the first motion that Newton's method reaches from kinds, or the last failure."""
    result = CollocationResult.failed(bare.straight_line(
        solver.settings.intervals, solver.settings.rule), 'no kind of motion was found')
    for kind in kinds[:_TRIED]:
        result = _solve_from(problem, bare, kind, solver)
        if result.converged or result.status in INTERRUPTED:
            break
    return Attempt(result=result, kinds=tuple(kinds), starts=SearchEffort.NORMAL.starts)


def _solve_from(problem: MotionProblem, bare: MotionProblem, kind: KindOfMotion,
                solver: Solver) -> CollocationResult:
    """Solve a problem from a kind of motion: without its weights first, then with them."""
    weighted = has_weights(problem)
    first = solver.coarse() if weighted else solver
    result = first.solve(bare, as_guess(bare, kind, solver))
    if (applies(bare, solver) and not result.converged
            and result.status not in INTERRUPTED):
        result = pass_barrier_from(bare, _stretch(bare, kind), first)
    if not (weighted and result.converged):
        return result
    return raise_weights_from(problem, result.solution, solver)


def as_guess(problem: MotionProblem, kind: KindOfMotion, solver: Solver) -> CollocationSolution:
    """Return the motion of a kind as a guess, stretched to the duration, lifted if need be."""
    guess = _stretch(problem, kind)
    return guess if guess.nodes.shape[1] == problem.size else lift(problem, guess, solver)


def _stretch(problem: MotionProblem, kind: KindOfMotion) -> CollocationSolution:
    """Return the motion of a kind, stretched to the duration."""
    motion = kind.motion.solution
    return motion.stretched(problem.task.duration / motion.mesh[-1])
