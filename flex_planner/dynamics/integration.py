"""
Integration of the arm's motion under given torques, independent of the collocation.

Steps of the Dormand-Prince method of order 8 with SciPy's coefficients and error control,
compiled together with the arm's dynamics.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Protocol

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics, RUNGE_KUTTA_STAGES, RungeKuttaSteps
from flex_planner.dynamics.compiled_integration import cross_intervals
import numpy as np
from numpy.polynomial.legendre import legvander

_SAFETY, _LARGEST_GROWTH = 0.9, 5.0
# an interval or a period is not cut finer: the motion must have run away
_MOST_STEPS = 4096
# steps of an interval up to which the torques of all intervals are found at once
_TABLE_STEPS = 16
# error of a step below which half as many are as good, with a margin: the order is 8
_EASY = 2.0**-10
_SMALLEST = float(np.finfo(np.float64).tiny)
# bases of polynomials that are kept: of meshes of many motions the same
_KEPT_BASES, _MOST_KEPT_ROWS = 64, 1024


@dataclass(frozen=True, slots=True, eq=False)
class PiecewisePolynomial:
    """
    A vector function of time, quick to evaluate at one time.

    Attributes
    ----------
    breaks : numpy.ndarray, shape (N + 1,)
        Increasing.
    coefficients : numpy.ndarray, shape (N, d + 1, k)
        Of the Legendre polynomials over each interval.

    """

    breaks: Array
    coefficients: Array

    @classmethod
    def through(cls, breaks: Array, theta: Array, values: Array) -> PiecewisePolynomial:
        """Interpolate values (N, d + 1, k) at positions theta (d + 1,) in each interval."""
        polynomials = legvander(2 * theta - 1, theta.size - 1)
        coefficients: Array = np.linalg.inv(polynomials) @ values
        return cls(breaks, coefficients)

    def __call__(self, time: float) -> Array:
        """Return the value at one time, shape (k,)."""
        last = self.breaks.size - 2
        k = min(max(int(self.breaks.searchsorted(time, 'right')) - 1, 0), last)
        start, end = self.breaks[k], self.breaks[k + 1]
        value: Array = self.within(k, np.array([(time - start) / (end - start)]))[0]
        return value

    def within(self, interval: int, theta: Array) -> Array:
        """Return the values at positions (k,), 0 to 1, of an interval."""
        values: Array = self.basis(theta) @ self.coefficients[interval]
        return values

    def basis(self, theta: Array) -> Array:
        """Return the matrix from coefficients to values at positions (k,), shape (k, d + 1)."""
        degree = self.coefficients.shape[1] - 1
        if theta.size > _MOST_KEPT_ROWS:
            return _legendre_basis(theta, degree)
        return _kept_basis(theta.astype(np.float64, copy=False).tobytes(), degree)


@lru_cache(maxsize=_KEPT_BASES)
def _kept_basis(theta: bytes, degree: int) -> Array:
    """Return `_legendre_basis`, read-only, at float64 positions as bytes."""
    basis = _legendre_basis(np.frombuffer(theta), degree)
    basis.setflags(write=False)
    return basis


def _legendre_basis(theta: Array, degree: int) -> Array:
    """Return the Legendre polynomials over an interval at positions (k,), (k, degree + 1)."""
    return legvander(2 * theta - 1, degree).astype(np.float64, copy=False)


class TorqueProfile(Protocol):
    """A torque that is smooth between its breaks and may jump or bend there."""

    @property
    def breaks(self) -> Array:
        """Return the times [s] at which steps of an integrator must end, shape (N + 1,)."""

    def basis(self, shares: Array) -> Array:
        """Return a matrix for `within`, at shares (k,) of an interval, 0 to 1."""

    def within(self, interval: int, basis: Array) -> Array:
        """Return the torques in an interval where `basis` was taken, shape (k, n) [N m]."""

    def everywhere(self, basis: Array) -> Array:
        """Return `within` of all intervals, shape (N, k, n) [N m]."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearTorque:
    """
    A torque that is linear between given times.

    Attributes
    ----------
    breaks : numpy.ndarray, shape (N + 1,)
        Increasing [s].
    torques : numpy.ndarray, shape (N + 1, n)
        [N m].

    """

    breaks: Array
    torques: Array

    def basis(self, shares: Array) -> Array:
        """Return the weights of the torques at both ends, shape (k, 2)."""
        return np.stack([1 - shares, shares], axis=1)

    def within(self, interval: int, basis: Array) -> Array:
        """Return the torques in an interval, shape (k, n)."""
        torques: Array = basis @ self.torques[interval:interval + 2]
        return torques

    def everywhere(self, basis: Array) -> Array:
        """Return the torques in all intervals, shape (N, k, n)."""
        torques: Array = basis @ np.stack([self.torques[:-1], self.torques[1:]], axis=1)
        return torques


