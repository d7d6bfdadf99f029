"""A strategy: a named way to a first solution of a motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flex_planner.collocation import CollocationResult, INTERRUPTED, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """
    The outcome of a strategy.

    Attributes
    ----------
    result : CollocationResult
        A solution, or how far it came.
    evidence : str
        Why the motion is impossible; empty where nothing shows it.

    """

    result: CollocationResult
    evidence: str = ''

    @property
    def decides(self) -> bool:
        """Return whether nothing else need be tried: solved, impossible, or interrupted."""
        return bool(self.evidence or self.result.converged or self.result.status in INTERRUPTED)


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
    shows_infeasibility : bool
        Whether it may find evidence that the task cannot be done in its duration with its payload.

    """

    name: str
    attempt: Callable[[MotionProblem, Solver], Attempt | None]
    quick: bool = False
    shows_infeasibility: bool = False
