"""Whether the efforts of a recording are those of an optimal motion, by its costates."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel, Controls
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.optimal_control.torque_offset import TorqueOffset
from flex_planner.reports.recording.contents import RecordedMotion
from flex_planner.reports.recording.findings import CheckLimits, Finding
import numpy as np

_TINY = float(np.finfo(float).tiny)
# points are at whole nanoseconds
_SAME_TIME = 1e-9


def optimality_findings(model: ArmModel, motion: RecordedMotion, parameters: Parameters,
                        limits: CheckLimits, delay: float, settled: float,
                        interpolation_error: float, via_times: Array,
                        offset: TorqueOffset | None = None) -> list[Finding]:
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
    offset : TorqueOffset, optional
        From which effort is measured.

    """
    law = _TorqueLaw(model, parameters, offset or TorqueOffset.zero(1.0, model.arm.n_joints))
    # the samples that hold the arm are not of the extremal
    moving = motion.moving
    z, efforts = motion.extended_states[moving], motion.torques[moving]
    times = motion.times[moving] - motion.begin
    controls = law.controls(times, z)
    powers = np.abs(motion.position_costates * motion.rates).max()
    scale = max(float(controls.cost_rate.max()), float(powers), _TINY)
    share, applied, applied_at, more = limits.torque_error, z, times, 0.0
    if delay:
        share, more = limits.shifted_torque_error, interpolation_error
        applied_at, applied = law.shifted(times, z, delay)
    ramp = motion.since(settled).start - moving.start
    applied_at, applied, efforts = applied_at[ramp:], applied[ramp:], efforts[ramp:]
    n, n_t = model.arm.n_joints, model.arm.n_coordinates
    lower, upper = TorqueLimits.of(model.arm).bounds(applied[:, n_t:n_t + n])
    beyond = np.abs(efforts) - np.where(efforts >= 0, upper, -lower)
    expected = law.controls(applied_at, applied).torque
    size = share * max(float(np.abs(motion.torques).max()), _TINY) + more
    return [
        Finding(name='torque beyond its bounds', unit='N m', limit=size,
                value=max(float(beyond.max()), 0.0)),
        Finding(name='torques against the costates', unit='N m', limit=size,
                value=float(np.abs(expected - efforts).max())),
        Finding(name='Hamiltonian drift', unit='', limit=limits.hamiltonian_drift,
                value=spread_between(controls.hamiltonian - law.due(times, controls),
                                     motion.times[moving], via_times) / scale)]


def spread_between(values: Array, times: Array, jumps: Array) -> float:
    """Return the largest spread of values between times at which they may jump."""
    phases = np.searchsorted(jumps, times + _SAME_TIME, side='right')
    return max(float(np.ptp(values[phases == k])) for k in np.unique(phases))


@dataclass(frozen=True, slots=True, eq=False)
class _TorqueLaw:
    """The conditions that efforts, costates and Hamiltonian of an optimal motion meet."""

    model: ArmModel
    parameters: Parameters
    offset: TorqueOffset

    @property
    def measured_from_zero(self) -> bool:
        return not self.offset.coefficients.any()

    def controls(self, times: Array, z: Array) -> Controls:
        """Return what the conditions determine at times (k,) of the motion."""
        p = self.parameters.stack()
        if self.measured_from_zero:
            return self.model.controls(z, p)
        return self.model.offset_controls(z, self.offset(times), p)

    def due(self, times: Array, controls: Controls) -> Array:
        """Return by how much H is to have changed since the first time, shape (k,)."""
        if self.measured_from_zero:
            return np.zeros(len(times))
        rates = -(self.offset.rate(times) * controls.torque) @ self.parameters.effort_weights
        due: Array = np.append(0.0, np.cumsum((rates[1:] + rates[:-1]) / 2 * np.diff(times)))
        return due

    def shifted(self, times: Array, z: Array, delay: float) -> tuple[Array, Array]:
        """Return the times whose torques the efforts are, and extended states (k, 4 n_t) then."""
        from scipy.interpolate import CubicHermiteSpline  # see `ArmDynamics.prepare`

        p = self.parameters.stack()
        rates = (self.model.optimality(z, p) if self.measured_from_zero
                 else self.model.offset_optimality(z, self.offset(times), p))
        moved = np.clip(times - delay, times[0], times[-1])
        return moved, CubicHermiteSpline(times, z, rates)(moved)