def integrate(dynamics: ArmDynamics, physical: Array, state: Array, torque: TorqueProfile,
              monitor: Monitor | None = None, *, rtol: float = 1e-8,
              atol: float = 1e-10) -> Array:
    """
    Return the states at the breaks of a torque that is applied open loop.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    physical : numpy.ndarray
        `PhysicalParameters.physical` of the plant.
    state : numpy.ndarray, shape (2 n_t,)
        At the first break.
    torque : TorqueProfile
        Limits of motors are not applied to it.
    monitor : Monitor, optional
        May stop it.
    rtol, atol : float
        Error of a step, relative and absolute.

    Returns
    -------
    numpy.ndarray, shape (N + 1, 2 n_t)
        NaN from where the integration failed.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    watch = monitor or Monitor()
    states = np.full((torque.breaks.size, state.size), np.nan)
    states[0] = state
    step = dynamics.runge_kutta_address
    if step is None or not cross_intervals(
            step, _StageTorques(torque, watch), torque.breaks, physical, states,
            width=RUNGE_KUTTA_STAGES * dynamics.arm.n_joints, rtol=rtol, atol=atol,
            safety=_SAFETY, largest_growth=_LARGEST_GROWTH):
        _cross_all(dynamics.runge_kutta_steps(physical), torque, watch, states, (rtol, atol))
    return states


class _StageTorques:
    """The torques at the stages of steps, kept of all intervals where the steps are few."""

    def __init__(self, torque: TorqueProfile, monitor: Monitor) -> None:
        self._torque, self._monitor = torque, monitor
        self._tables: dict[int, Array] = {}

    @property
    def most_tabled(self) -> int:
        """Return up to how many steps the torques of all intervals stand in one table."""
        return _TABLE_STEPS

    def check(self) -> None:
        """Ask the monitor whether to go on."""
        self._monitor.check()

    def at(self, interval: int, count: int) -> Array | None:
        """Return those of equal steps of an interval, None if they are too many."""
        if count > _MOST_STEPS:
            return None
        if count > _TABLE_STEPS:
            return np.ascontiguousarray(
                self._torque.within(interval, self._torque.basis(_stage_shares(count))))
        if count not in self._tables:
            basis = self._torque.basis(_stage_shares(count))
            self._tables[count] = np.ascontiguousarray(self._torque.everywhere(basis))
        torques: Array = self._tables[count][interval]
        return torques


def _cross_all(advance: RungeKuttaSteps, torque: TorqueProfile, monitor: Monitor, states: Array,
               tolerances: tuple[float, float]) -> None:
    """Fill in the states at the breaks: the reference of integration.c."""
    basis = cache(lambda count: torque.basis(_stage_shares(count)))
    steps = 1.0  # that an interval needs
    with np.errstate(over='ignore', invalid='ignore'):
        for interval, length in enumerate(np.diff(torque.breaks).tolist()):
            error = np.inf
            while not error <= 1:
                monitor.check()
                count = int(np.ceil(steps))
                if count > _MOST_STEPS:
                    return
                torques = torque.within(interval, basis(count)).reshape(count, -1)
                after, error = _cross(advance, states[interval], torques, length / count,
                                      tolerances)
                needed = error ** (1 / 8) / _SAFETY if np.isfinite(error) else _LARGEST_GROWTH
                steps = count * min(max(needed, 1 / _LARGEST_GROWTH), _LARGEST_GROWTH)
            states[interval + 1] = after


class HeldTorqueIntegrator:
    """
    Crosses period after period under torques that are held.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    physical : numpy.ndarray
        `PhysicalParameters.physical` of the plant.
    period : float
        [s].
    longest_step : float
        [s].
    rtol, atol : float
        Error of a step, relative and absolute.

    """

    def __init__(self, dynamics: ArmDynamics, physical: Array, *, period: float,
                 longest_step: float, rtol: float, atol: float) -> None:
        self._step, self._period = dynamics.held_step(physical), period
        self._tolerances = rtol, atol
        self._fewest = self._steps = int(np.ceil(period / longest_step - 1e-9))

    def advance(self, state: Array, torque: Array) -> Array | None:
        """Return the state (2 n_t,) after one period; None if it has run away."""
        with np.errstate(over='ignore', invalid='ignore'):
            while self._steps <= _MOST_STEPS:
                after, error = self._cross(state, torque)
                if error <= 1:
                    if error < _EASY:
                        self._steps = max(self._fewest, self._steps // 2)
                    return after
                self._steps *= 2
        return None

    def _cross(self, state: Array, torque: Array) -> tuple[Array, float]:
        """Return the state after equal steps, and the error of the worst of them."""
        worst, length = 0.0, self._period / self._steps
        for _ in range(self._steps):
            after, fifth, third = self._step(state, torque, length)
            worst = max(worst, step_error(np.stack([state, after]), fifth, third,
                                          self._tolerances))
            state = after.copy()
            if worst > 1:
                break
        return state, worst


def _cross(advance: RungeKuttaSteps, state: Array, torques: Array, step: float,
           tolerances: tuple[float, float]) -> tuple[Array, float]:
    """Return the state after equal steps, and the error of the worst of them."""
    after, fifth, third = advance(state, torques, step)
    return after[-1], step_error(np.vstack([state, after]), fifth, third, tolerances)


def step_error(states: Array, fifth: Array, third: Array,
               tolerances: tuple[float, float]) -> float:
    """Return the largest of `step_errors`."""
    return float(step_errors(states, fifth, third, tolerances).max())


def step_errors(states: Array, fifth: Array, third: Array,
                tolerances: tuple[float, float]) -> Array:
    """
    Return the errors of k steps, shape (k,), at most 1 if the tolerances are kept.

    Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.10.

    Parameters
    ----------
    states : numpy.ndarray, shape (k + 1, m)
        Before, between and after the steps.
    fifth, third : numpy.ndarray, shape (k, m) or (m,)
        Error estimates of those orders.
    tolerances : tuple of float
        Relative and absolute.

    """
    rtol, atol = tolerances
    size = np.abs(states)
    scale = atol + rtol * np.maximum(size[:-1], size[1:])
    first, second = (((error / scale) ** 2).sum(axis=1) for error in (fifth, third))
    bound = np.sqrt(np.maximum((first + 0.01 * second) * states.shape[1], _SMALLEST))
    errors: Array = np.nan_to_num(first / bound, nan=np.inf)
    return errors


def _stage_shares(count: int) -> Array:
    """Return the times of the stages of equal steps, as shares of the interval they cross."""
    shares: Array = ((np.arange(count)[:, None] + _stages()) / count).ravel()
    return shares


@cache
def _stages() -> Array:
    """Return the times of the stages of one step, as shares of it."""
    from scipy.integrate import DOP853

    return np.array(DOP853.C[:RUNGE_KUTTA_STAGES], dtype=float)


def simulate(dynamics: ArmDynamics, physical: Array, state: Array,
             torque: Callable[[float], Array], duration: float, monitor: Monitor | None = None, *,
             rtol: float = 1e-8,
             atol: float = 1e-10) -> Array:
    """
    Return the state after a time under open-loop torques, by SciPy's DOP853.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    physical : numpy.ndarray
        `PhysicalParameters.physical` of the plant.
    state : numpy.ndarray, shape (2 n_t,)
        At time 0.
    torque : callable
        Time [s] to torques (n,) [N m].
    duration : float
        [s].
    monitor : Monitor, optional
        May stop it.
    rtol, atol : float
        Of the integrator.

    Returns
    -------
    numpy.ndarray, shape (2 n_t,)
        NaN if the integration failed.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    watch = monitor or Monitor()
    state_rate = dynamics.state_rate(physical)

    def rate(time: float, x: Array) -> Array:
        watch.check()
        result: Array = state_rate(x, torque(time)).copy()
        return result

    from scipy.integrate import solve_ivp

    result = solve_ivp(rate, (0.0, duration), state, method='DOP853', rtol=rtol, atol=atol)
    final: Array = result.y[:, -1] if result.success else np.full_like(state, np.nan)
    return final
