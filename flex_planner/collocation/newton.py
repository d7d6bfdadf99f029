"""
Newton's method for the collocation equations, damped by the natural monotonicity test.

A step is accepted when the simplified correction, computed at the new point with the old
matrix, has become smaller than the correction itself (Deuflhard, Newton Methods for Nonlinear
Problems, 2004, section 3.3). Unlike the size of the residual this does not depend on how the
equations are scaled, and long damped detours disappear.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.collocation.linear import NewtonSystem, Residual, SingularSystemError
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.solution import CollocationSolution
from flex_planner.progress import Monitor, StopReason
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SMALLEST_STEP = 1e-4


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
    stopped : StopReason or None
        Set if the monitor ended it.
    message : str
        Why it ended, in words.

    """

    solution: CollocationSolution
    converged: bool
    correction: float
    iterations: int
    stopped: StopReason | None
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """A correction, its size and the function that measures sizes."""

    nodes: Array
    stages: Array
    norm: float


def collocation_residual(problem: BoundaryValueProblem,
                         solution: CollocationSolution) -> Residual:
    """Return the residual of the collocation equations at a point."""
    stages, size = solution.rule.stages, problem.size
    values = solution.stage_values().reshape(-1, size)
    rate = problem.rate(solution.stage_times().ravel(), values)
    return _residual(problem, solution, rate.reshape(-1, stages, size))


def _residual(problem: BoundaryValueProblem, solution: CollocationSolution,
              rate: Array) -> Residual:
    increments = np.einsum('j,kjm->km', solution.rule.weights, solution.stages)
    gaps = np.diff(solution.nodes, axis=0) - solution.steps[:, None] * increments
    return Residual(solution.stages - rate, gaps, problem.left(solution.nodes[0])[0],
                    problem.right(solution.nodes[-1])[0])


def _linearise(problem: BoundaryValueProblem, solution: CollocationSolution,
               scale: Array) -> tuple[Residual, NewtonSystem]:
    """Return the residual and the factorised linear system at a point."""
    count, stages, size = solution.stages.shape
    values = solution.stage_values().reshape(-1, size)
    rate, jacobian = problem.rate_jacobian(solution.stage_times().ravel(), values)
    if not (np.isfinite(rate).all() and np.isfinite(jacobian).all()):
        raise SingularSystemError('the right-hand side is not finite at the current point')
    residual = _residual(problem, solution, rate.reshape(count, stages, size))
    system = NewtonSystem(solution.rule, solution.steps,
                          jacobian.reshape(count, stages, size, size),
                          problem.left(solution.nodes[0])[1],
                          problem.right(solution.nodes[-1])[1], scale)
    return residual, system


def magnitudes(problem: BoundaryValueProblem, solution: CollocationSolution) -> Array:
    """Return the magnitude of each unknown that relative sizes refer to, shape (m,)."""
    largest: Array = np.maximum(np.abs(solution.nodes).max(axis=0), problem.scale)
    return largest


def newton(problem: BoundaryValueProblem, guess: CollocationSolution, *, tolerance: float,
           max_iterations: int, monitor: Monitor) -> NewtonOutcome:
    """
    Solve the collocation equations on the mesh of a guess.

    Parameters
    ----------
    problem : BoundaryValueProblem
        What to solve.
    guess : CollocationSolution
        Starting point.
    tolerance : float
        Root mean square of the relative correction that counts as converged.
    max_iterations : int
        Linear systems at most.
    monitor : Monitor
        Told of every iteration; may stop it.

    """
    solution, previous, step = guess, None, 1.0
    norm = np.inf
    for iteration in range(max_iterations):
        stopped = monitor.stop_reason()
        if stopped:
            return NewtonOutcome(solution, False, norm, iteration, stopped, stopped.value)
        try:
            scale = magnitudes(problem, solution)
            residual, system = _linearise(problem, solution, scale)
            full = _measured(system.correction(residual), scale)
        except SingularSystemError as error:
            return NewtonOutcome(solution, False, norm, iteration, None, str(error))
        norm = full.norm
        monitor.step(norm, solution.intervals)
        if norm <= tolerance:
            return NewtonOutcome(_moved(solution, full, 1.0), True, norm, iteration + 1, None,
                                 'converged')
        if previous is not None:
            step = _predicted(previous, full, step)
        accepted = _damped(problem, solution, system, full, step, scale)
        if accepted is None:
            return NewtonOutcome(solution, False, norm, iteration + 1, None,
                                 "no step of Newton's method reduces the error")
        solution, step, simplified = accepted
        if step == 1.0 and simplified.norm <= tolerance:
            return NewtonOutcome(_moved(solution, simplified, 1.0), True, simplified.norm,
                                 iteration + 1, None, 'converged')
        previous = (full, simplified)
    return NewtonOutcome(solution, False, norm, max_iterations, None,
                         f'not converged after {max_iterations} iterations')


def _measured(correction: tuple[Array, Array], scale: Array) -> _Step:
    nodes, stages = correction
    norm = float(np.sqrt(np.mean((nodes / scale) ** 2)))
    if not np.isfinite(norm):
        raise SingularSystemError('the Newton correction is not finite')
    return _Step(nodes, stages, norm)


def _moved(solution: CollocationSolution, step: _Step, factor: float) -> CollocationSolution:
    return CollocationSolution(solution.mesh, solution.nodes + factor * step.nodes,
                               solution.stages + factor * step.stages, solution.rule)


def _predicted(previous: tuple[_Step, _Step], full: _Step, last: float) -> float:
    """Return the step that the observed nonlinearity allows."""
    before, simplified = previous
    difference = float(np.linalg.norm(simplified.nodes - full.nodes))
    if difference == 0:
        return 1.0
    size = float(np.linalg.norm(simplified.nodes))
    ratio = size * before.norm / (difference * full.norm)
    return min(1.0, max(last * ratio, _SMALLEST_STEP))


def _damped(problem: BoundaryValueProblem, solution: CollocationSolution, system: NewtonSystem,
            full: _Step, step: float,
            scale: Array) -> tuple[CollocationSolution, float, _Step] | None:
    """Return the first point along the correction that passes the test, or None."""
    while step >= _SMALLEST_STEP:
        trial = _moved(solution, full, step)
        try:
            residual = collocation_residual(problem, trial)
            simplified = _measured(system.correction(residual), scale)
        except SingularSystemError:
            step /= 4
            continue
        if simplified.norm <= (1 - step / 4) * full.norm:
            return trial, step, simplified
        defect = float(np.sqrt(np.mean(
            ((simplified.nodes - (1 - step) * full.nodes) / scale) ** 2)))
        allowed = step**2 * full.norm / (2 * defect)
        step = min(step / 2, max(allowed, step / 10))
    return None
