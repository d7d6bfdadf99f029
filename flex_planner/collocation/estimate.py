"""How far a collocation solution is from the true one, and a better one at the same price."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation.equations import collocation_residual, magnitudes
from flex_planner.collocation.gauss import GaussRule
from flex_planner.collocation.linear import LinearSystem
from flex_planner.collocation.problem import BoundaryValueProblem, SingularSystemError
from flex_planner.collocation.solution import CollocationSolution
import numpy as np

# where dF/dz changes inside an interval, its mean is wrong by as much as the error itself: the
# first correction finds the order, the next ones the factor
_CORRECTIONS, _SETTLED = 3, 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """
    Estimated error of a solution at its nodes.

    Attributes
    ----------
    errors : numpy.ndarray, shape (m,)
        Largest error of each unknown relative to its magnitude; inf if not found.
    improved : CollocationSolution
        The solution corrected by what was found, of one stage more; the estimate exceeds its
        error. The solution itself where nothing was found.

    """

    errors: Array
    improved: CollocationSolution

    @property
    def worst(self) -> float:
        """Return the largest error of all unknowns."""
        return float(self.errors.max())


def estimate_error(problem: BoundaryValueProblem, solution: CollocationSolution,
                   system: LinearSystem, monitor: Monitor | None = None) -> Estimate:
    """
    Compare with the Gauss rule of one stage more, by a few corrections towards it.

    Parameters
    ----------
    problem : BoundaryValueProblem
        What was solved.
    solution : CollocationSolution
        Of s stages; Newton's method has converged.
    system : LinearSystem
        Its linear system, or that of a point near it.
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    rule = GaussRule.of(solution.rule.stages + 1)
    better = CollocationSolution(solution.mesh, solution.nodes, solution.rates_at(rule.nodes),
                                 rule)
    unknown = Estimate(np.full(problem.size, np.inf), solution)
    size = magnitudes(problem, solution)
    try:
        finer = system.with_rule(rule, monitor)
        for _ in range(_CORRECTIONS):
            nodes, stages = finer.correction(collocation_residual(problem, better))
            better = CollocationSolution(solution.mesh, better.nodes + nodes,
                                         better.stages + stages, rule)
            errors = (np.abs(better.nodes - solution.nodes) / size).max(axis=0)
            last = (np.abs(nodes) / size).max(axis=0)
            if not np.isfinite(errors).all():
                return unknown
            if (last <= _SETTLED * errors.max()).all():
                break
    except SingularSystemError:
        return unknown
    return Estimate(np.maximum(errors, last), better)
