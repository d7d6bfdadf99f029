"""How a boundary-value problem is to be solved, and how that ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flex_planner.base.progress import StopReason
from flex_planner.base.validation import Array, integer, number
from flex_planner.collocation.gauss import FEWEST_STAGES, GaussRule, MOST_STAGES
from flex_planner.collocation.solution import CollocationSolution
import numpy as np


class SolverStatus(Enum):
    """How a solve ended; the value is shown to people."""

    CONVERGED = 'converged'
    NEWTON_FAILED = "Newton's method did not converge"
    MESH_LIMIT = 'the mesh reached its limit'
    CANCELED = StopReason.CANCELED.value
    TIMEOUT = StopReason.TIMEOUT.value


# the monitor ended the solve
INTERRUPTED = (SolverStatus.CANCELED, SolverStatus.TIMEOUT)


@dataclass(frozen=True, slots=True, kw_only=True)
class SolverSettings:
    """
    How a boundary-value problem is solved.

    Parameters
    ----------
    stages : int
        Gauss points per interval, 2 to 11; order 2 stages.
    intervals : int
        Of the first mesh, 4 to `max_intervals`.
    max_intervals : int
        At most 20000.
    max_iterations : int
        Newton iterations on one mesh, 1 to 1000.
    error_tolerance : float
        Largest error of an unknown at the nodes relative to its magnitude, 1e-11 to 1.
    exact : bool
        Whether Newton's method takes the Jacobian of every stage, not their mean of an interval:
        three to five times the price of an iteration, and convergence where the mean does not fit.
    max_meshes : int
        Meshes tried, 1 to 100; the last one's solution is returned with status ``MESH_LIMIT`` if
        it is not exact enough.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    stages: int = 8
    intervals: int = 20
    max_intervals: int = 2000
    max_iterations: int = 60
    error_tolerance: float = 1e-6
    max_meshes: int = 20
    exact: bool = False

    def __post_init__(self) -> None:
        # the error estimate needs a rule of one stage more
        integer('stages', self.stages, at_least=FEWEST_STAGES, at_most=MOST_STAGES - 1)
        integer('max_intervals', self.max_intervals, at_least=4, at_most=20000)
        integer('intervals', self.intervals, at_least=4, at_most=self.max_intervals)
        integer('max_iterations', self.max_iterations, at_least=1, at_most=1000)
        integer('max_meshes', self.max_meshes, at_least=1, at_most=100)
        number('error_tolerance', self.error_tolerance, at_least=1e-11, at_most=1)

    @property
    def rule(self) -> GaussRule:
        """Return the Gauss rule."""
        return GaussRule.of(self.stages)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CollocationResult:
    """
    A boundary-value problem solved, or how far it came.

    Attributes
    ----------
    solution : CollocationSolution
        The last point accepted; if solved, improved by its error estimate.
    status : SolverStatus
        Only ``CONVERGED`` is a solution.
    errors : numpy.ndarray, shape (m,)
        Estimated error of each unknown at the nodes relative to its magnitude; ``inf`` unless
        Newton's method converged on the mesh.
    residual : float
        Largest defect of an interval, see :func:`flex_planner.collocation.mesh.defects`;
        ``inf`` unless Newton's method converged on the mesh.
    switches : numpy.ndarray
        Times at which F is not smooth.
    iterations : int
        Newton iterations on all meshes.
    meshes : int
        Meshes tried.
    message : str
        The status in more words.

    """

    solution: CollocationSolution
    status: SolverStatus
    errors: Array
    residual: float
    switches: Array
    iterations: int
    meshes: int
    message: str

    @property
    def converged(self) -> bool:
        """Whether this is a solution."""
        return self.status is SolverStatus.CONVERGED

    @classmethod
    def failed(cls, solution: CollocationSolution, message: str) -> CollocationResult:
        """Return the result where nothing was solved, with a guess in place of a solution."""
        return cls(solution=solution, status=SolverStatus.NEWTON_FAILED,
                   errors=np.full(solution.nodes.shape[1], np.inf), residual=np.inf,
                   switches=np.zeros(0), iterations=0, meshes=0, message=message)
