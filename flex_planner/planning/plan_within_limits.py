"""
The plan of a task within its limits on the way, from its plan without them.

Where the free motion keeps all limits it is the plan. Else a motion within them is found from it,
from starts that pass obstacles on their other sides, and from other kinds of motion; the cheapest
is the plan, and all that were found are among its kinds.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from flex_planner.base.progress import StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    Solver,
)
from flex_planner.collocation.interior_point import BarrierOutcome
from flex_planner.optimal_control.constrained_motion import (
    ConstrainedMotion,
    end_states,
    relieve_ends,
    slacks_of,
)
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import KeepOut, PathSlacks
from flex_planner.planning.constraint_margins import find_margins, MARGIN
from flex_planner.planning.kinds.clusters import are_alike, KindOfMotion, MOST_KINDS
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.kinds_strategy import as_guess
from flex_planner.planning.kinds.newton_explorer import as_kind
from flex_planner.planning.kinds.obstacle_sides import find_obstacles, pass_otherwise, say_sides
from flex_planner.planning.kinds.windings import turn_goal
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import conclude, STOP_STATUS
from flex_planner.planning.strategies.interior_point import applies
from flex_planner.planning.strategies.payload_within_limits import find_largest_payload
from flex_planner.planning.strategies.strategy import Attempt
from flex_planner.planning.strategies.within_limits import (
    approach_limits,
    FIRST,
    first_mesh,
    solve_again,
    solve_smoothly,
    solve_within_limits,
    STAGES,
    STRONG,
)
import numpy as np

WITHIN_LIMITS = 'interior point within the limits'
# other kinds of motion that are tried, those cheaper by this share
_TRIED, _CHEAPER = 3, 1e-3
# share of its cost that a motion has at least, which is known on a coarse mesh only
_COARSE = 0.97
# a motion this far from all its limits was not bent by them
_FAR = 0.01
_SHARES = np.linspace(0, 1, 9, dtype=np.float64)


def check_ends(problem: MotionProblem) -> str:
    """Return which limit start or goal break and by how much; empty if they keep all."""
    slacks = slacks_of(problem)
    if slacks is None:
        return ''
    for end, values in zip(('start', 'goal'), slacks(end_states(problem)), strict=False):
        worst = int(values.argmin())
        if values[worst] < -MARGIN:
            label = slacks.labels[worst]
            return (f'the {end} breaks a limit that holds on the whole way: {label.name}, by '
                    f'{-values[worst] * label.scale:.3g} {label.unit}')
    return ''


def keep_limits(free: Plan, solver: Solver, effort: SearchEffort) -> Plan:
    """
    Return the plan within its limits on the way.

    Parameters
    ----------
    free : Plan
        Planned without them.
    solver : Solver
        Its monitor may interrupt the work.
    effort : SearchEffort
        Whether other kinds of motion are tried, too.

    Returns
    -------
    Plan
        The free one if it keeps its limits and no cheaper kind is known, or if it has no motion;
        with status ``LIMIT_VIOLATED`` and what the limits stand against if no motion was found.

    """
    slacks = slacks_of(free.problem)
    if slacks is None or free.solution is None or not free.certified or not applies(
            free.problem, solver):
        return free
    search = _Search(free, relieve_ends(free.problem, slacks), solver)
    began = solver.monitor.phase
    try:
        solver.monitor.phase = WITHIN_LIMITS
        search.run(effort)
        plan = search.conclude()
    except StoppedError as error:
        if free.solved:
            return free
        plan = replace(free, status=STOP_STATUS[error.reason], message=str(error))
    solver.monitor.phase = began
    return replace(plan, iterations=solver.monitor.iteration,
                   planning_time=solver.monitor.elapsed, tried=free.tried)


def plan_again_within(problem: MotionProblem, near: CollocationSolution, solver: Solver,
                      ) -> Plan | None:
    """Return the plan from a motion that limits have bent; None if they do not bend this one."""
    slacks = slacks_of(problem)
    if slacks is None or near.nodes.shape[1] != problem.size or not applies(problem, solver):
        return None
    stretched = near.stretched(problem.task.duration / near.mesh[-1])
    try:
        limited, result = solve_again(problem, relieve_ends(problem, slacks), stretched, solver)
    except StoppedError as error:
        return Plan(task=problem.task, status=STOP_STATUS[error.reason], message=str(error),
                    strategy=WITHIN_LIMITS, problem=problem, solution=None)
    if not result.converged:
        return None
    margins = find_margins(limited, result.solution)
    if min(one.slack for one in margins) > _FAR:
        return None
    plan = conclude(limited, WITHIN_LIMITS, Attempt(result=result), solver)
    if not plan.solved:
        return None
    return replace(_describe(plan), iterations=solver.monitor.iteration,
                   planning_time=solver.monitor.elapsed)


def plan_from(problem: MotionProblem, slacks: PathSlacks, near: CollocationSolution,
              solver: Solver) -> Plan | None:
    """
    Return the plan within limits that a motion near the limit of the motors leads to, or None.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    return plan_from_barrier(problem, slacks, approach_limits(problem, slacks, near, solver),
                             solver)


