"""Integration of the arm's motion under given torques, independent of the collocation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.integrate import solve_ivp


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
        """Return what turns coefficients into values at positions (k,), shape (k, d + 1)."""
        basis = legvander(2 * theta - 1, self.coefficients.shape[1] - 1)
        return basis.astype(np.float64, copy=False)


def simulate(model: ArmModel, p: Array, state: Array, torque: Callable[[float], Array],
             duration: float, monitor: Monitor | None = None, *, rtol: float = 1e-8,
             atol: float = 1e-10) -> Array:
    """
    Return the state after a time under open-loop torques, by SciPy's DOP853.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    p : numpy.ndarray
        Stacked `Parameters` of the plant; its motor limits are not applied.
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
    state_rate = model.state_rate(p)

    def rate(time: float, x: Array) -> Array:
        watch.check()
        result: Array = state_rate(x, torque(time)).copy()
        return result

    result = solve_ivp(rate, (0.0, duration), state, method='DOP853', rtol=rtol, atol=atol)
    final: Array = result.y[:, -1] if result.success else np.full_like(state, np.nan)
    return final
