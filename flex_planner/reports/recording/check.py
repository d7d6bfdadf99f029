"""
A recorded plan checked against the model, from the recording alone.

The recorded joint trajectory is carried out by the arm of the recording under the joint controller
that it was published for, exactly as when it was certified, with feedback and without; nothing of
the collocation that made the plan is used. The costates of the recording then show whether its
efforts are those of an optimal motion.

"""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.arms.quaternions import axes_of_quaternion
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_kinematics import tip_frame
from flex_planner.base.errors import RecordingError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.planning.execution import Execution
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
from flex_planner.reports.recording.execution import (
    carried_motion,
    effort_delay,
    efforts_settled,
    recorded_execution,
)
from flex_planner.reports.recording.findings import CheckLimits, Finding, MotionCheck
from flex_planner.reports.recording.forgiveness import recorded_offset
from flex_planner.reports.recording.optimality import optimality_findings
from flex_planner.reports.recording.torque_rates import RecordedRates, torque_rate_findings
from flex_planner.reports.recording.way_limits import limit_findings
import numpy as np

_MICROMETRE = 1e-6
_TINY = float(np.finfo(float).tiny)


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
    execution = carried_motion(request, model).execution
    states = _states(execution, motion, monitor)
    tip = tip_position(request.arm, states[:, :request.arm.n_coordinates])
    return MotionCheck(tip=tip, findings=(
        *_arrival(request, execution, motion, limits, monitor),
        *_way(motion, states, tip, request.arm, limits),
        *_deviation_at_ends(request, motion, ends, limits),
        *_deviation_from_request(request, motion, limits),
        *limit_findings(request, motion, limits),
        *_optimality(request, motion, model, limits)))


def _optimality(request: RecordedRequest, motion: RecordedMotion, model: ArmModel,
                limits: CheckLimits) -> list[Finding]:
    """Return whether efforts and costates are those of an optimal motion."""
    error, delay = float(request.report.torque_interpolation_error), effort_delay(request)
    prices, via_times = RecordedRates.of(request), _given_via_times(request, motion)
    if prices is not None:
        return torque_rate_findings(model, motion, request.parameters, prices, limits,
                                    delay=delay, settled=efforts_settled(request, motion),
                                    interpolation_error=error, via_times=via_times)
    return optimality_findings(model, motion, request.parameters, limits, delay,
                               efforts_settled(request, motion), error, via_times,
                               recorded_offset(request))


def _states(execution: Execution, motion: RecordedMotion, monitor: Monitor | None) -> Array:
    """Return the states at the recorded times, between two updates of the controller on a line."""
    carried = execution.arm.follow(motion.reference, execution.start, float(motion.times[-1]),
                                   monitor)
    return np.stack([np.interp(motion.times, carried.times, column)
                     for column in carried.states.T], axis=1)


def _given_via_times(request: RecordedRequest, motion: RecordedMotion) -> Array:
    """Return when via points with given times are passed; older recordings have none [s]."""
    given = np.array(getattr(request.task, 'via_times', ()), dtype=np.float64)
    times: Array = motion.begin + given[given > 0]
    return times


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


def _arrival(request: RecordedRequest, execution: Execution, motion: RecordedMotion,
             limits: CheckLimits, monitor: Monitor | None) -> list[Finding]:
    """Return where the arm arrives, and how that differs from the recorded certificate."""
    reference, reach, planned = motion.reference, request.arm.reach, recorded_execution(request)
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
    recorded = motion.coordinates[:, :arm.n_joints]
    away = np.abs(states[:, :arm.n_joints] - recorded).max()
    return [Finding(name='largest tip deviation', unit='m', limit=limits.tip_deviation * arm.reach,
                    value=float(np.linalg.norm(tip - motion.tip, axis=1).max())),
            Finding(name='largest joint deviation', unit='', limit=limits.joint_deviation,
                    value=float(away / max(np.ptp(recorded, axis=0).max(), _TINY)))]


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
                else tip - [getattr(point, axis) for axis in 'xyz'[:tip.size]])
        findings.append(Finding(
            name=f'deviation from task, {name}', unit='rad' if by_angles else 'm',
            limit=limits.end_error, value=float(np.abs(miss).max())))
    return [*findings, *_deviation_from_orientation(request, found[-1], limits)]


def _deviation_from_orientation(request: RecordedRequest, goal: Array,
                                limits: CheckLimits) -> list[Finding]:
    """Return by what angle the tip's frame at the goal is turned from the one asked for."""
    # older recordings have none
    asked: Any = getattr(request.task, 'goal_orientation', ())
    if not (len(asked) and isinstance(request.arm, SpatialArm)):
        return []
    wanted = axes_of_quaternion('goal_orientation', [getattr(asked[0], name) for name in 'xyzw'])
    turn = tip_frame(request.arm, goal)[1].T @ wanted
    # twice the sine of half the angle: exact where it is small
    sine = float(np.linalg.norm(turn - np.eye(3)) / np.sqrt(8))
    return [Finding(name='deviation from task, orientation of the goal', unit='rad',
                    limit=limits.end_error, value=2 * float(np.arcsin(min(sine, 1.0))))]
