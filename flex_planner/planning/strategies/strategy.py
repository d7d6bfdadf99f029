"""A strategy: a named way to a first solution of a motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flex_planner.collocation import CollocationResult, INTERRUPTED, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import KindOfMotion


@dataclass(frozen=True, slots=True, kw_only=True)
class Substitute:
    """
    A motion of a task that differs in its weights, for want of the one that was asked for.

    Attributes
    ----------
    problem : MotionProblem
        With those weights.
    result : CollocationResult
        Its solution.

    """

    problem: MotionProblem
    result: CollocationResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """
    The outcome of a strategy.

    Attributes
    ----------
    result : CollocationResult
        A solution, or how far it came.
    kinds : tuple of KindOfMotion
        Kinds of motion that it met on the way.
    starts : int
        From how many starts.
    not_found : bool
        Whether many starts led to no motion that could do the task.
    hopeless : bool
        Whether what was found instead speaks against trying on.
    substitute : Substitute or None
        What was solved instead, for use where nothing else solves the task.

    """

    result: CollocationResult
    kinds: tuple[KindOfMotion, ...] = ()
    starts: int = 1
    not_found: bool = False
    hopeless: bool = False
    substitute: Substitute | None = None

    @property
    def decides(self) -> bool:
        """Return whether nothing else need be tried: solved, hopeless, or interrupted."""
        return (self.hopeless or self.result.converged or self.result.status in INTERRUPTED)


@dataclass(frozen=True, slots=True)
class Strategy:
    """
    A named way to a solution.

    Attributes
    ----------
    name : str
        The plan reports it.
    attempt : callable
        From a problem and a solver to an `Attempt`; None where the strategy has nothing to add,
        such as a homotopy in the weights of a task without any.
    quick : bool
        Whether it takes little time, solved or not.
    cost : float
        Of one of its iterations in Newton's: it is given up when it has had its share of the
        work, and tried again with more once the others have failed. 0 for what has no share.

    """

    name: str
    attempt: Callable[[MotionProblem, Solver], Attempt | None]
    quick: bool = False
    cost: float = 1.0
