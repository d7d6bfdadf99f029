"""
Identify an arm, its payload and its drive from logs.

The fit with the planned number of modes is repeated with one mode more and with each log alone:
where the model is not the plant, the spread between these says more than any interval.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, integer, number
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
from flex_planner.identification.drive import Drive
from flex_planner.identification.experiments import (
    by_torques,
    closed_loop,
    Experiment,
    LogError,
    Method,
)
from flex_planner.identification.fit import (
    COARSE,
    Fit,
    fit_parameters,
    judge_parameters,
    MOST_RMS,
    TOLERANCE,
)
from flex_planner.identification.identification import (
    Estimate,
    Finding,
    Identification,
    judge_estimate,
    Warned,
)
from flex_planner.identification.joint_log import JointLog
from flex_planner.identification.loop_model import LoopModel
from flex_planner.identification.moving_starts import find_moving_starts
from flex_planner.identification.plant_parameters import (
    check_identifiable,
    free_parameters,
    list_parameters,
    parameters_of,
    Quantity,
)
from flex_planner.optimal_control.task import MAX_PAYLOAD
import numpy as np

MOST_LOGS = 20
# of the angles that torques explain, below which friction or something else is another [%]
LEAST_FIT = 95.0
_MODES_MATTER, _AT_BOUND, _NO_WORSE = 0.02, 1e-6, 1.02
# of the squared errors with more modes, for the values to be those
_MUCH_BETTER = 0.5
# one log that began in motion makes others look so until it is taken for that
_MOST_REFITS = 2
ALL = frozenset(Quantity)


def identify(arm: Arm, logs: Sequence[JointLog], *, payload_mass: float = 0.0,
             payload_inertia: float | None = None, drive: Drive | None = None,
             free: frozenset[Quantity] = ALL, method: Method | None = None,
             more_modes: int = 1, monitor: Monitor | None = None) -> Identification:
    """
    Return the parameters of an arm with which it reproduces logs best.

    Parameters
    ----------
    arm : Arm
        As it is assumed; its number of modes is that of the fit.
    logs : sequence of JointLog
        1 to 20 motions that begin at rest.
    payload_mass, payload_inertia : float
        As assumed [kg], [kg m^2]; the inertia is that of the arm by default, and stays.
    drive : Drive, optional
        With it logs with a trajectory are fitted in closed loop.
    free : frozenset of Quantity
        What to find; all by default.
    method : Method, optional
        By default in closed loop with a drive and trajectories; else by input error, and then by
        output error if that explains at least 95 % of all angles.
    more_modes : int
        Of the second fit, 0 (none) to 4 more per link.
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound, a joint slides, or a log is of another arm.
    LogError
        If a log does not say what its method needs.
    StoppedError
        If the monitor stopped it.

    """
    check_identifiable(arm)
    monitor = monitor or Monitor()
    integer('number of logs', len(logs), at_least=1, at_most=MOST_LOGS)
    mass = number('payload_mass', payload_mass, at_least=0, at_most=MAX_PAYLOAD, unit='kg')
    integer('more_modes', more_modes, at_least=0, at_most=4)
    for log in logs:
        if log.angles.shape[1] != arm.n_joints:
            raise InvalidValueError(f'joints of {log.name}', log.angles.shape[1],
                                    f'{arm.n_joints}, as the arm has')
    inertia = arm.payload_inertia if payload_inertia is None else payload_inertia
    search = _Search(arm, logs, drive, inertia, free, monitor)
    start = parameters_of(arm, mass, drive.delay if drive else 0.0)
    used, experiments, fit = search.choose(start, method)
    experiments, fit = search.settle(search.model, experiments, fit)
    richer = search.fit_richer(used, fit, more_modes)
    single = tuple(fit_parameters(search.model, [one], fit.values, fit.free, monitor,
                                  tolerance=COARSE)
                   for one in experiments) if len(logs) > 1 else ()
    left_out = search.judge(experiments, single)
    return _conclude(search, start, used, method, fit, richer, single, left_out)


def _conclude(search: _Search, start: Array, used: Method, wanted: Method | None, fit: Fit,
              richer: Fit | None, single: tuple[Fit, ...], left_out: Array) -> Identification:
    """Return the values of the better model, and what the others say of them."""
    # a richer model that fits worse is no reason to doubt
    counts = richer if richer and richer.cost <= _NO_WORSE * fit.cost else None
    better = counts is not None and counts.cost < _MUCH_BETTER * fit.cost
    best = counts if counts and better else fit
    others = [one for one in (fit, counts) if one and one is not best]
    withheld = best.rms > MOST_RMS or best.fit_percent.min() < LEAST_FIT
    return Identification(
        arm=search.arm, richer_arm=search.richer, method=used,
        logs=tuple(log.name for log in search.logs), planned=fit, more_modes=richer, best=best,
        single=single, left_out=left_out,
        estimates=_estimates(search.arm, start, best, [*single, *others], withheld=withheld),
        warnings=tuple(_warnings(search, used, fit, counts, best, single, wanted)))


class _Search:
    """The logs and what is known, for fits with one model or another."""

    def __init__(self, arm: Arm, logs: Sequence[JointLog], drive: Drive | None, inertia: float,
                 free: frozenset[Quantity], monitor: Monitor) -> None:
        self.arm, self.logs, self.drive, self.monitor = arm, logs, drive, monitor
        self.inertia, self.free = inertia, free_parameters(arm, free)
        self.model, self.richer = LoopModel(arm, inertia), arm

    def experiments(self, method: Method, values: Array) -> list[Experiment]:
        """Return the logs as a method takes them."""
        return [self._experiment(log, method, values) for log in self.logs]

    def _experiment(self, log: JointLog, method: Method, values: Array) -> Experiment:
        holding: Array = np.zeros(self.arm.n_joints)
        if self.arm.gravity.any():
            parameters = PhysicalParameters.of_arm(self.arm, payload_mass=values[0],
                                                   payload_inertia=self.inertia)
            holding = equilibrium(ArmDynamics.of(self.arm), log.angles[0], parameters)[1]
        if method is not Method.CLOSED_LOOP:
            return by_torques(log, method, self.model, values, holding, self.drive)
        if self.drive is None:
            raise LogError('a fit in closed loop needs the law of the drive: give --drive')
        return closed_loop(log, self.drive, holding)

    def fit(self, method: Method, values: Array) -> tuple[list[Experiment], Fit]:
        """Return the fit of all logs by a method."""
        experiments = self.experiments(method, values)
        return experiments, fit_parameters(self.model, experiments, values, self.free,
                                           self.monitor)

    def choose(self, values: Array, method: Method | None) -> tuple[Method, list[Experiment], Fit]:
        """Return the method, the logs as it takes them, and the fit."""
        simulates = self.drive is not None and all(log.reference for log in self.logs)
        if method is None and simulates:
            method = Method.CLOSED_LOOP
        if method is not None:
            return method, *self.fit(method, values)
        experiments, fit = self.fit(Method.INPUT_ERROR, values)
        better = self.fit(Method.OUTPUT_ERROR, fit.values)
        if better[1].converged and better[1].fit_percent.min() >= LEAST_FIT:
            return Method.OUTPUT_ERROR, *better
        return Method.INPUT_ERROR, experiments, fit

    def settle(self, model: LoopModel, experiments: list[Experiment], fit: Fit, *,
               tolerance: float = TOLERANCE) -> tuple[list[Experiment], Fit]:
        """Return a fit in which the state at the start of logs that began in motion is free."""
        for _ in range(_MOST_REFITS):
            moving = find_moving_starts(model, experiments, fit, self.monitor)
            if moving == fit.moving:
                break
            experiments = [replace(one, moves=i in moving) for i, one in enumerate(experiments)]
            fit = fit_parameters(model, experiments, fit.values, fit.free, self.monitor,
                                 tolerance=tolerance)
        return experiments, fit

    def fit_richer(self, method: Method, fit: Fit, more: int) -> Fit | None:
        """Return a fit with more modes; None where there are none."""
        links = tuple(link.with_more_modes(more) if link.modes else link
                      for link in self.arm.links)
        self.richer = replace(self.arm, links=links)
        if self.richer.n_coordinates == self.arm.n_coordinates:
            return None
        model = LoopModel(self.richer, self.inertia)
        experiments = self.experiments(method, fit.values)
        richer = fit_parameters(model, experiments, fit.values, fit.free, self.monitor,
                                tolerance=COARSE)
        return self.settle(model, experiments, richer, tolerance=COARSE)[1]

    def judge(self, experiments: Sequence[Experiment], single: Sequence[Fit]) -> Array:
        """Return how much of each log fits to the others explain, at least."""
        left_out = np.full((len(experiments), self.arm.n_joints), np.nan)
        for i, one in enumerate(experiments):
            judged = [judge_parameters(self.model, [one], other.values, self.monitor).fit_percent
                      for j, other in enumerate(single) if j != i]
            if judged:
                left_out[i] = np.min(judged, axis=(0, 1))
        return left_out


def _estimates(arm: Arm, start: Array, fit: Fit, others: Sequence[Fit], *,
               withheld: bool) -> tuple[Estimate, ...]:
    """Return every parameter that the arm has."""
    shown = free_parameters(arm, ALL)
    widths = dict(zip(fit.free, fit.half_widths, strict=True))
    parameters = list_parameters(arm.n_joints)
    spread = (np.max([np.abs(other.values - fit.values) for other in others], axis=0)
              if others else np.full(len(start), np.nan))
    return tuple(
        judge_estimate(parameters[i], float(fit.values[i]), float(start[i]),
                       float(widths.get(i, np.nan)), float(spread[i]),
                       free=bool(np.isfinite(widths.get(i, np.inf))), withheld=withheld)
        for i in shown)


def _warnings(search: _Search, used: Method, fit: Fit, richer: Fit | None, best: Fit,
              single: Sequence[Fit], wanted: Method | None) -> list[Warned]:
    """Return what is to be known before the values are used."""
    found = [*_misfit(best), *_moving(search, best)]
    if used is Method.INPUT_ERROR and wanted is None:
        found.append(Warned(code=Finding.FRICTION, text=(
            f'the torques explain less than {LEAST_FIT:g} % of the angles, so what the model must '
            'add to the torques was made small instead (input error)')))
    if richer is not None:
        found += _modes(search, fit, richer, best)
    if len(search.logs) == 1:
        found.append(Warned(code=Finding.ONE_LOG, text=(
            'one log cannot say whether another one agrees: record a second motion')))
    elif max(_relative(one.values, fit.values, search.free) for one in single) > _MODES_MATTER:
        found.append(Warned(code=Finding.LOGS_DISAGREE, text=(
            'logs by themselves lead to a stiffness or a payload that differs by more than '
            f'{100 * _MODES_MATTER:g} %: see their spread')))
    if not best.converged:
        found.append(Warned(code=Finding.NOT_CONVERGED, text=(
            'the fit has not converged: begin with better values in the arm file, or with fewer '
            'free parameters')))
    return [*found, *_bounds(search, best)]


def _misfit(best: Fit) -> list[Warned]:
    """Return whether the model is not the plant."""
    if best.rms > MOST_RMS:
        return [Warned(code=Finding.NOT_THE_PLANT, text=(
            f'the model is not the plant: its errors are {best.rms:.3g} times the noise of the '
            'encoders, so intervals would be too narrow and are withheld; the spread between '
            'single logs and numbers of modes is the honest figure. Try --modes with one more, '
            'and look for what the arm file cannot say'))]
    if best.fit_percent.min() < LEAST_FIT:
        return [Warned(code=Finding.NOT_THE_PLANT, text=(
            f'the model explains only {best.fit_percent.min():.3g} % of a joint: intervals are '
            'withheld. Look for friction, cogging or elasticity that the arm file cannot say'))]
    return []


def _moving(search: _Search, best: Fit) -> list[Warned]:
    """Return which logs began in motion."""
    names = [search.logs[i].name for i in best.moving]
    return [Warned(code=Finding.BEGAN_IN_MOTION, text=(
        f'{", ".join(names)}: the arm still moved when the motion began. How it did was found, '
        'too, which makes intervals wider; wait longer before a motion'))] if names else []


def _modes(search: _Search, fit: Fit, richer: Fit, best: Fit) -> list[Warned]:
    """Return whether the number of modes matters."""
    change = 100 * _relative(richer.values, fit.values, search.free)
    if best is richer:
        return [Warned(code=Finding.MODES_MATTER, text=(
            f'with more modes the errors are {np.sqrt(fit.cost / richer.cost):.2g} times smaller, '
            f'and a stiffness or the payload changes by {change:.2g} %: the values are those with '
            'more modes, which the arm file has now'))]
    if change <= 100 * _MODES_MATTER:
        return []
    return [Warned(code=Finding.MODES_MATTER, text=(
        f'with more modes a stiffness or the payload changes by {change:.2g} %, and the errors '
        'hardly: the logs do not tell how many modes there are'))]


def _relative(values: Array, others: Array, free: Sequence[int]) -> float:
    """Return the largest relative difference of payload and stiffness."""
    parameters = list_parameters((len(values) - 2) // 6)
    chosen = [i for i in free if parameters[i].kind in (Quantity.PAYLOAD, Quantity.RIGIDITY)]
    floor = np.maximum(np.abs(others[chosen]), 1e-3)
    return float(np.max(np.abs(values[chosen] - others[chosen]) / floor, initial=0.0))


def _bounds(search: _Search, fit: Fit) -> list[Warned]:
    """Return which parameters ended at zero."""
    parameters = list_parameters(search.arm.n_joints)
    names = [parameters[i].name for i in fit.free
             if parameters[i].kind is not Quantity.OFFSET
             and fit.values[i] <= parameters[i].lower_bound + _AT_BOUND]
    if not names:
        return []
    return [Warned(code=Finding.AT_BOUND, text=(
        f'{", ".join(names)} ended at the least value that makes sense, as if there were none'))]
