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
from flex_planner.identification.experiments import Experiment, Method
from flex_planner.identification.loop_model import LoopModel, steps_per_part
from flex_planner.identification.loop_sizes import LAGS
from flex_planner.identification.plant_parameters import list_parameters, Quantity
import numpy as np

TOLERANCE, COARSE = 1e-9, 1e-5
"""Of a fit whose values count, and of one that they are compared with."""
_MOST_EVALUATIONS = 40
_RUN_AWAY = 1e6
_NORMAL_95, _SINGULAR = 1.96, 1e-14
# samples that errors of a wrong model are alike for
_BLOCK = 100


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """
    A fit.

    Attributes
    ----------
    values : numpy.ndarray, shape (2 + 6 n,)
        Of all parameters, as `list_parameters` has them.
    free : tuple of int
        Which of them were free.
    half_widths : numpy.ndarray, shape (len(free),)
        Of their intervals of 95 %, scaled by `rms`, or by blocks of errors if that is more.
    starts : numpy.ndarray, shape (logs, n)
        Joint angles at the start of each log [rad].
    late : numpy.ndarray, shape (logs,)
        By how much the motion of each log began later than it says, 0 where that is known [s].
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

    values: Array
    free: tuple[int, ...]
    half_widths: Array
    starts: Array
    late: Array
    rms: float
    cost: float
    fit_percent: Array
    evaluations: int
    converged: bool


class _Problem:
    """The errors of all logs by free parameters, start angles, and starts that are not known."""

    def __init__(self, model: LoopModel, experiments: Sequence[Experiment], values: Array,
                 free: Sequence[int], monitor: Monitor) -> None:
        self.model, self.experiments, self.monitor = model, experiments, monitor
        self.values, self.free = values.copy(), list(free)
        self.evaluations = 0
        self._last: tuple[bytes, tuple[Array, Array]] | None = None
        starts = [one.start - self._offsets(values) for one in experiments]
        fastest = max(model.fastest(start, values) for start in starts)
        # as many for all evaluations, so that the errors stay smooth
        self.parts = [steps_per_part(one.law.period, 1.3 * fastest) for one in experiments]
        self.timed = [i for i, one in enumerate(experiments) if one.start_error]
        self.first = np.concatenate([values[self.free], *starts, np.zeros(len(self.timed))])

    def _offsets(self, values: Array) -> Array:
        return values[self.model.sizes.physical:-1]

    def split(self, unknowns: Array) -> tuple[Array, Array, Array]:
        """Return all parameters, the start angles of each log, and how late each one began."""
        values, late, logs = self.values.copy(), np.zeros(len(self.experiments)), len(self.timed)
        values[self.free] = unknowns[:len(self.free)]
        late[self.timed] = unknowns[unknowns.size - logs:]
        starts = unknowns[len(self.free):unknowns.size - logs]
        return values, starts.reshape(len(self.experiments), -1), late

    def evaluate(self, unknowns: Array) -> tuple[Array, Array]:
        """Return errors and their Jacobian; the last ones are kept."""
        key = unknowns.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._evaluate(unknowns)
        return self._last[1]

    def _evaluate(self, unknowns: Array) -> tuple[Array, Array]:
        self.evaluations += 1
        values, starts, late = self.split(unknowns)
        n, k, known = self.model.sizes.joints, len(self.free), len(values)
        parts = [self.errors(i, values, start, float(late[i])) for i, start in enumerate(starts)]
        blocks = []
        for i, (error, slope) in enumerate(parts):
            block = np.zeros((*error.shape, unknowns.size))
            block[..., :k] = slope[..., self.free]
            block[..., k + n * i:k + n * (i + 1)] = slope[..., known:-1]
            if i in self.timed:
                block[..., k + n * len(parts) + self.timed.index(i)] = slope[..., -1]
            blocks.append(block.reshape(-1, unknowns.size))
        errors = np.concatenate([error.ravel() for error, _ in parts])
        finite = np.nan_to_num(errors, nan=_RUN_AWAY, posinf=_RUN_AWAY, neginf=-_RUN_AWAY)
        return (np.clip(finite, -_RUN_AWAY, _RUN_AWAY),
                np.nan_to_num(np.vstack(blocks), posinf=0.0, neginf=0.0))

    def errors(self, index: int, values: Array, start: Array,
               late: float) -> tuple[Array, Array]:
        """Return the errors of a log and their derivatives."""
        self.monitor.check()
        one = self.experiments[index]
        return one.errors(self.model.simulate(start, one.followed, one.law, values,
                                              self.parts[index]), late)

    def bounds(self) -> tuple[Array, Array]:
        """Return the least and the largest values."""
        parameters = list_parameters(self.model.sizes.joints)
        lower = np.full(self.first.size, -np.inf)
        upper = np.full(self.first.size, np.inf)
        period = min(one.law.period for one in self.experiments)
        for place, index in enumerate(self.free):
            lower[place] = parameters[index].lower_bound
            if parameters[index].kind is Quantity.DELAY:
                upper[place] = LAGS * period
            if parameters[index].kind is Quantity.DAMPING:
                upper[place] = 0.99
        for place, index in enumerate(self.timed, self.first.size - len(self.timed)):
            upper[place] = self.experiments[index].start_error
            lower[place] = -upper[place]
        return lower, upper


def fit_parameters(model: LoopModel, experiments: Sequence[Experiment], values: Array,
                   free: Sequence[int], monitor: Monitor | None = None, *,
                   tolerance: float = TOLERANCE) -> Fit:
    """
    Return the parameters with which a model fits logs best.

    Parameters
    ----------
    model : LoopModel
        n joints.
    experiments : sequence of Experiment
        At least one.
    values : numpy.ndarray, shape (2 + 6 n,)
        Where to start, as `list_parameters` has them; those that are not free stay.
    free : sequence of int
        Indices of those to find.
    monitor : Monitor, optional
        May stop it.
    tolerance : float
        Relative change of the squared errors, or of the parameters, at which it ends.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    from scipy.optimize import least_squares

    problem = _Problem(model, experiments, values, free, monitor or Monitor())
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
    problem = _Problem(model, experiments, values, free, monitor or Monitor())
    jacobian = problem.evaluate(problem.first)[1]
    return _plain_widths(jacobian)[:len(problem.free)]


