"""
A solver of boundary-value problems as a value: settings, who watches, and the method.

It is handed on as one argument. Another method is another `backend`, a function with the
arguments of :func:`flex_planner.collocation.solve.solve`.

"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from flex_planner.base.progress import Monitor
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.restart import KnownSolution, solve_near
from flex_planner.collocation.result import CollocationResult, SolverSettings
from flex_planner.collocation.solution import CollocationSolution
from flex_planner.collocation.solve import solve

# of solutions along a homotopy: they need not be exact, and failures must be cheap
_LOOSE_TOLERANCE, _CHEAP_ITERATIONS = 0.05, 15
# of solutions along a continuation in a price: exact to some hundred times the value's accuracy
_COARSE_TOLERANCE, _COARSE_ITERATIONS = 1e-2, 25
# of solutions that start from one like them, in units of that of others: a cost, which is
# stationary, is still right to ten digits
_RESTART_TOLERANCE = 100.0


class Backend(Protocol):
    """A method that solves a boundary-value problem."""

    def __call__(self, problem: BoundaryValueProblem, guess: CollocationSolution,
                 settings: SolverSettings, monitor: Monitor | None = None, *,
                 expected_error: float = 1.0) -> CollocationResult:
        """Solve it from a guess, see :func:`flex_planner.collocation.solve.solve`."""


class _NobodyWatches(Monitor):
    """Stands for a monitor that was not given."""


@dataclass(frozen=True, slots=True)
class Solver:
    """
    Settings of a solver, the monitor that watches it, and its method.

    Parameters
    ----------
    settings : SolverSettings
        Tolerances and limits.
    monitor : Monitor
        Receives progress, and may cancel or limit the time.
    backend : Backend
        The method; Gauss collocation by default.

    """

    settings: SolverSettings = SolverSettings()
    monitor: Monitor = field(default_factory=lambda: _NobodyWatches())
    backend: Backend = solve

    def solve(self, problem: BoundaryValueProblem, guess: CollocationSolution, *,
              expected_error: float = 1.0) -> CollocationResult:
        """Solve a problem from a guess, see :func:`flex_planner.collocation.solve.solve`."""
        return self.backend(problem, guess, self.settings, self.monitor,
                            expected_error=expected_error)

    @property
    def is_own(self) -> bool:
        """Return whether the method is that of this package."""
        return self.backend is solve

    def solve_near(self, problem: BoundaryValueProblem, known: KnownSolution) -> CollocationResult:
        """
        Solve a problem from the solution of one like it, see `restart.solve_near`.

        Errors may be a hundred times as large as of others; not with another method, which knows
        of no restarts.

        """
        tolerance = self.settings.error_tolerance
        if not self.is_own:
            return self.solve(problem, known.solution, expected_error=tolerance)
        settings = replace(self.settings, error_tolerance=min(_RESTART_TOLERANCE * tolerance, 1.0))
        return solve_near(problem, known, settings, self.monitor)

    def watched_by(self, monitor: Monitor | None) -> Solver:
        """
        Return the same solver with another monitor, if one is given.

        Where none was ever given, one begins to count here: a solver may be used many times.

        """
        if monitor is None and isinstance(self.monitor, _NobodyWatches):
            monitor = Monitor()
        return self if monitor is None else replace(self, monitor=monitor)

    def with_settings(self, **changes: Any) -> Solver:
        """Return the same solver with fields of its settings changed."""
        return replace(self, settings=replace(self.settings, **changes))

    def loose(self) -> Solver:
        """Return a solver for solutions along a homotopy."""
        return self.with_settings(error_tolerance=max(_LOOSE_TOLERANCE,
                                                      self.settings.error_tolerance))

    def cheap(self) -> Solver:
        """Return a solver for a step along a homotopy that may fail."""
        return self.loose().patient(_CHEAP_ITERATIONS)

    def coarse(self, accuracy: float = _COARSE_TOLERANCE) -> Solver:
        """Return a solver for solutions along a continuation, exact to an accuracy."""
        wanted = max(min(accuracy, _COARSE_TOLERANCE), self.settings.error_tolerance)
        return self.with_settings(error_tolerance=wanted).patient(_COARSE_ITERATIONS)

    def patient(self, iterations: int) -> Solver:
        """Return a solver that gives up after so many Newton iterations on a mesh."""
        return self.with_settings(max_iterations=min(iterations, self.settings.max_iterations))