def plan_from_barrier(problem: MotionProblem, slacks: PathSlacks, met: BarrierOutcome,
                      solver: Solver) -> Plan | None:
    """
    Return the plan within limits that a motion with a barrier leads to, or None.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    return _plan(*solve_within_limits(problem, slacks, met, solver, coarse=True), solver)


def plan_smoothly(problem: MotionProblem, slacks: PathSlacks, met: BarrierOutcome,
                  solver: Solver) -> Plan | None:
    """
    Return the plan of a motion with a barrier as it is, the motors' limits in it, or None.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    return _plan(*solve_smoothly(problem, slacks, met, solver), solver)


def _plan(limited: ConstrainedMotion, result: CollocationResult, solver: Solver) -> Plan | None:
    """Return the plan of a motion within limits if it is solved and certified, or None."""
    if not result.converged:
        solver.monitor.check()
        return None
    plan = conclude(limited, WITHIN_LIMITS, Attempt(result=result), solver)
    return _describe(plan) if plan.solved else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Near:
    """A motion that keeps its limits at the points of a coarse mesh, and its kind."""

    problem: MotionProblem
    met: BarrierOutcome
    kind: KindOfMotion


@dataclass(frozen=True, slots=True, eq=False)
class _Start:
    """A motion to start from, what one that it leads to costs at least, and mu at first."""

    problem: MotionProblem
    solution: CollocationSolution
    bound: float = 0.0
    first: tuple[tuple[float, float], ...] = FIRST