def _plain_widths(jacobian: Array) -> Array:
    """Return half of the intervals; infinite where the errors say nothing."""
    scale = np.linalg.norm(jacobian, axis=0)
    seen = scale > 0
    inverse = np.linalg.pinv(_normal(jacobian[:, seen] / scale[seen]), rcond=_SINGULAR)
    widths = np.full(scale.size, np.inf)
    widths[seen] = _NORMAL_95 * np.sqrt(np.diag(inverse)) / scale[seen]
    return widths


def _summarize(problem: _Problem, unknowns: Array, converged: bool) -> Fit:
    """Return the fit at some unknowns."""
    errors, jacobian = problem.evaluate(unknowns)
    values, starts, late = problem.split(unknowns)
    count = len(problem.free)
    freedom = max(errors.size - unknowns.size, 1)
    variance = float(errors @ errors) / freedom
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0  # nothing says anything of it: its interval is infinite below
    inverse = np.linalg.pinv(_normal(jacobian / scale), rcond=_SINGULAR)
    plain = np.diag(inverse) * (variance if _is_input(problem) else max(variance, 1.0))
    blocked = np.diag(inverse @ _scores(problem, errors, jacobian / scale) @ inverse)
    unseen = np.linalg.norm(jacobian, axis=0) == 0
    widths = _NORMAL_95 * np.sqrt(np.maximum(plain, blocked)) / scale
    widths[unseen] = np.inf
    sizes = np.cumsum([one.measured.size for one in problem.experiments])[:-1]
    parts = [part.reshape(one.measured.shape) for part, one in zip(
        np.split(errors, sizes), problem.experiments, strict=True)]
    return Fit(values=values, free=tuple(problem.free), half_widths=widths[:count], starts=starts,
               late=late + [one.late for one in problem.experiments],
               cost=float(errors @ errors),
               rms=1.0 if _is_input(problem) else float(np.sqrt(variance)),
               fit_percent=np.array([one.fit_percent(part) for one, part in zip(
                   problem.experiments, parts, strict=True)]),
               evaluations=problem.evaluations, converged=converged)


def _normal(jacobian: Array) -> Array:
    product: Array = jacobian.T @ jacobian
    return product


def _is_input(problem: _Problem) -> bool:
    return problem.experiments[0].method is Method.INPUT_ERROR


def _scores(problem: _Problem, errors: Array, jacobian: Array) -> Array:
    """Return the spread of the gradient over blocks of samples, whose errors may be alike."""
    spread = np.zeros((jacobian.shape[1],) * 2)
    gradients, begin = jacobian * errors[:, None], 0
    for one in problem.experiments:
        block = gradients[begin:begin + one.measured.size]
        begin += one.measured.size
        length = _BLOCK * one.measured.shape[1]
        sums = np.add.reduceat(block, np.arange(0, len(block), length), axis=0)
        spread += sums.T @ sums
    return spread
