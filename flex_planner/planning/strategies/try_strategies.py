"""Strategies tried in order, each with a share of the work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
import time

from flex_planner.base.progress import LimitedMonitor
from flex_planner.collocation import CollocationResult, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.strategy import Attempt, Strategy

# what a strategy is given in turn: iterations times intervals, a second or so of two links with a
# mode each
_SHARES = (1e4, 4e4, 1.6e5, math.inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class TriedStrategy:
    """
    A strategy that was tried, for the report of a plan.

    Attributes
    ----------
    name : str
        Of the strategy.
    seconds : float
        It took [s].
    iterations : int
        Newton iterations that it took.
    outcome : str
        How it ended.

    """

    name: str
    seconds: float
    iterations: int
    outcome: str


def try_strategies(problem: MotionProblem, solver: Solver, strategies: Sequence[Strategy],
                   tried: list[TriedStrategy], *,
                   substitutes: bool = False) -> tuple[str, Attempt]:
    """
    Try the strategies in order; report the first that decides it, or all failures.

    First each has a share of the work, in which most motions are found that it finds at all; those
    that have used it up are tried again with more.

    Parameters
    ----------
    problem : MotionProblem
        The motion.
    solver : Solver
        Its monitor may interrupt the work.
    strategies : sequence of Strategy
        In their order.
    tried : list of TriedStrategy
        Grows by those that were tried.
    substitutes : bool
        Whether a motion of a task with other weights will do.

    """
    failures: dict[str, str] = {}
    last, not_found = Attempt(result=_unsolved(problem, solver)), False
    for share in _SHARES:
        cut_off = []
        for strategy in strategies:
            attempt, exhausted = _try(strategy, problem, solver, share, tried)
            if attempt is None:
                continue
            if exhausted:
                cut_off.append(strategy)
                attempt = replace(attempt, hopeless=False, not_found=False)
            last = attempt
            if attempt.decides:
                return strategy.name, attempt
            if attempt.substitute is not None and substitutes:
                return strategy.name, replace(attempt, result=attempt.substitute.result)
            failures[strategy.name] = attempt.result.message
            not_found = not_found or attempt.not_found
        strategies = cut_off
    message = '; '.join(f'{name}: {why}' for name, why in failures.items())
    return ', '.join(failures), Attempt(
        result=replace(last.result, message=message or last.result.message), not_found=not_found)


def _try(strategy: Strategy, problem: MotionProblem, solver: Solver, share: float,
         tried: list[TriedStrategy]) -> tuple[Attempt | None, bool]:
    """Return an attempt, and whether it ended for want of work that it was given."""
    monitor = solver.monitor
    monitor.phase = strategy.name
    limited = (solver.watched_by(LimitedMonitor.of(monitor, share / strategy.cost))
               if strategy.cost else solver)
    began, before = time.monotonic(), monitor.iteration
    attempt = strategy.attempt(problem, limited)
    if attempt is None:
        return None, False
    tried.append(TriedStrategy(
        name=strategy.name, seconds=time.monotonic() - began,
        iterations=monitor.iteration - before,
        outcome='solved' if attempt.result.converged else attempt.result.message))
    return attempt, limited.monitor.exhausted and not attempt.result.converged


def _unsolved(problem: MotionProblem, solver: Solver) -> CollocationResult:
    """Return the result where no strategy had anything to add."""
    return CollocationResult.failed(
        problem.straight_line(solver.settings.intervals, solver.settings.rule),
        'no strategy applies to this motion')