class _Search:
    """Motions within the limits, from several starts."""

    def __init__(self, free: Plan, slacks: PathSlacks, solver: Solver) -> None:
        self._free, self._slacks, self._solver = free, slacks, solver
        self._starts = 0
        self._near: list[_Near] = []
        self._left_out: list[_Start] = []
        self._failed: CollocationSolution | None = None
        self._failure = ''

    def run(self, effort: SearchEffort) -> None:
        """Come near to a motion from each start that may lead to something cheaper."""
        for start in self._choose_starts(effort):
            if start.bound >= (1 - _CHEAPER) * self._best_cost():
                self._left_out.append(start)
            else:
                self._approach(start)

    def _approach(self, start: _Start) -> None:
        """Come near to a motion from a start."""
        self._starts += 1
        met = approach_limits(start.problem, self._slacks, start.solution, self._solver,
                              start.first, solved=start.solution is self._free.solution)
        if met.converged:
            self._add(start.problem, met)
        elif self._failed is None:
            self._failed = met.solution

    def conclude(self) -> Plan:
        """Return the plan of the cheapest motion that is found, of starts left out if need be."""
        plan = self._find_best()
        if plan is None and self._left_out:
            self._near.clear()
            for start in self._left_out:
                self._approach(start)
            plan = self._find_best()
        return plan or self._refuse(self._failure)

    def _find_best(self) -> Plan | None:
        """Return the plan of the cheapest motion that was come near to; None without any."""
        free, best = self._free, None
        order = sorted(self._near, key=lambda one: one.kind.value)
        exact: dict[int, KindOfMotion] = {}
        for one in order:
            if one.kind.value * _COARSE > min(best.cost if best else np.inf, self._most()):
                break
            plan = self._solve(one)
            if plan.status in STOP_STATUS.values():
                return plan if best is None else best
            if plan.solved:
                exact[id(one)] = replace(one.kind, value=plan.cost)
                best = plan if best is None or plan.cost < best.cost else best
            self._failure = self._failure or plan.message
        if best is None or (free.solved and free.cost <= best.cost):
            return free if free.solved else None
        kinds = sorted((exact.get(id(one), one.kind) for one in order),
                       key=lambda kind: kind.value)
        return _describe(replace(best, kinds=tuple(kinds)[:MOST_KINDS], starts=self._starts))

    def _solve(self, near: _Near) -> Plan:
        """Return the plan of a motion that is nearly found."""
        limited, result = solve_within_limits(near.problem, self._slacks, near.met, self._solver)
        if not result.converged and self._failed is None:
            self._failed = result.solution
        return conclude(limited, WITHIN_LIMITS, Attempt(result=result), self._solver)

    def _most(self) -> float:
        """Return what a motion may cost to be of use."""
        return self._free.cost if self._free.solved else np.inf

    def _choose_starts(self, effort: SearchEffort) -> Iterator[_Start]:
        """Yield the start of each try."""
        free = self._free
        assert free.solution is not None
        if not free.solved:
            yield _Start(free.problem, free.solution)
            for start in pass_otherwise(free.problem, free.solution,
                                        self._obstacles(free.solution)):
                yield _Start(free.problem, start)
        if not effort.explores:
            return
        if not free.solved:
            yield from self._start_far_from_limits(free.problem, free.solution)
        for kind in free.kinds[1:_TRIED + 1]:
            home = turn_goal(free.problem, kind.motion.problem)
            # values of the rigid arm are no bounds
            bound = kind.value if kind.motion.problem.size == home.size else 0.9 * kind.value
            start = as_guess(home, kind, self._solver)
            yield _Start(home, start, bound)
            if free.solved:  # which passes no obstacle that could be passed on its other side
                for other in pass_otherwise(home, start, self._obstacles(start)):
                    yield _Start(home, other, bound)
            if free.solved and not self._near and bound < (1 - _CHEAPER) * free.cost:
                for one in self._start_far_from_limits(home, start):
                    yield replace(one, bound=bound)

    def _start_far_from_limits(self, problem: MotionProblem,
                               near: CollocationSolution) -> Iterator[_Start]:
        """Yield starts whose barrier leads away from all limits at first."""
        yield _Start(problem, near, first=STRONG)
        yield from (_Start(problem, start) for start in self._keep_the_others(problem, near))
        intervals = len(first_mesh(problem, self._solver)) - 1
        yield _Start(problem, problem.straight_line(intervals, GaussRule.of(STAGES)),
                     first=STRONG)

    def _keep_the_others(self, problem: MotionProblem,
                         near: CollocationSolution) -> Iterator[CollocationSolution]:
        """Yield motions that keep all limits but obstacles, where a motion breaks both."""
        obstacles, slacks = self._obstacles(near), self._slacks
        others = tuple(one for one in slacks.constraints if one not in obstacles)
        if not obstacles or not others or problem.layout.torques:
            return
        rest = relieve_ends(problem, PathSlacks(slacks.arm, others))
        if (self._values(near, rest) >= 0).all():
            return
        for first in (FIRST, STRONG):
            met = approach_limits(problem, rest, near, self._solver, first)
            if met.converged:
                yield met.solution

    def _obstacles(self, motion: CollocationSolution) -> list[KeepOut]:
        """Return the obstacles that a motion passes through."""
        return find_obstacles(self._slacks, self._values(motion))

    def _values(self, solution: CollocationSolution, slacks: PathSlacks | None = None) -> Array:
        """Return all slacks along a motion, or some, shape (k, n_c)."""
        z = solution.values_at(_SHARES).reshape(-1, self._free.problem.size)
        return (slacks or self._slacks)(z[:, self._free.problem.layout.states])

    def _best_cost(self) -> float:
        """Return about the cost of the cheapest motion within the limits so far."""
        return min([one.kind.value for one in self._near], default=self._most())

    def _add(self, problem: MotionProblem, met: BarrierOutcome) -> None:
        """Keep a motion, unless it is one that is known."""
        kind = as_kind(ConstrainedMotion(problem, self._slacks, met.mu), met.solution)
        assert self._free.solution is not None
        sides = say_sides(problem, met.solution, self._obstacles(self._free.solution))
        if sides:
            kind = replace(kind, sentence=f'{sides}; {kind.sentence}')
        same = [one for one in self._near if one.kind.sentence == kind.sentence
                and are_alike(one.kind.motion.angles, kind.motion.angles)]
        if not same:
            self._near.append(_Near(problem=problem, met=met, kind=kind))

    def _refuse(self, failure: str) -> Plan:
        """Return the free plan with what stands against a motion within its limits."""
        free, failed = self._free, self._failed
        if failed is None:
            return replace(free, message=f'{free.message}; within its limits: {failure}')
        values = self._values(failed)
        worst = int(values.min(axis=0).argmin())
        label, slack = self._slacks.labels[worst], float(values[:, worst].min())
        nearest = (f': of {self._starts} tries the first breaks "{label.name}" by '
                   f'{-slack * label.scale:.3g} {label.unit}' if slack < -MARGIN else '')
        message = (f'{free.message}; no motion within the limits was found, which does not show '
                   f'that there is none{nearest}{self._say_payload()}')
        return replace(free, message=message)

    def _say_payload(self) -> str:
        """Say how much can be carried within the limits, if that is less than the task's."""
        payload = self._free.task.payload_mass
        if not payload or self._free.problem.layout.torques:
            return ''
        most = find_largest_payload(self._free.problem, self._slacks, self._solver)
        if most is None or most >= payload:
            return ''
        return (f'; about {most:.4g} kg is the most that was found to be carried within them, not '
                f'{payload:g} kg')


def _describe(plan: Plan) -> Plan:
    """Return a plan with what its limits leave, and what the barrier may cost."""
    limited = plan.problem
    assert isinstance(limited, ConstrainedMotion)
    tightest = min(plan.constraints, key=lambda one: one.slack)
    others = ''.join(f'; {kind.sentence}: J = {kind.value:.3g}' for kind in plan.kinds[1:])
    gap = limited.terms * limited.mu * plan.task.duration
    return replace(plan, barrier_gap=gap, message=(
        f'{PlanStatus.SOLVED.value}, planned within all limits on the way ({tightest})'
        + (f'; other kinds of motion{others}' if others else '')))
