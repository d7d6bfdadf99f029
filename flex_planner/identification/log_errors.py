"""Errors of a model that is to reproduce logs, by all that is not known of them."""

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

_RUN_AWAY = 1e6
# for how long errors of a wrong model are alike [s]
_BLOCK = 0.1
# for how long errors in closed loop are, where intervals hold the truth at least as often as they
# say: with half of it three of four of the delay of two links did [s]
_ALONE = 0.02


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unknowns:
    """
    What a model is made of, for n joints and n_t coordinates.

    Attributes
    ----------
    values : numpy.ndarray, shape (2 + 6 n,)
        All parameters, as `list_parameters` has them.
    starts : numpy.ndarray, shape (logs, n)
        Joint angles at the start of each log [rad].
    swings : numpy.ndarray, shape (logs, 2 n_t - n)
        By how much passive coordinates and all rates differ from rest there.
    late : numpy.ndarray, shape (logs,)
        By how much later than its log says each motion began [s].

    """

    values: Array
    starts: Array
    swings: Array
    late: Array


class LogErrors:
    """
    The errors of all logs by free parameters, states at their starts, and times of these.

    Parameters
    ----------
    model : LoopModel
        n joints.
    experiments : sequence of Experiment
        At least one.
    values : numpy.ndarray, shape (2 + 6 n,)
        Where to start; those that are not free stay.
    free : sequence of int
        Indices of those that are.
    monitor : Monitor, optional
        May stop it.

    """

    def __init__(self, model: LoopModel, experiments: Sequence[Experiment], values: Array,
                 free: Sequence[int], monitor: Monitor | None = None) -> None:
        self.model, self.experiments, self.monitor = model, experiments, monitor or Monitor()
        self.values, self.free = values.copy(), list(free)
        self.evaluations = 0
        self._last: tuple[bytes, tuple[Array, Array]] | None = None
        starts = np.array([one.start - self._offsets(values) for one in experiments])
        fastest = max(model.fastest(start, values) for start in starts)
        # as many for all evaluations, so that the errors stay smooth
        self.parts = [steps_per_part(one.law.period, 1.3 * fastest) for one in experiments]
        self.timed = [i for i, one in enumerate(experiments) if one.start_error]
        self.moving = [i for i, one in enumerate(experiments) if one.moves]
        sizes = model.sizes
        self._swings = 2 * sizes.coordinates - sizes.joints
        self.first = self.join(Unknowns(
            values=values, starts=starts, swings=np.zeros((len(experiments), self._swings)),
            late=np.zeros(len(experiments))))

    def _offsets(self, values: Array) -> Array:
        return values[self.model.sizes.physical:-1]

    def join(self, unknowns: Unknowns) -> Array:
        """Return those of the unknowns that are free."""
        return np.concatenate([
            unknowns.values[self.free], unknowns.starts.ravel(),
            unknowns.swings[self.moving].ravel(), unknowns.late[self.timed]])

    def split(self, free: Array) -> Unknowns:
        """Return all unknowns, those that are not free as they are known."""
        values, logs = self.values.copy(), len(self.experiments)
        late, swings = np.zeros(logs), np.zeros((logs, self._swings))
        ends = np.cumsum([len(self.free), logs * self.model.sizes.joints,
                          len(self.moving) * self._swings])
        values[self.free], starts, away, late[self.timed] = np.split(free, ends)
        swings[self.moving] = away.reshape(-1, self._swings)
        return Unknowns(values=values, starts=starts.reshape(logs, -1), swings=swings, late=late)

    def evaluate(self, free: Array) -> tuple[Array, Array]:
        """Return errors and their Jacobian; the last ones are kept."""
        key = free.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._evaluate(free)
        return self._last[1]

    def _evaluate(self, free: Array) -> tuple[Array, Array]:
        self.evaluations += 1
        at = self.split(free)
        parts = [self._errors(i, at) for i in range(len(self.experiments))]
        blocks = [self._place(i, slope, free.size) for i, (_, slope) in enumerate(parts)]
        errors = np.concatenate([error.ravel() for error, _ in parts])
        finite = np.nan_to_num(errors, nan=_RUN_AWAY, posinf=_RUN_AWAY, neginf=-_RUN_AWAY)
        return (np.clip(finite, -_RUN_AWAY, _RUN_AWAY),
                np.nan_to_num(np.vstack(blocks), posinf=0.0, neginf=0.0))

    def _errors(self, index: int, at: Unknowns) -> tuple[Array, Array]:
        """Return the errors of a log and their derivatives."""
        self.monitor.check()
        one = self.experiments[index]
        return one.errors(self.model.simulate(
            at.starts[index], one.followed, one.law, at.values, self.parts[index],
            at.swings[index] if one.moves else None), float(at.late[index]))

    def _place(self, index: int, slope: Array, size: int) -> Array:
        """Return the derivatives of the errors of a log by all that is free."""
        n, known = self.model.sizes.joints, len(self.values)
        block = np.zeros((*slope.shape[:2], size))
        block[..., :len(self.free)] = slope[..., self.free]
        begin = len(self.free) + n * index
        block[..., begin:begin + n] = slope[..., known:known + n]
        if index in self.moving:
            block[..., self.columns_away(index)] = slope[..., known + n:-1]
        if index in self.timed:
            block[..., size - len(self.timed) + self.timed.index(index)] = slope[..., -1]
        return block.reshape(-1, size)

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

    @property
    def is_input(self) -> bool:
        """Return whether errors are torques, whose noise is not known."""
        return self.experiments[0].method is Method.INPUT_ERROR

    def rows(self, index: int) -> slice:
        """Return which errors are those of a log."""
        ends = np.cumsum([0, *(one.measured.size for one in self.experiments)])
        return slice(int(ends[index]), int(ends[index + 1]))

    def blocks(self) -> list[int]:
        """Return where blocks of errors begin that are alike where the model is wrong."""
        found = list[int]()
        for i, one in enumerate(self.experiments):
            rows, samples = self.rows(i), max(round(_BLOCK / one.step), 1)
            found += range(rows.start, rows.stop, samples * one.measured.shape[1])
        return found

    @property
    def crowding(self) -> float:
        """
        Return how many samples say no more than one, for intervals.

        In closed loop the noise of encoders moves the arm, too, by way of the drive: it shakes
        dry friction loose, and errors are alike for a while.

        """
        return max(max(_ALONE / one.step, 1.0) if one.method is Method.CLOSED_LOOP else 1.0
                   for one in self.experiments)

    def columns_away(self, index: int) -> slice:
        """Return which columns are those of the state at the start of a log that moves."""
        begin = len(self.free) + self.model.sizes.joints * len(self.experiments)
        at = begin + self._swings * self.moving.index(index)
        return slice(at, at + self._swings)
