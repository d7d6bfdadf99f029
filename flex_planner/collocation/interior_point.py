"""
A primal-dual interior-point method for collocated conditions with inequalities.

Besides z every stage has unknowns y = (free ones, slacks, multipliers) that fulfil algebraic
conditions; the products of slacks and multipliers are to be mu, which falls to nearly nothing
while Newton's method runs. A problem eliminates y point by point, so that each iteration solves
the linear system of the collocation equations alone, with the Jacobian of every stage: multipliers
vary by decades inside an interval, where the mean Jacobian says nothing.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.compiled_system import factorise_system
from flex_planner.collocation.equations import CHUNK
from flex_planner.collocation.junctions import evaluate_junctions
from flex_planner.collocation.linear import Residual
from flex_planner.collocation.problem import Indices, RATE_NOT_FINITE, SingularSystemError
from flex_planner.collocation.solution import CollocationSolution
import numpy as np

# slacks and multipliers keep this share of what they have
_KEPT = 0.005
# root mean square of a step relative to the unknowns, at most
_LONGEST = 3.0
# mu falls where a step was longer than this share and shorter than this size; faster below that
_GOOD_SHARE, _SETTLED, _NEAR = 0.3, 0.3, 0.1
_FALL, _POWER = 0.2, 1.5


class BarrierProblem(Protocol):
    """
    z' = F(z, y) with conditions on y at every point, and separated boundary conditions.

    Attributes
    ----------
    size : int
        Unknowns z, m.
    free : int
        Entries of y of any sign; half of the others are slacks, half multipliers, in this order.
    explicit : numpy.ndarray of int
        See `BoundaryValueProblem`; left and right, too.

    """

    @property
    def size(self) -> int:
        """Return the number of unknowns, m."""

    @property
    def free(self) -> int:
        """Return how many entries of y may have any sign."""

    @property
    def explicit(self) -> Indices:
        """Return the unknowns that need no factorisation."""

    def scale(self, mu: float) -> Array:
        """Return the smallest magnitudes of z that matter, shape (m,)."""

    def condense(self, z: Array, y: Array, mu: float) -> tuple[Array, Array]:
        """Return F and J of the step z' = F + J dz with y eliminated, (k, m) and (k, m, m)."""

    def find_step(self, z: Array, y: Array, dz: Array, mu: float) -> Array:
        """Return the step of y (k, n_y) that goes with one of z (k, m)."""

    def longest(self, node: Array, step: Array) -> float:
        """Return the share of a step that keeps the first node (m,) where it may be, at most 1."""

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return residual and Jacobian of the conditions at the first node."""

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return residual and Jacobian of those at the last node."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BarrierSchedule:
    """
    How mu falls.

    Attributes
    ----------
    first, last : float
        mu at the start and at the end, > 0.
    tolerance : float
        Root mean square of the relative correction that counts as converged.
    max_iterations : int
        Linear systems at most.
    settling : int
        Iterations after which the last step need not be a whole one for the multipliers. Where a
        limit is only touched a multiplier may go to and fro on a coarse mesh for ever, while z
        and slacks have settled.

    """

    first: float
    last: float
    tolerance: float = 1e-5
    max_iterations: int = 80
    settling: int = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class BarrierOutcome:
    """
    Where an interior-point method ended.

    Attributes
    ----------
    solution : CollocationSolution
        z at the last iterate.
    y : numpy.ndarray, shape (N, s, n_y)
        The other unknowns at its stages.
    mu : float
        Of the last iterate.
    converged : bool
        Whether mu fell to its end and the last correction was small enough.
    correction : float
        Root mean square of the last correction, relative to the unknowns.
    iterations : int
        Linear systems factorised.
    message : str
        Why it ended, in words.

    """

    solution: CollocationSolution
    y: Array
    mu: float
    converged: bool
    correction: float
    iterations: int
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    nodes: Array
    stages: Array
    y: Array
    norm: float


def solve_barrier(problem: BarrierProblem, guess: CollocationSolution, y: Array,
                  schedule: BarrierSchedule, monitor: Monitor) -> BarrierOutcome:
    """
    Lower mu from its start to its end on one mesh.

    Parameters
    ----------
    problem : BarrierProblem
        What to solve.
    guess : CollocationSolution
        Start of z.
    y : numpy.ndarray, shape (N, s, n_y)
        Start of the others, slacks and multipliers > 0.
    schedule : BarrierSchedule
        Of mu.
    monitor : Monitor
        Told of every iteration.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    at = BarrierOutcome(guess, y, schedule.first, False, np.inf, 0, 'not converged after '
                        f'{schedule.max_iterations} iterations')
    while at.iterations < min(schedule.max_iterations, monitor.iterations_left(guess.intervals)):
        monitor.check()
        try:
            step = _find_step(problem, at, monitor)
        except SingularSystemError as error:
            return replace(at, message=str(error))
        monitor.step(step.norm, guess.intervals)
        at = _advance(problem, at, step, schedule)
        if at.converged:
            return at
    return at


