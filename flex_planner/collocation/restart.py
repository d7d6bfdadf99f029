"""
A problem like one that is solved: from its solution, on its mesh, by its rule.

One linear system and a few corrections with it are all that takes; the first of them is the
tangent, how the solution moves with the problem. What is known of the errors of the first solution
is known of this one, too, as long as the defects have hardly grown: so no error is estimated anew,
which would take a linear system of its own.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.junctions import junction_times, place_junctions
from flex_planner.collocation.mesh import cost_of_gaps, defects, level_mesh, switching_times
from flex_planner.collocation.newton import newton
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.result import CollocationResult, SolverSettings, SolverStatus
from flex_planner.collocation.solution import CollocationSolution
from flex_planner.collocation.solve import solve
import numpy as np

# Newton's method shows the switches so near a solution, and ends at this share of the tolerance:
# the cost is not stationary in what it leaves, which breaks the equations
_NEAR, _NEWTON_SHARE = 1e-2, 1e-3
# linear systems on a mesh: what takes more is not near
_MOST_SYSTEMS = 3
# meshes that are made to fit the switches, and what a switch beside its node may cost: a share of
# the tolerance
_PLACEMENTS, _PLACED = 3, 0.01
# an error that is carried over counts so many times, each time: after some restarts it is too
# large, and is estimated anew; so it is where the defects have grown by more than this factor
_DOUBT, _MOST_GROWTH = 2.0, 3.0
# of a piece of the mesh between switches
_MOST_STRETCH = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class KnownSolution:
    """
    What is known of a problem that is solved, for another one.

    Attributes
    ----------
    solution : CollocationSolution
        Of s + 1 stages, as an error estimate leaves it; m unknowns.
    errors : numpy.ndarray, shape (m,)
        Estimated, see `CollocationResult.errors`.
    residual : float
        Largest defect of an interval.
    switches : numpy.ndarray
        Times at which F is not smooth, each at a node.

    """

    solution: CollocationSolution
    errors: Array
    residual: float
    switches: Array

    def stretched(self, factor: float) -> KnownSolution:
        """Return the same at times so many times as late."""
        return replace(self, solution=self.solution.stretched(factor),
                       switches=self.switches * factor)


def solve_near(problem: BoundaryValueProblem, known: KnownSolution, settings: SolverSettings,
               monitor: Monitor | None = None) -> CollocationResult:
    """
    Solve a problem from the solution of one like it; by `solve` where they are not near enough.

    Parameters
    ----------
    problem : BoundaryValueProblem
        z' = F(t, z) with separated boundary conditions.
    known : KnownSolution
        Of the other problem, over the same time.
    settings : SolverSettings
        Tolerances and limits.
    monitor : Monitor, optional
        Watches the iterations and may stop them.

    """
    watch = monitor or Monitor()
    restart = _Restart(problem, known, settings, watch)
    result = None
    if (known.solution.rule.stages == settings.stages + 1 and 0 < known.residual < np.inf
            and np.isfinite(known.errors).all()):
        result = restart.run()
    return result or solve(problem, restart.nearest, settings, watch,
                           expected_error=settings.error_tolerance)


class _Restart:
    """The state of one call of `solve_near`."""

    def __init__(self, problem: BoundaryValueProblem, known: KnownSolution,
                 settings: SolverSettings, monitor: Monitor) -> None:
        self._problem, self._known, self._settings = problem, known, settings
        self._monitor, self._iterations, self._meshes = monitor, 0, 1
        self.nearest, self._correction = place_junctions(problem, known.solution), np.inf

    def run(self) -> CollocationResult | None:
        """Return the solution, None if it is not near or not known to be exact."""
        before = after = self._known.switches
        if before.size:
            if not self._converge(_NEAR):
                return None
            after = switching_times(self._problem, self.nearest)
        tolerance = self._settings.error_tolerance
        for _ in range(_PLACEMENTS):
            if not (self._place(before, after)
                    and self._converge(_NEWTON_SHARE * min(tolerance, _NEAR))):
                return None
            before, after = after, switching_times(self._problem, self.nearest)
            if cost_of_gaps(self.nearest.mesh, after) <= _PLACED * tolerance:
                return self._judge(after)
        return None

    def _converge(self, tolerance: float) -> bool:
        """Move to the solution on the mesh; False if it is far."""
        outcome = newton(self._problem, self.nearest, tolerance=tolerance,
                         max_iterations=_MOST_SYSTEMS, monitor=self._monitor,
                         exact=self._settings.exact)
        self._iterations += outcome.iterations
        if outcome.converged:
            self.nearest, self._correction = outcome.solution, outcome.correction
        return outcome.converged

    def _place(self, before: Array, after: Array) -> bool:
        """Give each switch a node; False if there is no such mesh."""
        if not before.size and not after.size:
            return True
        mesh = self._move_nodes(before, after) if before.size == after.size else None
        if mesh is None:
            count, most = self.nearest.intervals, self._settings.max_intervals
            if count + after.size > most:
                return False
            mesh = level_mesh(self.nearest, defects(self._problem, self.nearest), 1.0, after,
                              fewest=count, most=count + after.size)
        self.nearest = self.nearest.on_mesh(mesh)
        self._meshes += 1
        return True

    def _move_nodes(self, before: Array, after: Array) -> Array | None:
        """Return the mesh with the nodes at switches moved along; None if that spoils it."""
        mesh = self.nearest.mesh
        nearest = mesh[np.abs(before[:, None] - mesh).argmin(axis=1)]
        fixed = np.concatenate([mesh[:1], junction_times(self._problem), mesh[-1:]])
        old: Array = np.sort(np.concatenate([fixed, nearest]))
        new: Array = np.sort(np.concatenate([fixed, after]))
        if not np.diff(old).min() > 0:
            return None
        stretches = np.diff(new) / np.diff(old)
        if not (stretches.max() <= _MOST_STRETCH and stretches.min() >= 1 / _MOST_STRETCH):
            return None
        moved: Array = np.interp(mesh, old, new)
        return moved

    def _judge(self, switches: Array) -> CollocationResult | None:
        """Return the result with its errors, None where they may be too large."""
        stages, known = self._settings.stages, self._known
        residual = float(defects(self._problem, self.nearest).max())
        growth = max(residual / known.residual, 1.0)
        # with the step the defect falls by the power s + 2, the estimated error by 2 s
        errors = _DOUBT * growth**(2 * stages / (stages + 2)) * known.errors
        errors = errors + cost_of_gaps(self.nearest.mesh, switches) + self._correction
        if not (growth <= _MOST_GROWTH and errors.max() <= self._settings.error_tolerance):
            return None
        return CollocationResult(
            solution=self.nearest, status=SolverStatus.CONVERGED, errors=errors,
            residual=residual, switches=switches, iterations=self._iterations,
            meshes=self._meshes, message=SolverStatus.CONVERGED.value)
