"""Integration of the arm's motion under given torques, independent of the collocation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flex_planner.model import ArmModel
from flex_planner.progress import Monitor
from flex_planner.validation import Array
import numpy as np
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
        Lowest power first, of the time since the interval's start over its length.

    """

    breaks: Array
    coefficients: Array

    @classmethod
    def through(cls, breaks: Array, theta: Array, values: Array) -> PiecewisePolynomial:
        """Interpolate values (N, d + 1, k) at positions theta (d + 1,) in each interval."""
        powers = np.vander(theta, increasing=True)
        coefficients = np.linalg.solve(powers[None], values)
        return cls(breaks, coefficients.astype(np.float64))

    def __call__(self, time: float) -> Array:
        """Return the value at one time, shape (k,)."""
        last = self.breaks.size - 2
        k = min(max(int(self.breaks.searchsorted(time, 'right')) - 1, 0), last)
        start, end = self.breaks[k], self.breaks[k + 1]
        theta = (time - start) / (end - start)
        pieces = self.coefficients[k]
        value: Array = theta ** np.arange(len(pieces)) @ pieces
        return value


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
