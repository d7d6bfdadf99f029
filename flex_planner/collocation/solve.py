"""Newton on a mesh, then on better meshes, until the estimated error is small."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.progress import Monitor, StoppedError, StopReason
from flex_planner.base.validation import Array
from flex_planner.collocation.estimate import Estimate, estimate_error
from flex_planner.collocation.junctions import place_junctions
from flex_planner.collocation.mesh import are_on_nodes, defects, level_mesh, switching_times
from flex_planner.collocation.newton import newton
from flex_planner.collocation.newton_outcome import NewtonOutcome
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.result import CollocationResult, SolverSettings, SolverStatus
from flex_planner.collocation.solution import CollocationSolution
import numpy as np

# a mesh changes its number of intervals at most this much at a time
_LARGEST_GROWTH, _SMALLEST_GROWTH = 2.5, 0.4
# the error a new mesh is laid out for, as a share of the tolerance
_MARGIN = 0.1
# Newton's method stops at this share of the error expected of the mesh, and here at most
_NEWTON_SHARE, _LOOSEST_NEWTON = 0.03, 1e-3
# a mesh of fewer intervals may be too coarse for the mean Jacobian
_COARSE = 100
# where Newton's method stalls so near a solution a better mesh is tried, so many times
_NEAR, _MOST_RESCUES = 0.2, 4
# a mesh of which this error is expected shows where the switches are; they move so many times
_RESOLVED, _MOST_PLACEMENTS = 1e-2, 4


def solve(problem: BoundaryValueProblem, guess: CollocationSolution, settings: SolverSettings,
          monitor: Monitor | None = None, *, expected_error: float = 1.0) -> CollocationResult:
    """
    Solve a two-point boundary-value problem.

    Parameters
    ----------
    problem : BoundaryValueProblem
        z' = F(t, z) with separated boundary conditions.
    guess : CollocationSolution
        Start; its mesh is the first mesh, with the double nodes that the problem needs; its rule
        is replaced by that of the settings.
    settings : SolverSettings
        Tolerances and limits.
    monitor : Monitor, optional
        Watches the iterations and may stop them.
    expected_error : float
        Of a solution on the mesh of the guess; Newton's method need not go much further. 1 if it
        is not known to be good for anything better.

    """
    if guess.rule.stages != settings.stages:
        guess = guess.on_mesh(guess.mesh, settings.rule)
    return _MeshRefinement(problem, place_junctions(problem, guess), settings,
                           monitor or Monitor(), expected_error).run()


class _MeshRefinement:
    """The state of one call of `solve`."""

    def __init__(self, problem: BoundaryValueProblem, guess: CollocationSolution,
                 settings: SolverSettings, monitor: Monitor, expected: float) -> None:
        self._problem, self._point, self._settings = problem, guess, settings
        self._monitor = monitor
        self._iterations, self._meshes, self._rescues = 0, 1, 0
        self._expected, self._least, self._placements = expected, np.inf, 0

    def run(self) -> CollocationResult:
        """Solve on mesh after mesh."""
        settings = self._settings
        while True:
            tolerance = self._newton_tolerance()
            outcome = newton(self._problem, self._point, tolerance=tolerance,
                             max_iterations=settings.max_iterations, monitor=self._monitor,
                             exact=settings.exact)
            self._iterations += outcome.iterations
            self._point = outcome.solution
            if not outcome.converged or outcome.system is None:
                if self._rescue(outcome):
                    continue
                return self._fail(outcome)
            switches = switching_times(self._problem, self._point)
            if self._place_nodes(switches):
                continue
            try:
                estimate = estimate_error(self._problem, self._point, outcome.system,
                                          self._monitor)
            except StoppedError as error:
                return self._fail(replace(outcome, stopped=error.reason, message=str(error)))
            if tolerance > 3 * self._newton_tolerance(estimate.worst):
                self._expected = estimate.worst  # the mesh deserves a better solution
                continue
            if estimate.worst <= settings.error_tolerance:
                return self._result(estimate.improved, SolverStatus.CONVERGED, estimate, switches)
            if not self._refine(estimate, switches):
                return self._mesh_limit(estimate, switches)

    def _newton_tolerance(self, expected: float | None = None) -> float:
        """Return the tolerance of Newton's method where a certain error is expected."""
        error = max(self._expected if expected is None else expected,
                    self._settings.error_tolerance)
        return float(min(_NEWTON_SHARE * error, _LOOSEST_NEWTON))

    def _rescue(self, outcome: NewtonOutcome) -> bool:
        """
        Move to a finer mesh where Newton's method failed for want of one; False if there is none.

        Either the mean Jacobian does not fit, or a switch inside an interval made it stall near a
        solution; the switch gets a node.

        """
        if outcome.stopped or self._rescues >= _MOST_RESCUES:
            return False
        found = defects(self._problem, self._point)
        before = self._point.intervals
        switches: Array = np.zeros(0)
        if outcome.coarse and before < _COARSE and np.isfinite(found).any():
            factor = 2.0
        elif outcome.correction <= _NEAR:
            switches = switching_times(self._problem, self._point)
            factor = 1.0 if self._rescues < 2 else 1.5
            if not (switches.size or self._rescues):
                return False
        else:
            return False
        count = min(int(factor * before) + switches.size, self._settings.max_intervals)
        if count <= before:
            return False
        self._rescues += 1
        self._meshes += 1
        self._expected = 1.0
        mesh = level_mesh(self._point, found, 1.0, switches, fewest=count, most=count)
        self._point = self._point.on_mesh(mesh)
        return True

    def _place_nodes(self, switches: Array) -> bool:
        """Move nodes to the switches of a resolved solution; False if they are there."""
        if (self._expected > _RESOLVED or self._placements >= _MOST_PLACEMENTS
                or are_on_nodes(self._point.mesh, switches, self._settings.error_tolerance)):
            return False
        self._placements += 1
        count = self._point.intervals
        most = min(count + switches.size, max(count, self._settings.max_intervals))
        mesh = level_mesh(self._point, defects(self._problem, self._point), 1.0, switches,
                          fewest=count, most=most)
        self._point = self._point.on_mesh(mesh)
        return True

    def _refine(self, estimate: Estimate, switches: Array) -> bool:
        """Move to a better mesh; False if there is none."""
        settings, before = self._settings, self._point.intervals
        if self._meshes - self._rescues >= settings.max_meshes:
            return False
        order = 2 * settings.stages
        error = min(estimate.worst, 1e6)
        growth = float((error / (_MARGIN * settings.error_tolerance)) ** (1 / order))
        fewest = _SMALLEST_GROWTH * before
        if error > 0.5 * self._least:  # the last mesh was no better: prediction fails
            fewest = 1.3 * before
        self._least = min(self._least, error)
        mesh = level_mesh(self._point, defects(self._problem, self._point), growth, switches,
                          fewest=min(max(4, int(np.ceil(fewest))), settings.max_intervals),
                          most=min(int(_LARGEST_GROWTH * before), settings.max_intervals))
        if before >= settings.max_intervals and mesh.size - 1 >= before:
            return False
        self._expected = min(1.0, error * (before / (mesh.size - 1)) ** order)
        self._point = self._point.on_mesh(mesh)
        self._meshes += 1
        return True

    def _result(self, solution: CollocationSolution, status: SolverStatus, estimate: Estimate,
                switches: Array, message: str = '') -> CollocationResult:
        return CollocationResult(
            solution=solution, status=status, errors=estimate.errors,
            residual=float(defects(self._problem, solution).max()), switches=switches,
            iterations=self._iterations, meshes=self._meshes, message=message or status.value)

    def _fail(self, outcome: NewtonOutcome) -> CollocationResult:
        stops = {StopReason.CANCELED: SolverStatus.CANCELED,
                 StopReason.TIMEOUT: SolverStatus.TIMEOUT}
        status = stops[outcome.stopped] if outcome.stopped else SolverStatus.NEWTON_FAILED
        return CollocationResult(
            solution=outcome.solution, status=status,
            errors=np.full(self._problem.size, np.inf), residual=np.inf, switches=np.zeros(0),
            iterations=self._iterations, meshes=self._meshes, message=outcome.message)

    def _mesh_limit(self, estimate: Estimate, switches: Array) -> CollocationResult:
        message = (f'an error of {estimate.worst:.1e} is left on {self._point.intervals} '
                   f'intervals, {self._settings.error_tolerance:.1e} was asked for')
        return self._result(self._point, SolverStatus.MESH_LIMIT, estimate, switches, message)
