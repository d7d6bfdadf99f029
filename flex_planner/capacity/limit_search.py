"""The search for a limit: the largest payload and the shortest duration are found alike."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from flex_planner.base.errors import FlexPlannerError
from flex_planner.capacity.bracket import (
    bracket_width,
    collect_to_limit,
    continuation_solver,
    is_near_limit,
)
from flex_planner.capacity.extrapolation import extrapolate_to_limit, Neighbours
from flex_planner.capacity.known_starts import GRACE, in_grace, plan_near, start_strategy
from flex_planner.collocation import (
    CollocationResult,
    Solver,
    SolverStatus,
)
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.lift import KEPT, solve_best_kind, walk_back
from flex_planner.planning.kinds.search import find_kinds
from flex_planner.planning.kinds.windings import other_windings, say_turns, turn_goal
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import INTERRUPTED_STATUS, plan_problem
from flex_planner.planning.strategies.catalogue import CATALOGUE, QUICK
from flex_planner.planning.strategies.extremals import Extremal, SearchStart
from flex_planner.planning.strategies.first_extremals import approach_limit, transfer_extremal
from flex_planner.planning.strategies.free_parameters import FreeParameter, PAYLOAD
from flex_planner.planning.strategies.homotopies import (
    drop_weights,
    has_weights,
    without_weights,
)
from flex_planner.planning.strategies.price_continuation import continue_in_price

# starts for each other way round to a point
_OTHER_WAY = 3
# plans of these leave other ways to one
_FAILED = (PlanStatus.NOT_CONVERGED, PlanStatus.CERTIFICATE_FAILED)
# motions that are planned where a search has ended, the nearest to the limit first
_MOST_PLANS = 6


class Failure(NamedTuple):
    """Why a search ended without a motion near the limit."""

    status: PlanStatus
    message: str


class LimitSearch:
    """
    Follows the price of a payload or a duration to its limit, then plans there.

    Parameters
    ----------
    parameter : FreeParameter
        ``PAYLOAD`` or ``DURATION``.
    problem : MotionProblem
        Of the task, with its weights; the limit does not depend on them.
    solver : Solver
        Its monitor may interrupt the search.
    accuracy : float
        To which the limit is wanted [kg, s].
    effort : SearchEffort
        How many kinds of motion are looked for, unless a given motion leads on.

    Attributes
    ----------
    extremals : list of Extremal
        Motions nearer and nearer to the limit.
    extrapolated : bool
        Whether the last one follows from searches of two neighbours, as exact as a plan.
    warm : bool
        Whether the search went on from the motion that it was given.
    known : Extremal or None
        A motion near the limit from a straight line, if one is known before the search: it goes on
        from there where no kind of motion leads on.
    kinds : list of KindOfMotion
        Kinds of motion of the arm made rigid, the best first; empty if it looked for none.
    starts : int
        How many starts were explored for them.

    """

    def __init__(self, parameter: FreeParameter, problem: MotionProblem, solver: Solver,
                 accuracy: float, effort: SearchEffort = SearchEffort.FAST) -> None:
        self._parameter, self._problem, self._solver = parameter, problem, solver
        self._accuracy, self._effort = accuracy, effort
        self.kinds: list[KindOfMotion] = []
        self.starts = 0
        self.extremals: list[Extremal] = []
        self.extrapolated = self.warm = False
        self.known: Extremal | None = None

    @property
    def solver(self) -> Solver:
        """Return the solver."""
        return self._solver

    @property
    def weighted(self) -> bool:
        """Return whether the task has weights besides those of effort."""
        return has_weights(self._problem)

    @property
    def last(self) -> Extremal:
        """Return the extremal nearest to the limit."""
        return self.extremals[-1]

    @property
    def is_near(self) -> bool:
        """Return whether the last value is the limit, to the accuracy wanted."""
        return is_near_limit(self.extremals, self._accuracy)

    @property
    def priced(self) -> tuple[Extremal, ...]:
        """Return the motions of least effort, whose price is known."""
        return tuple(one for one in self.extremals if one.price and one.result.converged)

    def follow_price(self, start: SearchStart | None, neighbours: Neighbours) -> Failure | None:
        """Collect extremals up to the limit; return the failure if there is no motion."""
        self._announce()
        self.extremals = extrapolate_to_limit(
            self._parameter, self._parameter.easiest(drop_weights(self._problem)), neighbours,
            self._accuracy, self._solver)
        self.extrapolated = bool(self.extremals)
        if not self.extrapolated:
            self._approach(start)
            if not (self.last.result.converged or self.last.interrupted):
                failure = self._approach_from_plan()
                if failure is not None:
                    return failure
        self.warm = self.warm or self.extrapolated
        if self.last.interrupted:
            return Failure(INTERRUPTED_STATUS[self.last.result.status],
                           self.last.result.message)
        return None

    def plan(self) -> Plan:
        """
        Return the plan with the value of the last extremal.

        Where the value leaves Newton's method no way, or what it leads to does not pass its
        certificate, the price may: the last extremal is then replaced by the same motion, solved
        as exactly as a plan.

        """
        first = start_strategy(self.last.result.solution,
                               self.last if self.extrapolated else None)
        plan = plan_problem(self._at(self.last), self._solver, (first,))
        if plan.status not in _FAILED:
            return plan
        again = self._solve_more_exactly(self.last)
        if again is not None:
            strategy = start_strategy(again.result.solution, again)
            found = plan_problem(self._at(again), self._solver, (strategy,))
            if found.status not in _FAILED:
                self.extremals[-1] = again
                return found
        found = plan_problem(self._at(self.last), self._solver, QUICK)
        if found.status not in _FAILED:
            return found
        return replace(plan, message=f'{plan.message}; {found.message}')

    def certify_so_far(self, *, stopped: bool) -> tuple[Extremal, Plan] | None:
        """
        Return the motion nearest to the limit with a plan; None if there is none.

        Where the weights of the task leave none, the plan is without them.

        Parameters
        ----------
        stopped : bool
            Whether the search is out of time, so that a plan has to be found at once.

        """
        known = self._certify(self._problem, stopped=stopped)
        if known is None and self.weighted:
            known = self._certify(without_weights(self._problem), stopped=stopped)
        return known

    def _certify(self, problem: MotionProblem, *,
                 stopped: bool) -> tuple[Extremal, Plan] | None:
        """Return the motion nearest to the limit with a plan of a problem like the task's."""
        grace = GRACE / 2 if self.weighted else GRACE
        short = in_grace(self._solver, grace) if stopped else self._solver
        solved = [one for one in reversed(self.extremals) if one.result.converged]
        for extremal in solved if stopped else solved[:_MOST_PLANS]:
            try:
                near = self._parameter.with_value(problem, extremal.value)
                plan = plan_near(near, extremal.result.solution, short)
            except FlexPlannerError:  # too heavy to hold
                continue
            if plan.solved:
                return extremal, plan
            if short.monitor.stop_reason():
                break
        # a search that had begun met nothing yet: what it began with may do
        begun = self._parameter is PAYLOAD and self._solver.monitor.iteration > 0
        met = any(one.result.converged for one in self.extremals)
        return self._certify_first(problem, short) if begun and not met else None

    def _certify_first(self, problem: MotionProblem,
                       short: Solver) -> tuple[Extremal, Plan] | None:
        """Return the motion with the payload of the task, and its plan."""
        plan = plan_problem(problem, short, QUICK)
        if plan.solution is None or not plan.solved:
            return None
        result = replace(CollocationResult.failed(plan.solution, plan.message),
                         status=SolverStatus.CONVERGED)
        return Extremal(value=self._parameter.value(problem), price=0.0, result=result,
                        problem=problem), plan

    @property
    def explored_best(self) -> KindOfMotion | None:
        """Return the best kind if the search ended worse than it: it was not finished."""
        if not self.kinds or not self.extremals or self._problem.model.arm.n_passive:
            return None
        best = self.kinds[0]
        return best if self._parameter.falls_short(self.last.value, best.value, KEPT) else None

    def _approach(self, start: SearchStart | None) -> None:
        """Collect extremals from the first start that leads to a motion."""
        solver = continuation_solver(self._solver, self._accuracy)
        bare = drop_weights(self._problem)
        known = None if start is None else self._transfer(bare, start, solver)
        self.warm = known is not None
        if known is None:
            known = self._explore(bare, solver)
            bare = drop_weights(self._problem)  # its goal may be turned
            if known is not None and not known.interrupted:
                self._follow_kind(bare, known, solver)
                return
            known = known or self.known
        for problem in self._parameter.starts(bare):
            self.extremals = []
            collect_to_limit(
                approach_limit(self._parameter, problem, solver, first=known,
                               target_gap=self._target_gap), self._accuracy, self.extremals)
            if self.extremals[0].result.converged or self.extremals[0].interrupted:
                return

    def _follow_kind(self, bare: MotionProblem, known: Extremal, solver: Solver) -> None:
        """Collect extremals of a kind of motion: some with less, for others to start from."""
        before = walk_back(self._parameter, known, self._parameter.value(bare), solver)
        self.extremals = [*before]
        collect_to_limit(approach_limit(self._parameter, bare, solver, first=known,
                                        target_gap=self._target_gap), self._accuracy,
                         self.extremals)

    def _transfer(self, bare: MotionProblem, start: SearchStart,
                  solver: Solver) -> Extremal | None:
        """Return the motion that a given one leads to."""
        for problem in self._parameter.starts(bare):
            known = transfer_extremal(self._parameter, problem, start, solver)
            if known is not None:
                return known
        return None

    def _explore(self, bare: MotionProblem, solver: Solver) -> Extremal | None:
        """Look for kinds of motion, and return the motion that the best one leads to."""
        home, kinds = self._find_kinds(bare)
        if home is not bare:
            self._problem, self.known = turn_goal(self._problem, home), None
        self._announce()
        return solve_best_kind(self._parameter, self._parameter.easiest(home), kinds, solver)

    def _find_kinds(self, bare: MotionProblem) -> tuple[MotionProblem, list[KindOfMotion]]:
        """Note all kinds of motion; return those of the best way round to the goal."""
        if bare.junctions.size:  # paths are looked for without via points
            return bare, []
        unknown, solver = self._parameter.unknown, self._solver
        ways = other_windings(bare) if self._effort.explores else []
        self.starts = self._effort.starts + _OTHER_WAY * len(ways)
        found = {bare: find_kinds(bare, unknown, self._effort.starts, solver)}
        for way in ways:
            found[way] = [replace(kind, sentence=say_turns(bare, way)) for kind in find_kinds(
                way, unknown, _OTHER_WAY, solver)]
        best = bare
        for way in ways:
            if found[way] and (not found[best] or self._parameter.improves(
                    found[way][0].value, found[best][0].value)):
                best = way
        others = [kind for way, kinds in found.items() if way is not best for kind in kinds]
        self.kinds = [*found[best], *others]
        return best, found[best]

    def _approach_from_plan(self) -> Failure | None:
        """Collect extremals from a motion that takes all strategies to find."""
        bare = drop_weights(self._problem)
        plan = plan_problem(bare, self._solver, CATALOGUE)
        if plan.solution is None or not plan.solved:
            return Failure(plan.status, plan.message)
        solver = continuation_solver(self._solver, self._accuracy)
        first = solver.solve(bare, plan.solution)
        self._announce()
        self.extremals = [Extremal(value=self._parameter.value(bare), price=0.0, result=first,
                                   problem=bare)]
        collect_to_limit(continue_in_price(self._parameter, bare, first, solver, self._target_gap),
                         self._accuracy, self.extremals)
        return None

    def _announce(self) -> None:
        """Tell the monitor that a price is followed."""
        self._solver.monitor.phase = f'{self._parameter.name} at a rising price'

    def _target_gap(self, value: float) -> float:
        """Return the gap that is near enough."""
        return bracket_width(self._accuracy, value)

    def _at(self, extremal: Extremal) -> MotionProblem:
        """Return the problem of the task with the value of an extremal."""
        return self._parameter.with_value(self._problem, extremal.value)

    def _solve_more_exactly(self, extremal: Extremal) -> Extremal | None:
        """Return the same motion as exact as a plan has to be, None without success."""
        if not extremal.price:
            return None
        try:
            found = self._parameter.solve_at_price(
                extremal.problem, extremal.result.solution, extremal.price, self._solver)
        except FlexPlannerError:  # too heavy to hold, or no duration
            return None
        return found if found is not None and found.result.converged else None
