"""
A recorded plan checked against the model, from the recording alone.

The recorded joint trajectory is carried out by the arm of the recording under the joint controller
that it was published for, exactly as when it was certified, with feedback and without; nothing of
the collocation that made the plan is used. The costates of the recording then show whether its
efforts are those of an optimal motion.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import RecordingError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.execution import Execution, ExecutionLimits
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
import numpy as np

_MICROMETRE = 1e-6
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckLimits:
    """
    What the findings must not exceed; the boundary error has the limit of the task.

    Attributes
    ----------
    execution : ExecutionLimits
        Of the arrival with feedback, the same as when it was published.
    tip_deviation : float
        Of the tip on its way, with feedback, as a share of the arm's reach.
    joint_deviation : float
        Of joint angles and speeds, as a share of the largest.
    certificate_difference : float
        Of tip errors and vibrations from those of the recorded certificate, as a share of these
        and a micrometre.
    torque_error, shifted_torque_error : float
        By which a torque may leave its bounds of eq. (15) or differ from eq. (14), as a share
        of the largest torque; the second where efforts are shifted in time, and states and
        costates between the points are interpolated.
    hamiltonian_drift : float
        Spread of H relative to its largest term.
    end_error : float
        Of the first and the last sample [rad, m, rad/s, m/s].

    """

    execution: ExecutionLimits = ExecutionLimits()
    tip_deviation: float = 5e-3
    joint_deviation: float = 2e-2
    certificate_difference: float = 1e-3
    torque_error: float = 1e-6
    shifted_torque_error: float = 1e-2
    hamiltonian_drift: float = 0.02
    end_error: float = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """
    One number that the check found.

    Attributes
    ----------
    name, unit : str
        What it is.
    value, limit : float
        Passed if value <= limit.
    recorded : float or None
        The same in the recorded certificate, where it has it.

    """

    name: str
    unit: str
    value: float
    limit: float
    recorded: float | None = None

    @property
    def passed(self) -> bool:
        """Return whether the value keeps its limit; not a number does not."""
        return self.value <= self.limit

    def __str__(self) -> str:
        """Return the finding in words."""
        unit = f' {self.unit}' if self.unit else ''
        planned = '' if self.recorded is None else f', {self.recorded:.1e}{unit} when planned'
        verdict = 'passed' if self.passed else 'FAILED'
        return f'{verdict}: {self.value:.3g}{unit} (limit {self.limit:.3g}{unit}{planned})'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionCheck:
    """
    What the check of a recorded motion found.

    Attributes
    ----------
    findings : tuple of Finding
        In the order in which they are shown.
    tip : numpy.ndarray, shape (k, 2)
        Tip of the re-simulated arm at the recorded times [m].

    """

    findings: tuple[Finding, ...]
    tip: Array

    @property
    def passed(self) -> bool:
        """Return whether every finding keeps its limit."""
        return all(finding.passed for finding in self.findings)


def check_motion(request: RecordedRequest, model: ArmModel | None = None,
                 monitor: Monitor | None = None, limits: CheckLimits | None = None) -> MotionCheck:
    """
    Check the motion of a recording.

    Parameters
    ----------
    request : RecordedRequest
        With a motion.
    model : ArmModel, optional
        Of the recorded arm; default: it is compiled.
    monitor : Monitor, optional
        May stop it.
    limits : CheckLimits, optional
        What must be kept.

    Raises
    ------
    RecordingError
        If the recording has no motion.
    FlexPlannerError
        If the arm cannot rest at an end of the motion.
    StoppedError
        If the monitor stopped it.

    """
    motion, parameters = request.motion, request.parameters
    if motion is None:
        raise RecordingError(f'{request.path} has no motion to check: '
                             f'{request.report.error_msg or "it failed"}')
    model, limits = model or ArmModel(request.arm), limits or CheckLimits()
    ends = [_at_rest(model, row, parameters) for row in motion.coordinates[[0, -1]]]
    execution = Execution(
        dynamics=model, parameters=parameters, goal=motion.tip[-1], controller=request.controller,
        start=np.concatenate([motion.coordinates[0], motion.rates[0]]),
        duration=float(motion.times[-2]))
    states = _states(execution, motion, monitor)
    tip = tip_position(request.arm, states[:, :request.arm.n_coordinates])
    return MotionCheck(tip=tip, findings=(
        *_arrival(request, execution, motion, limits, monitor),
        *_way(motion, states, tip, request.arm, limits),
        *_deviation_from_rest(motion, ends, limits),
        *_deviation_from_request(request, motion, limits),
        *_optimality(model, request, parameters, limits)))


def _states(execution: Execution, motion: RecordedMotion, monitor: Monitor | None) -> Array:
    """Return the states at the recorded times, between two updates of the controller on a line."""
    carried = execution.arm.follow(motion.reference, execution.start, float(motion.times[-1]),
                                   monitor)
    return np.stack([np.interp(motion.times, carried.times, column)
                     for column in carried.states.T], axis=1)


def _at_rest(model: ArmModel, coordinates: Array, parameters: Parameters) -> Array:
    """Return the state at rest with given joint angles."""
    rest, _ = equilibrium(model, coordinates[:model.arm.n_joints], parameters)
    return np.concatenate([rest, np.zeros_like(rest)])


def _arrival(request: RecordedRequest, execution: Execution, motion: RecordedMotion,
             limits: CheckLimits, monitor: Monitor | None) -> list[Finding]:
    """Return where the arm arrives, and how that differs from the recorded certificate."""
    reference, reach, planned = motion.reference, request.arm.reach, request.execution
    found = []
    for arm in (execution, execution.open_loop):
        state = arm.arrive(reference, monitor)
        found += [arm.tip_error(state), arm.vibration(state)]
    expected = None if planned is None else [
        planned.tip_error, planned.residual_vibration, planned.open_loop_tip_error,
        planned.open_loop_residual_vibration]
    findings = [
        Finding(name=f'executed {name}', unit='m', value=value, limit=limit * reach,
                recorded=None if expected is None else expected[k])
        for k, (name, value, limit) in enumerate((
            ('tip error', found[0], limits.execution.tip_error),
            ('residual vibration', found[1], limits.execution.residual_vibration)))]
    if expected is not None:
        findings.append(Finding(
            name='difference from the certificate', unit='', limit=limits.certificate_difference,
            value=float(max(abs(value - before) / (before + _MICROMETRE)
                            for value, before in zip(found, expected, strict=True)))))
    return findings


def _way(motion: RecordedMotion, states: Array, tip: Array, arm: Arm,
         limits: CheckLimits) -> list[Finding]:
    """Return the distances of tip and joints from the recorded ones on the way."""
    n, n_t = arm.n_joints, arm.n_coordinates
    pairs = ((states[:, :n], motion.coordinates[:, :n]),
             (states[:, n_t:n_t + n], motion.rates[:, :n]))
    shares = [np.abs(found - recorded).max() / max(np.ptp(recorded, axis=0).max(), _TINY)
              for found, recorded in pairs]
    return [Finding(name='largest tip deviation', unit='m', limit=limits.tip_deviation * arm.reach,
                    value=float(np.linalg.norm(tip - motion.tip, axis=1).max())),
            Finding(name='largest joint deviation', unit='', limit=limits.joint_deviation,
                    value=float(np.max(shares)))]


def _deviation_from_rest(motion: RecordedMotion, ends: list[Array],
                         limits: CheckLimits) -> list[Finding]:
    """Return the distances of the first and the last sample from rest."""
    samples = np.hstack([motion.coordinates, motion.rates])[[0, -1]]
    return [Finding(name=f'deviation from rest, {name}', unit='', limit=limits.end_error,
                    value=float(np.abs(sample - end).max()))
            for name, sample, end in zip(('start', 'goal'), samples, ends, strict=True)]


def _deviation_from_request(request: RecordedRequest, motion: RecordedMotion,
                            limits: CheckLimits) -> list[Finding]:
    """Return the distances of both ends from the request: joint angles, or the unbent tip."""
    task, n = request.task, request.arm.n_joints
    joints = motion.coordinates[[0, -1], :n]
    if task.space == task.JOINT:
        found, unit = joints, 'rad'
        asked = np.array([task.start_positions, task.goal_positions])
    else:
        unbent = np.hstack([joints, np.zeros((2, request.arm.n_modes))])
        found, unit = tip_position(request.arm, unbent), 'm'
        asked = np.array([(point.x, point.y) for point in (task.start_point, task.goal_point)])
    return [Finding(name=f'deviation from task, {name}', unit=unit, limit=limits.end_error,
                    value=float(np.abs(miss).max()))
            for name, miss in zip(('start', 'goal'), found - asked, strict=True)]


def _optimality(model: ArmModel, request: RecordedRequest, parameters: Parameters,
                limits: CheckLimits) -> list[Finding]:
    """Return the violation of the torque bounds, and the errors of efforts and Hamiltonian."""
    motion = request.motion
    assert motion is not None
    # the last sample holds the arm, it is not of the extremal
    z, efforts = motion.extended_states[:-1], motion.torques[:-1]
    controls = model.controls(z, parameters.stack())
    powers = np.abs(motion.position_costates * motion.rates).max()
    scale = max(float(controls.cost_rate.max()), float(powers), _TINY)
    share, applied = limits.torque_error, z
    if request.effort_delay:
        share, applied = limits.shifted_torque_error, _shifted(model, request, parameters)
    n, n_t = model.arm.n_joints, model.arm.n_coordinates
    lower, upper = TorqueLimits.of(model.arm).bounds(applied[:, n_t:n_t + n])
    beyond = np.abs(efforts) - np.where(efforts >= 0, upper, -lower)
    expected = model.controls(applied, parameters.stack()).torque
    size = share * max(float(np.abs(motion.torques).max()), _TINY)
    return [
        Finding(name='torque beyond its bounds', unit='N m', limit=size,
                value=max(float(beyond.max()), 0.0)),
        Finding(name='torques against eq. (14)', unit='N m', limit=size,
                value=float(np.abs(expected - efforts).max())),
        Finding(name='Hamiltonian drift', unit='', limit=limits.hamiltonian_drift,
                value=float(np.ptp(controls.hamiltonian)) / scale)]


def _shifted(model: ArmModel, request: RecordedRequest, parameters: Parameters) -> Array:
    """Return extended states at the times whose torques the efforts are, shape (k, 4 n_t)."""
    from scipy.interpolate import CubicHermiteSpline  # see `ArmDynamics.prepare`

    motion = request.motion
    assert motion is not None
    z, times = motion.extended_states[:-1], motion.times[:-1]
    spline = CubicHermiteSpline(times, z, model.optimality(z, parameters.stack()))
    states: Array = spline(np.clip(times - request.effort_delay, 0, times[-1]))
    return states
