"""The results of single cells of a map."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
import math

from flex_planner.maps.kept_motions import KeptMotion
from flex_planner.planning.plan import PlanStatus


class CellCode(IntEnum):
    """Kinds of results of a cell; stored as a number, explained in the store's metadata."""

    PENDING = 0
    SOLVED = 1
    UNREACHABLE = 2
    INFEASIBLE = 3
    NOT_CONVERGED = 4
    CERTIFICATE_FAILED = 5
    TIMEOUT = 6
    INVALID = 7
    FAILED = 8
    NOT_FOUND = 9
    LIMIT_VIOLATED = 10
    BENT_TOO_FAR = 11

    @property
    def meaning(self) -> str:
        """Return it in words."""
        return _MEANINGS[self]

    @classmethod
    def of(cls, status: PlanStatus) -> CellCode:
        """Return the code of a cell whose plan or search has a status."""
        return _OF_STATUS[status]


_MEANINGS = {
    CellCode.PENDING: 'not computed yet',
    CellCode.SOLVED: 'solved and certified',
    CellCode.UNREACHABLE: 'start or goal cannot be reached, or is singular',
    CellCode.INFEASIBLE: 'impossible: a proof that holds for all motions is named',
    CellCode.NOT_CONVERGED: 'not converged, which does not show that it is impossible',
    CellCode.CERTIFICATE_FAILED: 'converged, but the re-simulated motion misses its tolerances',
    CellCode.TIMEOUT: 'time limit of a cell reached',
    CellCode.INVALID: 'a value of the cell is out of its bounds',
    CellCode.FAILED: 'an error of the program, see the message',
    CellCode.NOT_FOUND: 'no motion found, which does not show that there is none',
    CellCode.LIMIT_VIOLATED: 'a joint leaves its limits, or is faster than it may be, on the way',
    CellCode.BENT_TOO_FAR: 'links bend further than the model of the arm holds',
}
_OF_STATUS = {
    PlanStatus.SOLVED: CellCode.SOLVED,
    PlanStatus.INFEASIBLE: CellCode.INFEASIBLE,
    PlanStatus.NOT_FOUND: CellCode.NOT_FOUND,
    PlanStatus.LIMIT_VIOLATED: CellCode.LIMIT_VIOLATED,
    PlanStatus.BENT_TOO_FAR: CellCode.BENT_TOO_FAR,
    PlanStatus.NOT_CONVERGED: CellCode.NOT_CONVERGED,
    PlanStatus.CERTIFICATE_FAILED: CellCode.CERTIFICATE_FAILED,
    PlanStatus.OBJECTIVE_NOT_MET: CellCode.NOT_CONVERGED,
    PlanStatus.TIMEOUT: CellCode.TIMEOUT,
    PlanStatus.CANCELED: CellCode.PENDING,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CellResult:
    """
    The result of a cell.

    Attributes
    ----------
    index : tuple of int
        Its place, one entry per axis of the study.
    code : CellCode
        `value` counts only where it is ``SOLVED``.
    message : str
        The code in more words; says why where there is no value.
    value : float
        The quantity of the study, in its unit; NaN unless solved.
    bound : float
        Bound of the true value where a search encloses it: upper for a maximum payload, lower
        for a minimum duration; NaN elsewhere.
    cost : float
        J of eq. (6); NaN unless solved.
    tip_error : float
        Of the re-simulation [m]; NaN unless solved.
    iterations : int
        Newton iterations.
    seconds : float
        That it took.
    warm : bool
        Whether it started from a neighbour.
    motion : KeptMotion or None
        For others to start from; None unless solved.

    """

    index: tuple[int, ...]
    code: CellCode
    message: str = ''
    value: float = math.nan
    bound: float = math.nan
    cost: float = math.nan
    tip_error: float = math.nan
    iterations: int = 0
    seconds: float = 0.0
    warm: bool = False
    motion: KeptMotion | None = field(default=None, compare=False, repr=False)
