"""Where Newton's method ended, and what decides how far it goes."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.progress import StopReason
from flex_planner.collocation.linear import LinearSystem
from flex_planner.collocation.solution import CollocationSolution

SMALLEST_STEP = 1e-4
# an old matrix is kept while it shrinks the correction at least this much
KEPT = 0.25
NO_STEP_HELPS = "no step of Newton's method reduces the error"
CORRECTION_NOT_FINITE = 'the Newton correction is not finite'


@dataclass(frozen=True, slots=True, eq=False)
class NewtonOutcome:
    """
    Where Newton's method ended.

    Attributes
    ----------
    solution : CollocationSolution
        The last accepted point.
    converged : bool
        Whether the last correction was below the tolerance.
    correction : float
        Its size relative to the unknowns.
    iterations : int
        Linear systems factorised.
    system : LinearSystem or None
        The last linear system.
    stopped : StopReason or None
        Set if the monitor ended it.
    message : str
        Why it ended, in words.
    coarse : bool
        Whether it failed because the matrix does not fit, and not because the problem bends: on a
        finer mesh the mean Jacobian is a better one.

    """

    solution: CollocationSolution
    converged: bool
    correction: float
    iterations: int
    system: LinearSystem | None
    stopped: StopReason | None
    message: str
    coarse: bool = False
