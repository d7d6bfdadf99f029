"""The joint controller of a recording, and what it made of the trajectory when it was planned."""

from __future__ import annotations

from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.planning.executed_limits import ExecutedSlack
from flex_planner.planning.execution import (
    Execution,
    ExecutionCertificate,
    RobustnessReport,
)
from flex_planner.planning.feedback.carried_motion import CarriedMotion
from flex_planner.planning.published_motion import start_ramp
from flex_planner.planning.uncertainty import ASSUMED_ERROR
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
import numpy as np


def recorded_controller(request: RecordedRequest) -> JointController:
    """Return the joint controller that the plan was published for."""
    report = request.report
    if not _is_told(request):
        return JointController(gains=default_gains(ArmDynamics.of(request.arm)),
                               hold=EffortHold.LINEAR)
    gains = Gains(stiffness=np.asarray(report.controller_stiffness),
                  damping=np.asarray(report.controller_damping))
    return JointController(gains=gains, rate=float(report.controller_rate),
                           hold=EffortHold.named(report.effort_hold))


def carried_motion(request: RecordedRequest, model: ArmDynamics) -> CarriedMotion:
    """
    Return the recorded trajectory under the controller that it was published for.

    Parameters
    ----------
    request : RecordedRequest
        With a motion.
    model : ArmDynamics
        Of its arm.

    """
    motion = request.motion
    assert motion is not None
    execution = Execution(
        dynamics=model, parameters=request.parameters, goal=motion.tip[-1],
        start=np.concatenate([motion.coordinates[0], motion.rates[0]]),
        duration=float(motion.times[-2]), controller=recorded_controller(request))
    return CarriedMotion(execution=execution, reference=motion.reference,
                         goal=motion.coordinates[-1, :request.arm.n_joints],
                         holding_torque=motion.torques[-1])


def effort_delay(request: RecordedRequest) -> float:
    """Return by how much efforts come later than the planned torques [s]."""
    if not _is_told(request):
        return 0.0
    half = float(request.report.controller_period) / 2
    return -half if request.report.effort_hold == EffortHold.START.value else half


def efforts_settled(request: RecordedRequest, motion: RecordedMotion) -> float:
    """Return from when on efforts are those of the motion, after those that hold the arm [s]."""
    if not motion.begin:
        return 0.0
    return motion.begin + start_ramp(recorded_controller(request))[1]


def recorded_execution(request: RecordedRequest) -> ExecutionCertificate | None:
    """Return the certificate of the trajectory; None in older recordings, which have none."""
    if not _is_told(request):
        return None
    report = request.report
    return ExecutionCertificate(
        controller=recorded_controller(request), tip_error=float(report.executed_tip_error),
        residual_vibration=float(report.executed_residual_vibration),
        open_loop_tip_error=float(report.open_loop_tip_error),
        open_loop_residual_vibration=float(report.open_loop_residual_vibration),
        open_loop_amplification=float(report.open_loop_amplification),
        feedback_growth=float(report.feedback_growth),
        limits=ExecutedSlack(float(getattr(report, 'executed_limit_slack', -np.inf))))


def recorded_robustness(request: RecordedRequest) -> RobustnessReport | None:
    """Return the figures of other arms; None where nobody has found them."""
    report = request.report
    if not _is_told(request) or not np.isfinite(report.feedback_growth_if_more_modes):
        return None
    return RobustnessReport(
        nominal=float(report.executed_residual_vibration),
        more_modes=float(report.vibration_if_more_modes),
        stiffness_differs=float(report.vibration_if_stiffness_differs),
        payload_differs=float(report.vibration_if_payload_differs),
        more_modes_growth=float(report.feedback_growth_if_more_modes),
        # older recordings do not say it
        stiffness_difference=float(getattr(report, 'stiffness_difference', ASSUMED_ERROR)),
        payload_difference=float(getattr(report, 'payload_difference', ASSUMED_ERROR)))


def _is_told(request: RecordedRequest) -> bool:
    """Return whether the recording knows of a controller, as older ones do not."""
    return bool(request.report.controller_rate)
