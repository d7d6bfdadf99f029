"""
Least squares over logs: the parameters with which a model reproduces them.

The derivatives are those of the computed motion, so Gauss-Newton steps are exact; trust regions
and bounds are those of SciPy's `least_squares`.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.identification.experiments import Experiment
from flex_planner.identification.intervals import half_widths
from flex_planner.identification.log_errors import LogErrors, Unknowns
from flex_planner.identification.loop_model import LoopModel
import numpy as np

TOLERANCE, COARSE = 1e-9, 1e-5
"""Of a fit whose values count, and of one that they are compared with."""
MOST_RMS = 2.0
"""Of the errors over the noise, beyond which the model is not the plant."""
_MOST_EVALUATIONS = 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """
    A fit.

    Attributes
    ----------
    found : Unknowns
        Parameters, and the state of the arm at the start of each log.
    free : tuple of int
        Which of them were free.
    half_widths : numpy.ndarray, shape (len(free),)
        Of their intervals of 95 %, scaled by `rms`, or by blocks of errors if that is more.
    late : numpy.ndarray, shape (logs,)
        By how much the motion of each log began later than it says, 0 where that is known [s].
    moving : tuple of int
        Which logs were not taken to begin at rest.
    rms : float
        Of the errors over the noise that encoders have; about 1 where the model is the plant.
        Without meaning (1) for input errors, whose noise is not known.
    cost : float
        Sum of the squared errors over the noise.
    fit_percent : numpy.ndarray, shape (logs, n)
        How much of what was measured the model explains.
    evaluations : int
        Simulations of all logs.
    converged : bool
        Whether the steps became small before there were too many.

    """

    found: Unknowns
    free: tuple[int, ...]
    half_widths: Array
    late: Array
    moving: tuple[int, ...]
    rms: float
    cost: float
    fit_percent: Array
    evaluations: int
    converged: bool

    @property
    def values(self) -> Array:
        """Return all parameters, as `list_parameters` has them, shape (2 + 6 n,)."""
        return self.found.values


def fit_parameters(model: LoopModel, experiments: Sequence[Experiment], values: Array,
                   free: Sequence[int], monitor: Monitor | None = None, *,
                   tolerance: float = TOLERANCE) -> Fit:
    """
    Return the parameters with which a model fits logs best.

    Parameters
    ----------
    model, experiments, values, free, monitor
        As of `LogErrors`; the values as `list_parameters` has them.
    tolerance : float
        Relative change of the squared errors, or of the parameters, at which it ends.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    from scipy.optimize import least_squares

    problem = LogErrors(model, experiments, values, free, monitor)
    lower, upper = problem.bounds()
    inside = np.clip(problem.first, lower + 1e-9, upper - 1e-9)
    result = least_squares(
        lambda at: problem.evaluate(at)[0], inside, lambda at: problem.evaluate(at)[1],
        bounds=(lower, upper), x_scale='jac', ftol=tolerance, xtol=tolerance, gtol=TOLERANCE,
        max_nfev=_MOST_EVALUATIONS)
    return _summarize(problem, result.x, bool(result.status > 0))


def judge_parameters(model: LoopModel, experiments: Sequence[Experiment],
                     values: Array, monitor: Monitor | None = None) -> Fit:
    """Return how well parameters fit logs that they were not found by; only starts are free."""
    return fit_parameters(model, experiments, values, (), monitor)


def predict_half_widths(model: LoopModel, experiments: Sequence[Experiment], values: Array,
                        free: Sequence[int], monitor: Monitor | None = None) -> Array:
    """Return half of the intervals of 95 % that logs would lead to, if the model is the plant."""
    problem = LogErrors(model, experiments, values, free, monitor)
    jacobian = problem.evaluate(problem.first)[1]
    return half_widths(np.zeros(len(jacobian)), jacobian, problem.crowding)[:len(problem.free)]


def _summarize(problem: LogErrors, unknowns: Array, converged: bool) -> Fit:
    """Return the fit at some unknowns."""
    errors, jacobian = problem.evaluate(unknowns)
    found = problem.split(unknowns)
    count = len(problem.free)
    freedom = max(errors.size - unknowns.size, 1)
    variance = float(errors @ errors) / freedom
    noise = variance if problem.is_input else max(variance, 1.0)
    widths = half_widths(errors, jacobian, noise * problem.crowding, problem.blocks())
    parts = [errors[problem.rows(i)].reshape(one.measured.shape)
             for i, one in enumerate(problem.experiments)]
    return Fit(found=found, free=tuple(problem.free), half_widths=widths[:count],
               late=found.late + [one.late for one in problem.experiments],
               moving=tuple(problem.moving), cost=float(errors @ errors),
               rms=1.0 if problem.is_input else float(np.sqrt(variance)),
               fit_percent=np.array([one.fit_percent(part) for one, part in zip(
                   problem.experiments, parts, strict=True)]),
               evaluations=problem.evaluations, converged=converged)
