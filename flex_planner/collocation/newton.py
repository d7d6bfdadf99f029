"""
Newton's method for the collocation equations, damped by the natural monotonicity test.

A step is accepted when the simplified correction, computed at the new point with the old
matrix, has become smaller than the correction itself (Deuflhard, Newton Methods for Nonlinear
Problems, 2004, section 3.3). Unlike the size of the residual this does not depend on how the
equations are scaled, and long damped detours disappear. Near the solution the matrix is kept
while it pays: a correction with an old matrix costs a fifth of one with a new matrix.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.progress import Monitor, StoppedError, StopReason
from flex_planner.base.validation import Array
from flex_planner.collocation.compiled_newton import solve_compiled
from flex_planner.collocation.equations import (
    collocation_residual,
    factorise,
    linearise,
    magnitudes,
)
from flex_planner.collocation.linear import LinearSystem, Residual
from flex_planner.collocation.newton_outcome import (
    CORRECTION_NOT_FINITE,
    KEPT,
    NewtonOutcome,
    NO_STEP_HELPS,
    SMALLEST_STEP,
)
from flex_planner.collocation.problem import BoundaryValueProblem, SingularSystemError
from flex_planner.collocation.solution import CollocationSolution
import numpy as np

_GIVEN_UP = 'given up, its share of the work is used up'


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """A correction and its size: root mean square relative to the unknowns."""

    nodes: Array
    stages: Array
    norm: float


def newton(problem: BoundaryValueProblem, guess: CollocationSolution, *, tolerance: float,
           max_iterations: int, monitor: Monitor, exact: bool = False) -> NewtonOutcome:
    """
    Solve the collocation equations on the mesh of a guess.

    Parameters
    ----------
    problem : BoundaryValueProblem
        What to solve.
    guess : CollocationSolution
        Starting point; its mesh has the double nodes of the problem, see `place_junctions`.
    tolerance : float
        Root mean square of the relative correction that counts as converged.
    max_iterations : int
        Linear systems at most.
    monitor : Monitor
        Told of every iteration; may stop it.
    exact : bool
        See `SolverSettings`.

    """
    left = monitor.iterations_left(guess.intervals)
    if left < 1:
        return _Run(problem, guess, tolerance, monitor, exact).outcome(_GIVEN_UP)
    max_iterations = int(min(max_iterations, left))
    compiled = solve_compiled(problem, guess, tolerance, max_iterations, monitor,
                              exact=exact)
    if compiled is not None:
        return compiled
    run = _Run(problem, guess, tolerance, monitor, exact)
    try:
        while run.iterations < max_iterations:
            if run.iterate():
                return run.outcome('converged', converged=True)
        return run.outcome(f'not converged after {max_iterations} iterations')
    except StoppedError as stop:
        return run.outcome(stop.reason.value, stopped=stop.reason)
    except SingularSystemError as error:
        return run.outcome(str(error))


class _Run:
    """The state of one call of `newton`."""

    def __init__(self, problem: BoundaryValueProblem, guess: CollocationSolution,
                 tolerance: float, monitor: Monitor, exact: bool) -> None:
        self._problem, self._tolerance, self._monitor = problem, tolerance, monitor
        self._exact = exact
        self._solution = guess
        self._system: LinearSystem | None = None
        self._norm, self._step, self.iterations = np.inf, 1.0, 0
        self._previous: tuple[_Step, _Step] | None = None
        self._coarse = False

    def outcome(self, message: str, *, converged: bool = False,
                stopped: StopReason | None = None) -> NewtonOutcome:
        """Return the state of the run."""
        return NewtonOutcome(self._solution, converged, self._norm, self.iterations,
                             self._system, stopped, message, self._coarse)

    def iterate(self) -> bool:
        """Factorise once and move as far as the matrix is good for; True if converged."""
        self._monitor.check()
        self._scale = magnitudes(self._problem, self._solution)
        residual, jacobians, junctions = linearise(self._problem, self._solution, self._monitor,
                                                   exact=self._exact)
        system = self._system = factorise(self._problem, self._solution, jacobians, junctions,
                                          self._monitor)
        full = self._measure(system, residual)
        self.iterations += 1
        self._norm = full.norm
        self._monitor.step(full.norm, self._solution.intervals)
        if full.norm <= self._tolerance:
            self._solution = _move(self._solution, full, 1.0)
            return True
        return self._advance(system, full)

    def _advance(self, system: LinearSystem, full: _Step) -> bool:
        """Take a damped step, then corrections with the same matrix while they converge."""
        simplified = self._damp(system, full)
        self._previous = (full, simplified)
        last = full.norm
        while self._step == 1.0 and simplified.norm <= max(KEPT * last, self._tolerance):
            self._norm, last = simplified.norm, simplified.norm
            trial = _move(self._solution, simplified, 1.0)
            if last <= self._tolerance:
                self._solution = trial
                return True
            following = self._measure(system, collocation_residual(self._problem, trial))
            if following.norm > last:
                break
            self._solution, simplified, self._previous = trial, following, None
        return False

    def _damp(self, system: LinearSystem, full: _Step) -> _Step:
        """Move to the first point along the correction that passes the test."""
        step = self._step = self._predict(full)
        bent, tried = 0.0, 1.0
        while step >= SMALLEST_STEP:
            self._monitor.check()
            trial = _move(self._solution, full, step)
            try:
                simplified = self._measure(system, collocation_residual(self._problem, trial))
            except SingularSystemError:
                step /= 4
                continue
            if simplified.norm <= (1 - step / 4) * full.norm:
                self._solution, self._step = trial, step
                return simplified
            bent, tried = self._size(simplified.nodes - (1 - step) * full.nodes), step
            step = min(step / 2, max(step**2 * full.norm / (2 * bent), step / 10))
        # a wrong matrix bends the correction with the step, nonlinearity with its square
        self._coarse = bent > 0.5 * tried * full.norm
        raise SingularSystemError(NO_STEP_HELPS)

    def _predict(self, full: _Step) -> float:
        """Return the step that the observed nonlinearity allows."""
        if self._previous is None:
            return 1.0
        before, simplified = self._previous
        difference = float(np.linalg.norm(simplified.nodes - full.nodes))
        if difference == 0:
            return 1.0
        ratio = float(np.linalg.norm(simplified.nodes)) * before.norm / (difference * full.norm)
        return min(1.0, max(self._step * ratio, SMALLEST_STEP))

    def _measure(self, system: LinearSystem, residual: Residual) -> _Step:
        nodes, stages = system.correction(residual)
        norm = self._size(nodes)
        if not np.isfinite(norm):
            raise SingularSystemError(CORRECTION_NOT_FINITE)
        return _Step(nodes, stages, norm)

    def _size(self, nodes: Array) -> float:
        return float(np.sqrt(np.mean((nodes / self._scale) ** 2)))


def _move(solution: CollocationSolution, step: _Step, factor: float) -> CollocationSolution:
    return CollocationSolution(solution.mesh, solution.nodes + factor * step.nodes,
                               solution.stages + factor * step.stages, solution.rule)
