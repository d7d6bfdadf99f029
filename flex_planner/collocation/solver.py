"""Newton on a mesh, then on better meshes, until the defect is small."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flex_planner.collocation.mesh import defects, levelled
from flex_planner.collocation.newton import newton, NewtonOutcome
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.solution import CollocationSolution
from flex_planner.progress import Monitor, StopReason
from flex_planner.validation import integer, number
import numpy as np


class Status(Enum):
    """How a solve ended; the value is shown to people."""

    CONVERGED = 'converged'
    NEWTON_FAILED = "Newton's method did not converge"
    MESH_LIMIT = 'the mesh reached its largest number of intervals'
    CANCELED = StopReason.CANCELED.value
    TIMEOUT = StopReason.TIMEOUT.value


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """
    How a boundary-value problem is solved.

    Parameters
    ----------
    stages : int
        Gauss points an interval, 2 to 8; order 2 stages.
    intervals : int
        Of the first mesh, 4 to `max_intervals`.
    max_intervals : int
        At most 20000.
    max_iterations : int
        Newton iterations on one mesh, 1 to 1000.
    newton_tolerance : float
        Relative correction that counts as converged, 1e-14 to 1e-2.
    defect_tolerance : float
        Largest defect of an interval relative to the unknowns, 1e-12 to 1.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    stages: int = 3
    intervals: int = 60
    max_intervals: int = 1000
    max_iterations: int = 60
    newton_tolerance: float = 1e-9
    defect_tolerance: float = 0.05

    def __post_init__(self) -> None:
        integer('stages', self.stages, at_least=2, at_most=8)
        integer('max_intervals', self.max_intervals, at_least=4, at_most=20000)
        integer('intervals', self.intervals, at_least=4, at_most=self.max_intervals)
        integer('max_iterations', self.max_iterations, at_least=1, at_most=1000)
        number('newton_tolerance', self.newton_tolerance, at_least=1e-14, at_most=1e-2)
        number('defect_tolerance', self.defect_tolerance, at_least=1e-12, at_most=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CollocationResult:
    """
    A boundary-value problem solved, or how far it came.

    Attributes
    ----------
    solution : CollocationSolution
        The last point accepted.
    status : Status
        Only ``CONVERGED`` is a solution.
    residual : float
        Largest defect of an interval, see :func:`flex_planner.collocation.mesh.defects`;
        ``inf`` unless Newton's method converged on the mesh.
    iterations : int
        Newton iterations on all meshes.
    message : str
        The status in more words.

    """

    solution: CollocationSolution
    status: Status
    residual: float
    iterations: int
    message: str

    @property
    def converged(self) -> bool:
        """Whether this is a solution."""
        return self.status is Status.CONVERGED


def solve(problem: BoundaryValueProblem, guess: CollocationSolution, settings: Settings,
          monitor: Monitor | None = None) -> CollocationResult:
    """
    Solve a two-point boundary-value problem.

    Parameters
    ----------
    problem : BoundaryValueProblem
        z' = F(t, z) with separated boundary conditions.
    guess : CollocationSolution
        Start; its mesh is the first mesh.
    settings : Settings
        Tolerances and limits.
    monitor : Monitor, optional
        Watches the iterations and may stop them.

    """
    monitor = monitor or Monitor()
    point, iterations = guess, 0
    while True:
        outcome = newton(problem, point, tolerance=settings.newton_tolerance,
                         max_iterations=settings.max_iterations, monitor=monitor)
        iterations += outcome.iterations
        if not outcome.converged:
            return _failed(outcome, iterations)
        defect = defects(problem, outcome.solution)
        if defect.max() <= settings.defect_tolerance:
            return CollocationResult(solution=outcome.solution, status=Status.CONVERGED,
                                     residual=float(defect.max()), iterations=iterations,
                                     message=Status.CONVERGED.value)
        if outcome.solution.intervals >= settings.max_intervals:
            return _mesh_limit(outcome.solution, float(defect.max()), iterations, settings)
        mesh = levelled(outcome.solution, defect, settings.defect_tolerance,
                        fewest=_growing(outcome.solution.intervals, settings),
                        most=settings.max_intervals)
        point = outcome.solution.on_mesh(mesh)


def _growing(intervals: int, settings: Settings) -> int:
    """Return the fewest intervals of the next mesh: more than now, so that it ends."""
    return min(int(np.ceil(1.25 * intervals)), settings.max_intervals)


def _failed(outcome: NewtonOutcome, iterations: int) -> CollocationResult:
    stops = {StopReason.CANCELED: Status.CANCELED, StopReason.TIMEOUT: Status.TIMEOUT}
    status = stops[outcome.stopped] if outcome.stopped else Status.NEWTON_FAILED
    return CollocationResult(solution=outcome.solution, status=status, residual=np.inf,
                             iterations=iterations, message=outcome.message)


def _mesh_limit(solution: CollocationSolution, defect: float, iterations: int,
                settings: Settings) -> CollocationResult:
    message = (f'a defect of {defect:.1e} is left on {solution.intervals} intervals, '
               f'{settings.defect_tolerance:.1e} was asked for')
    return CollocationResult(solution=solution, status=Status.MESH_LIMIT, residual=defect,
                             iterations=iterations, message=message)