def _find_step(problem: BarrierProblem, at: BarrierOutcome, monitor: Monitor) -> _Step:
    """Return the Newton step at an iterate."""
    solution, y = at.solution, at.y.reshape(-1, at.y.shape[-1])
    count, stages, size = solution.stages.shape
    z = solution.stage_values().reshape(-1, size)
    rate, jacobians = _condense(problem, z, y, at.mu, monitor)
    (left, left_rows), (right, right_rows) = (
        problem.left(solution.nodes[0]), problem.right(solution.nodes[-1]))
    scale = np.maximum(np.abs(solution.nodes).max(axis=0), problem.scale(at.mu))
    gaps = np.diff(solution.nodes, axis=0) - solution.steps[:, None] * (
        solution.rule.weights @ solution.stages)
    junctions = evaluate_junctions(problem, solution, gaps)
    system = factorise_system(solution.rule, solution.steps,
                              jacobians.reshape(count, stages, size, size), left_rows, right_rows,
                              scale, problem.explicit, junctions, monitor)
    nodes, rates = system.correction(Residual(
        solution.stages - rate.reshape(solution.stages.shape), gaps, left, right))
    norm = float(np.sqrt(np.mean((nodes / scale) ** 2)))
    if not np.isfinite(norm):
        raise SingularSystemError(RATE_NOT_FINITE)
    dz = nodes[:-1, None] + solution.steps[:, None, None] * (solution.rule.matrix @ rates)
    dy = _find_steps(problem, z, y, dz.reshape(-1, size), at.mu, monitor).reshape(at.y.shape)
    return _Step(nodes, rates, dy, norm)


def _condense(problem: BarrierProblem, z: Array, y: Array, mu: float,
              monitor: Monitor) -> tuple[Array, Array]:
    """Return F and J at all stages; the monitor is asked now and then."""
    rate, jacobians = np.empty_like(z), np.empty((len(z), problem.size, problem.size))
    chunk = max(1, CHUNK // problem.size**2)
    for first in range(0, len(z), chunk):
        monitor.check()
        part = slice(first, first + chunk)
        rate[part], jacobians[part] = problem.condense(z[part], y[part], mu)
        if not (np.isfinite(rate[part]).all() and np.isfinite(jacobians[part]).all()):
            raise SingularSystemError(RATE_NOT_FINITE)
    return rate, jacobians


def _find_steps(problem: BarrierProblem, z: Array, y: Array, dz: Array, mu: float,
                monitor: Monitor) -> Array:
    """Return the steps of y; the monitor is asked now and then."""
    steps = np.empty_like(y)
    chunk = max(1, CHUNK // problem.size**2)
    for first in range(0, len(z), chunk):
        monitor.check()
        part = slice(first, first + chunk)
        steps[part] = problem.find_step(z[part], y[part], dz[part], mu)
    return steps


def _advance(problem: BarrierProblem, at: BarrierOutcome, step: _Step,
             schedule: BarrierSchedule) -> BarrierOutcome:
    """Move as far as slacks and multipliers stay positive, and lower mu."""
    middle = problem.free + (at.y.shape[-1] - problem.free) // 2
    primal = min(_longest(at.y, step.y, slice(problem.free, middle)),
                 problem.longest(at.solution.nodes[0], step.nodes[0]),
                 _LONGEST / max(step.norm, _LONGEST))
    dual = _longest(at.y, step.y, slice(middle, None))
    share = np.full(at.y.shape[-1], primal)
    share[middle:] = dual
    moved = CollocationSolution(at.solution.mesh, at.solution.nodes + primal * step.nodes,
                                at.solution.stages + primal * step.stages, at.solution.rule)
    done = (at.mu <= schedule.last and step.norm <= schedule.tolerance
            and primal == 1.0 and (dual == 1.0 or at.iterations >= schedule.settling))
    return replace(at, solution=moved, y=at.y + share * step.y, correction=step.norm,
                   mu=_lower(at.mu, step.norm, min(primal, dual), schedule), converged=done,
                   iterations=at.iterations + 1, message='converged' if done else at.message)


def _longest(y: Array, step: Array, part: slice) -> float:
    """Return the share of a step up to which entries that are positive stay so."""
    with np.errstate(divide='ignore'):
        fall = float(np.max(-step[..., part] / y[..., part], initial=0.0))
    return 1.0 if fall <= 1 - _KEPT else (1 - _KEPT) / fall


def _lower(mu: float, norm: float, share: float, schedule: BarrierSchedule) -> float:
    """Return the next mu: it falls while steps are long and corrections small."""
    if share <= _GOOD_SHARE or norm >= _SETTLED:
        return mu
    fall = _FALL
    if norm < _NEAR:  # superlinear in its share of the first
        fall = min(fall, (mu / schedule.first) ** (_POWER - 1))
    return max(schedule.last, fall * mu)
