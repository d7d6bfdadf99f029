"""Whether the efforts of a recording are those of an optimal motion, by its costates."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.reports.recording.contents import RecordedMotion
from flex_planner.reports.recording.findings import CheckLimits, Finding
import numpy as np

_TINY = float(np.finfo(float).tiny)
# points are at whole nanoseconds
_SAME_TIME = 1e-9


def optimality_findings(model: ArmModel, motion: RecordedMotion, parameters: Parameters,
                        limits: CheckLimits, delay: float, settled: float,
                        interpolation_error: float, via_times: Array) -> list[Finding]:
    """
    Return the violation of the torque bounds, and the errors of efforts and Hamiltonian.

    Parameters
    ----------
    model : ArmModel
        Of the recorded arm.
    motion : RecordedMotion
        The motion.
    parameters : Parameters
        Of its plan.
    limits : CheckLimits
        What must be kept.
    delay : float
        By which efforts come later than the planned torques [s].
    settled : float
        From when on efforts are those of the motion, and not on the way from those that hold the
        arm [s].
    interpolation_error : float
        Of the efforts, as the report has it [N m].
    via_times : numpy.ndarray
        At which H may jump, as via points are passed then [s].

    """
    # the samples that hold the arm are not of the extremal
    moving = motion.moving
    z, efforts = motion.extended_states[moving], motion.torques[moving]
    controls = model.controls(z, parameters.stack())
    powers = np.abs(motion.position_costates * motion.rates).max()
    scale = max(float(controls.cost_rate.max()), float(powers), _TINY)
    share, applied, more = limits.torque_error, z, 0.0
    if delay:
        share, more = limits.shifted_torque_error, interpolation_error
        applied = _shifted(model, motion, parameters, delay)
    ramp = motion.since(settled).start - moving.start
    applied, efforts = applied[ramp:], efforts[ramp:]
    n, n_t = model.arm.n_joints, model.arm.n_coordinates
    lower, upper = TorqueLimits.of(model.arm).bounds(applied[:, n_t:n_t + n])
    beyond = np.abs(efforts) - np.where(efforts >= 0, upper, -lower)
    expected = model.controls(applied, parameters.stack()).torque
    size = share * max(float(np.abs(motion.torques).max()), _TINY) + more
    return [
        Finding(name='torque beyond its bounds', unit='N m', limit=size,
                value=max(float(beyond.max()), 0.0)),
        Finding(name='torques against the costates', unit='N m', limit=size,
                value=float(np.abs(expected - efforts).max())),
        Finding(name='Hamiltonian drift', unit='', limit=limits.hamiltonian_drift,
                value=_spread(controls.hamiltonian, motion.times[moving], via_times) / scale)]


def _spread(values: Array, times: Array, jumps: Array) -> float:
    """Return the largest spread of values between times at which they may jump."""
    phases = np.searchsorted(jumps, times + _SAME_TIME, side='right')
    return max(float(np.ptp(values[phases == k])) for k in np.unique(phases))


def _shifted(model: ArmModel, motion: RecordedMotion, parameters: Parameters,
             delay: float) -> Array:
    """Return extended states at the times whose torques the efforts are, shape (k, 4 n_t)."""
    from scipy.interpolate import CubicHermiteSpline  # see `ArmDynamics.prepare`

    z, times = motion.extended_states[motion.moving], motion.times[motion.moving]
    spline = CubicHermiteSpline(times, z, model.optimality(z, parameters.stack()))
    states: Array = spline(np.clip(times - delay, times[0], times[-1]))
    return states
