"""
Whether the efforts of a recording without jumps are those of an optimal motion, by its costates.

The rate of a torque is ``-psi_tau / S`` within its bounds: its integral is the torque, but for a
constant. H holds the price of the rates, too.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
from flex_planner.reports.recording.findings import CheckLimits, Finding
from flex_planner.reports.recording.optimality import spread_between
import numpy as np

_TINY = float(np.finfo(float).tiny)
# of the samples, for the integral
_PARTS = 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedRates:
    """
    Price and bounds of the rates of torques.

    Attributes
    ----------
    weights, bounds : numpy.ndarray, shape (n,)
        Diagonal of S, and the largest rates, infinite for none [N m/s].

    """

    weights: Array
    bounds: Array

    @classmethod
    def of(cls, request: RecordedRequest) -> RecordedRates | None:
        """Return those of a request; None where torques may jump, as in older recordings."""
        weights = np.array(getattr(request.report, 'torque_rate_weight', ()), dtype=np.float64)
        if not weights.size:
            return None
        asked = np.array(request.task.max_torque_rate, dtype=np.float64)
        return cls(weights=weights,
                   bounds=np.broadcast_to(asked if asked.size else np.inf, weights.shape))

    def rates(self, costates: Array) -> Array:
        """Return the rates of torques (k, n) that their costates say [N m/s]."""
        rates: Array = np.clip(-costates / self.weights, -self.bounds, self.bounds)
        return rates


def torque_rate_findings(model: ArmModel, motion: RecordedMotion, parameters: Parameters,
                         prices: RecordedRates, limits: CheckLimits, *, delay: float,
                         settled: float, interpolation_error: float,
                         via_times: Array) -> list[Finding]:
    """
    Return what `optimality_findings` does, of a motion whose torques have no jumps.

    Parameters
    ----------
    model, motion, parameters, limits, delay, settled, interpolation_error, via_times
        As of `optimality_findings`.
    prices : RecordedRates
        Of the motion.

    """
    moving, later = motion.moving, motion.since(settled)
    times, efforts = motion.times[moving], motion.torques[later]
    fine, changes = _integrate(prices, times, motion.torque_costates[moving])

    def change(at: Array) -> Array:
        return np.stack([np.interp(at, fine, column) for column in changes.T], axis=1)

    # efforts come later or earlier than the torques of the plan
    shifted = change(np.clip(motion.times[later] - delay, times[0], times[-1]))
    first = np.median(efforts - shifted, axis=0)
    lower, upper = TorqueLimits.of(model.arm).bounds(motion.rates[later, :efforts.shape[1]])
    size = (limits.shifted_torque_error * max(float(np.abs(motion.torques).max()), _TINY)
            + interpolation_error)
    hamiltonian, scale = _hamiltonian(model, motion, parameters, prices, first + change(times))
    return [
        Finding(name='torque beyond its bounds', unit='N m', limit=size, value=max(
            float(np.maximum(efforts - upper, lower - efforts).max()), 0.0)),
        Finding(name='torques against their costates', unit='N m', limit=size,
                value=float(np.abs(first + shifted - efforts).max())),
        Finding(name='Hamiltonian drift', unit='', limit=limits.hamiltonian_drift,
                value=spread_between(hamiltonian, times, via_times) / scale)]


def _integrate(prices: RecordedRates, times: Array, costates: Array) -> tuple[Array, Array]:
    """Return finer times (m,), and how much torques have changed since the first, (m, n) [N m]."""
    from scipy.interpolate import PchipInterpolator  # see `ArmDynamics.prepare`

    shares = np.arange(_PARTS) / _PARTS
    fine = np.append((times[:-1, None] + np.diff(times)[:, None] * shares).ravel(), times[-1])
    rates = prices.rates(PchipInterpolator(times, costates)(fine))
    steps = (rates[1:] + rates[:-1]) / 2 * np.diff(fine)[:, None]
    return fine, np.vstack([np.zeros(rates.shape[1]), np.cumsum(steps, axis=0)])


def _hamiltonian(model: ArmModel, motion: RecordedMotion, parameters: Parameters,
                 prices: RecordedRates, torques: Array) -> tuple[Array, float]:
    """Return H with torques (k, n), shape (k,), and the size of its terms."""
    moving, R = motion.moving, parameters.effort_weights
    costates, rates = motion.torque_costates[moving], prices.rates(
        motion.torque_costates[moving])
    chosen = model.controls(motion.extended_states[moving], parameters.stack())
    # y = B^T M^-1 psi_2 by eq. (13), with which H changes where another torque is taken
    pull = -R * chosen.free_torque
    effort = (R * (torques**2 - chosen.torque**2)).sum(axis=1) / 2
    price = (prices.weights * rates**2).sum(axis=1) / 2
    hamiltonian: Array = (chosen.hamiltonian + effort + (pull * (torques - chosen.torque)).sum(
        axis=1) + price + (costates * rates).sum(axis=1))
    powers = max(float(np.abs(motion.position_costates * motion.rates).max()),
                 float(np.abs(costates * rates).max()))
    return hamiltonian, max(float((chosen.cost_rate + effort + price).max()), powers, _TINY)
