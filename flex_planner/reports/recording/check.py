"""
A recorded plan checked against the model, from the recording alone.

The recorded torques, interpolated linearly as a controller does, are applied to the arm of the
recording; nothing of the collocation that made the plan is used. What linear interpolation
changes is in the result: this is what the arm will do, apart from feedback.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import RecordingError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.dynamics.integration import integrate, LinearTorque
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
import numpy as np

_RTOL = 1e-10
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckLimits:
    """
    What the findings must not exceed; the boundary error has the limit of the task.

    Attributes
    ----------
    tip_deviation : float
        Of the tip, as a share of the arm's reach: linear interpolation costs up to 1e-4 at the
        planner's default sampling.
    joint_deviation : float
        Of joint angles and speeds, as a share of the largest.
    torque_error : float
        By which a torque may leave its bounds of eq. (15) or differ from eq. (14), as a share
        of the largest torque.
    hamiltonian_drift : float
        Spread of H relative to its largest term.
    end_error : float
        Of the first and the last sample [rad, m, rad/s, m/s].

    """

    tip_deviation: float = 1e-3
    joint_deviation: float = 1e-2
    torque_error: float = 1e-6
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
    ends = [_start_state(model, request, motion),
            _at_rest(model, motion.coordinates[-1], parameters)]
    states = integrate(model, parameters.physical, ends[0],
                       LinearTorque(motion.times, motion.torques), monitor, rtol=_RTOL,
                       atol=_RTOL / 100)
    tip = tip_position(request.arm, states[:, :request.arm.n_coordinates])
    return MotionCheck(tip=tip, findings=(
        *_resimulation(request, motion, states[-1] - ends[1], tip, limits),
        _joint_path(motion, states, request.arm.n_joints, limits),
        *_deviation_at_ends(request, motion, ends, limits),
        *_deviation_from_request(request, motion, limits),
        *_optimality(model, motion, parameters, limits)))


def _start_state(model: ArmModel, request: RecordedRequest, motion: RecordedMotion) -> Array:
    """Return the state at the start: at rest with the joint angles, or as the request has it."""
    task, state = request.task, _at_rest(model, motion.coordinates[0], request.parameters)
    n, n_t = model.arm.n_joints, model.arm.n_coordinates
    if len(task.start_modal_displacements):
        state[:n] = task.start_positions
        state[n:n_t] = task.start_modal_displacements
    state[n_t:n_t + len(task.start_velocities)] = task.start_velocities
    return state


def _at_rest(model: ArmModel, coordinates: Array, parameters: Parameters) -> Array:
    """Return the state at rest with given joint angles."""
    rest, _ = equilibrium(model, coordinates[:model.arm.n_joints], parameters)
    return np.concatenate([rest, np.zeros_like(rest)])


def _resimulation(request: RecordedRequest, motion: RecordedMotion, miss: Array, tip: Array,
                  limits: CheckLimits) -> list[Finding]:
    """Return the errors of the motion that the recorded torques lead to."""
    most = limits.tip_deviation * request.arm.reach
    distance = np.linalg.norm(tip - motion.tip, axis=1)
    return [
        Finding(name='tip error at the end', unit='m', value=float(distance[-1]), limit=most,
                recorded=float(request.report.tip_error)),
        Finding(name='largest tip deviation', unit='m', value=float(distance.max()), limit=most),
        Finding(name='boundary error (eq. 17)', unit='', value=float(miss @ miss / 2),
                limit=request.tolerance, recorded=float(request.report.boundary_error))]


def _joint_path(motion: RecordedMotion, states: Array, n: int, limits: CheckLimits) -> Finding:
    """Return the distance of the joints' angles and speeds from the recorded ones."""
    n_t = motion.coordinates.shape[1]
    pairs = ((states[:, :n], motion.coordinates[:, :n]),
             (states[:, n_t:n_t + n], motion.rates[:, :n]))
    shares = [np.abs(found - recorded).max() / max(np.ptp(recorded, axis=0).max(), _TINY)
              for found, recorded in pairs]
    return Finding(name='largest joint deviation', unit='', limit=limits.joint_deviation,
                   value=float(np.max(shares)))


def _deviation_at_ends(request: RecordedRequest, motion: RecordedMotion, ends: list[Array],
                       limits: CheckLimits) -> list[Finding]:
    """Return the distances of the first and the last sample from rest, or from a moving start."""
    task, samples = request.task, np.hstack([motion.coordinates, motion.rates])[[0, -1]]
    moves = len(task.start_modal_displacements) or np.any(task.start_velocities)
    names = 'its state, start' if moves else 'rest, start', 'rest, goal'
    return [Finding(name=f'deviation from {name}', unit='', limit=limits.end_error,
                    value=float(np.abs(sample - end).max()))
            for name, sample, end in zip(names, samples, ends, strict=True)]


def _deviation_from_request(request: RecordedRequest, motion: RecordedMotion,
                            limits: CheckLimits) -> list[Finding]:
    """Return the distances of both ends from the request: joint angles, or the resting tip."""
    task, n = request.task, request.arm.n_joints
    found = motion.coordinates[[0, -1]]
    tips = tip_position(request.arm, found)
    ends = (('start', task.space != task.CARTESIAN), ('goal', task.space == task.JOINT))
    findings = []
    for (name, by_angles), coordinates, tip in zip(ends, found, tips, strict=True):
        point = getattr(task, f'{name}_point')
        miss = (coordinates[:n] - getattr(task, f'{name}_positions') if by_angles
                else tip - (point.x, point.y))
        findings.append(Finding(
            name=f'deviation from task, {name}', unit='rad' if by_angles else 'm',
            limit=limits.end_error, value=float(np.abs(miss).max())))
    return findings


def _optimality(model: ArmModel, motion: RecordedMotion, parameters: Parameters,
                limits: CheckLimits) -> list[Finding]:
    """Return the violation of the torque bounds, and the errors of torques and Hamiltonian."""
    n, size = model.arm.n_joints, max(float(np.abs(motion.torques).max()), _TINY)
    lower, upper = TorqueLimits.of(model.arm).bounds(motion.rates[:, :n])
    bounds = np.where(motion.torques >= 0, upper, -lower)
    # the last sample holds the arm, it is not of the extremal
    z = np.hstack([motion.coordinates, motion.rates, motion.position_costates,
                   motion.velocity_costates])[:-1]
    controls = model.controls(z, parameters.stack())
    powers = np.abs(motion.position_costates * motion.rates).max()
    scale = max(float(controls.cost_rate.max()), float(powers), _TINY)
    return [
        Finding(name='torque beyond its bounds', unit='N m', limit=limits.torque_error * size,
                value=max(float((np.abs(motion.torques) - bounds).max()), 0.0)),
        Finding(name='torques against eq. (14)', unit='N m', limit=limits.torque_error * size,
                value=float(np.abs(controls.torque - motion.torques[:-1]).max())),
        Finding(name='Hamiltonian drift', unit='', limit=limits.hamiltonian_drift,
                value=float(np.ptp(controls.hamiltonian)) / scale)]
