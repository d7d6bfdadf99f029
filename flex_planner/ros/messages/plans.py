"""Between the messages of flex_planner_interfaces and the core's tasks and plans."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import (
    FlexPlannerError,
    InvalidSizeError,
    InvalidTaskError,
    InvalidValueError,
    NotFiniteError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.progress import StopReason
from flex_planner.base.sentences import say_reason
from flex_planner.base.text import printable
from flex_planner.base.validation import Array, number, vector
from flex_planner.control.joint_controller import JointController
from flex_planner.optimal_control.ends_at_points import ends_at_points
from flex_planner.optimal_control.goal_in_pose import posture_in_pose
from flex_planner.optimal_control.path_constraints import read_constraint
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import peaks, Plan, PlanStatus, Samples
from flex_planner.planning.robustness import robustness_warnings
from flex_planner.planning.sampling import SampledPlan
from flex_planner.planning.warnings import PlanWarning
from flex_planner.ros.messages.classes import (
    Duration,
    FlexiblePoint,
    FlexibleTrajectory,
    JointTrajectory,
    JointTrajectoryPoint,
    MotionTask,
    PlanReport,
)
from flex_planner.ros.messages.orientations import orientation_axes
from flex_planner.ros.messages.points import point_coordinates, point_message
from flex_planner.ros.messages.request_error import RequestError
from flex_planner.ros.messages.robustness import add_robustness, robustness_from_message
from flex_planner.ros.messages.spaces import SPACES
from flex_planner.ros.messages.via_points import via_points_from_message
from flex_planner.ros.settings.planner import PlannerSettings
import numpy as np
from numpy.typing import NDArray

ERROR_CODES: tuple[tuple[type[FlexPlannerError], int], ...] = (
    (InvalidSizeError, PlanReport.INVALID_SIZE),
    (NotFiniteError, PlanReport.NOT_FINITE),
    (InvalidValueError, PlanReport.OUT_OF_RANGE),
    (InvalidTaskError, PlanReport.INVALID_TASK),
    (UnreachableError, PlanReport.UNREACHABLE),
    (SingularError, PlanReport.SINGULAR),
)
STATUS_CODES = {
    PlanStatus.SOLVED: PlanReport.NONE,
    PlanStatus.NOT_CONVERGED: PlanReport.NOT_CONVERGED,
    PlanStatus.NOT_FOUND: PlanReport.NOT_FOUND,
    PlanStatus.INFEASIBLE: PlanReport.INFEASIBLE,
    PlanStatus.LIMIT_VIOLATED: PlanReport.LIMIT_VIOLATED,
    PlanStatus.BENT_TOO_FAR: PlanReport.BENT_TOO_FAR,
    PlanStatus.CERTIFICATE_FAILED: PlanReport.CERTIFICATE_FAILED,
    PlanStatus.OBJECTIVE_NOT_MET: PlanReport.OBJECTIVE_NOT_MET,
    PlanStatus.TIMEOUT: PlanReport.TIMEOUT,
    PlanStatus.CANCELED: PlanReport.CANCELED,
}
STOP_CODES = {StopReason.TIMEOUT: PlanReport.TIMEOUT,
              StopReason.CANCELED: PlanReport.CANCELED}
OBJECTIVE_FIELDS = ('max_joint_speeds', 'max_torque_shares', 'max_modal_rates')
# fields of the report, and of the core's certificate and robustness
EXECUTION_FIELDS = {
    'executed_tip_error': 'tip_error', 'executed_residual_vibration': 'residual_vibration',
    'open_loop_tip_error': 'open_loop_tip_error',
    'open_loop_residual_vibration': 'open_loop_residual_vibration',
    'open_loop_amplification': 'open_loop_amplification', 'feedback_growth': 'feedback_growth',
    'executed_limit_slack': 'limit_slack'}
ROBUSTNESS_FIELDS = {
    'vibration_if_more_modes': 'more_modes',
    'vibration_if_stiffness_differs': 'stiffness_differs',
    'vibration_if_payload_differs': 'payload_differs',
    'feedback_growth_if_more_modes': 'more_modes_growth',
    'stiffness_difference': 'stiffness_difference', 'payload_difference': 'payload_difference'}
_MAX_PLANNING_TIME = 3600.0


def task_from_message(message: MotionTask, arm: Arm, settings: PlannerSettings) -> Task:
    """
    Return the task that a request describes, with the parameters' defaults filled in.

    Raises
    ------
    FlexPlannerError
        One of `ERROR_CODES`, naming field, value and bound.

    """
    tolerance = number('tolerance', message.tolerance, at_least=0, at_most=1)
    return Task(
        arm=arm, **_ends(message, arm, settings), duration=message.duration,
        start_velocities=np.asarray(message.start_velocities),
        start_modal_displacements=np.asarray(message.start_modal_displacements),
        payload_mass=message.payload_mass,
        payload_inertia=message.payload_inertia or arm.payload_inertia,
        effort_weights=np.asarray(message.effort_weights or settings.effort_weights),
        position_weights=np.asarray(message.position_weights),
        velocity_weights=np.asarray(message.velocity_weights),
        torque_rate_weight=np.asarray(message.torque_rate_weight),
        max_torque_rate=np.asarray(message.max_torque_rate),
        via_points=via_points_from_message(message, arm),
        tolerance=tolerance or settings.tolerance,
        allow_large_bending=message.allow_large_bending,
        path_constraints=[read_constraint(f'path_constraints[{i}]', text)
                          for i, text in enumerate(message.path_constraints)])


def objectives_from_message(message: MotionTask,
                            controller: JointController | None = None) -> Objectives | None:
    """
    Return the objectives of a request under a joint controller, None if it has none.

    Raises
    ------
    InvalidValueError
        Naming field, value and bound.

    """
    given: dict[str, Any] = {name: np.asarray(getattr(message, name)) for name in OBJECTIVE_FIELDS}
    robustness = robustness_from_message(message, controller)
    if robustness is None and not any(limits.size for limits in given.values()):
        return None
    return Objectives(**given, robustness=robustness)


def planning_time_limit(message: MotionTask, settings: PlannerSettings) -> float:
    """Return the time limit of a request [s], or raise InvalidValueError."""
    limit = number('allowed_planning_time', message.allowed_planning_time, at_least=0,
                   at_most=_MAX_PLANNING_TIME, unit='s')
    return limit or settings.allowed_planning_time


def _ends(message: MotionTask, arm: Arm, settings: PlannerSettings) -> dict[str, Any]:
    """Return start and goal as they are given, with the postures that belong to points."""
    angles = {name: np.asarray(getattr(message, name))
              for name in ('start_positions', 'goal_positions')}
    if len(message.goal_orientation) and message.space in (MotionTask.JOINT, MotionTask.CARTESIAN):
        raise InvalidValueError('goal_orientation', 'given', 'empty unless space is '
                                '2 (CARTESIAN_GOAL)')
    if message.space == MotionTask.JOINT:
        return angles
    if message.space not in SPACES:
        raise InvalidValueError('space', message.space,
                                '0 (JOINT), 1 (CARTESIAN) or 2 (CARTESIAN_GOAL)')
    if message.elbow not in (-1, 0, 1):
        raise InvalidValueError('elbow', message.elbow, '-1, +1, or 0 for the default')
    elbow = message.elbow or settings.elbow
    start, goal = (point_coordinates(point, arm)
                   for point in (message.start_point, message.goal_point))
    if message.space == MotionTask.CARTESIAN:
        return ends_at_points(arm, start, goal, elbow)
    start_angles = vector('start_positions', angles['start_positions'], arm.n_joints, unit='rad')
    axes = orientation_axes('goal_orientation', message.goal_orientation)
    if axes is not None:
        return angles | {'goal_positions': posture_in_pose(
            arm, goal, axes, start_angles, payload_mass=message.payload_mass,
            payload_inertia=message.payload_inertia or arm.payload_inertia)}
    return angles | ends_at_points(arm, None, goal, elbow, start_angles)


def error_code(error: Exception) -> int:
    """Return the code of PlanReport for an exception."""
    if isinstance(error, RequestError):
        return error.code
    return next((code for kind, code in ERROR_CODES if isinstance(error, kind)),
                int(PlanReport.UNKNOWN))


def failure_report(code: int, sentence: str) -> PlanReport:
    """Return a report without numbers."""
    report = PlanReport(error_code=code, error_msg=printable(sentence))
    for name in ('cost', 'effort', 'energy', 'collocation_residual', 'boundary_error',
                 'hamiltonian_drift', 'tip_error', 'residual_vibration', 'state_error',
                 'costate_error', 'via_error', 'torque_interpolation_error',
                 *EXECUTION_FIELDS, *ROBUSTNESS_FIELDS, 'forgiven_residual',
                 'forgiven_residual_before'):
        setattr(report, name, float('inf'))
    for name in ('limit_slack', 'executed_limit_slack'):  # inf would be without limits
        setattr(report, name, float('-inf'))
    return report


def report_from_plan(plan: Plan) -> PlanReport:
    """Return the report of a plan, solved or not."""
    sentence = '' if plan.solved else say_reason(plan.status.value, plan.message)
    report = failure_report(STATUS_CODES[plan.status], sentence)
    report.strategy = plan.strategy
    report.iterations, report.mesh_intervals = plan.iterations, plan.mesh_intervals
    for name in ('cost', 'effort', 'energy'):
        setattr(report, name, float(getattr(plan, name)))
    for name in plan.certificate.__slots__:
        setattr(report, name, float(getattr(plan.certificate, name)))
    report.barrier_gap = float(plan.barrier_gap)
    report.limit_names = [one.name for one in plan.constraints]
    report.limit_units = [one.unit for one in plan.constraints]
    for field, name in (('margins', 'margin'), ('shares', 'slack'), ('times', 'time')):
        setattr(report, f'limit_{field}', [float(getattr(one, name)) for one in plan.constraints])
    report.switching_times = plan.switching_times.tolist()
    report.via_times = plan.via_times.tolist()
    report.saturation = plan.saturation.tolist()
    add_warnings(report, plan.warnings)
    report.velocity_weights = plan.task.velocity_weights.tolist()
    report.effort_weights = plan.task.effort_weights.tolist()
    report.peak_torque_rates = plan.torque_rates.tolist()
    if plan.task.has_torque_rates:
        report.torque_rate_weight = plan.task.torque_rate_prices.tolist()
    add_kinds(report, plan.kinds, plan.starts)
    trials = plan.objectives.trials if plan.objectives else ()
    report.tried_objectives = [trial.objective.value for trial in trials]
    report.tried_weights = [float(trial.weight) for trial in trials]
    report.tried_shares = [float(trial.share) for trial in trials]
    add_robustness(report, plan)
    return report


def add_kinds(report: PlanReport, kinds: Sequence[KindOfMotion], starts: int) -> None:
    """List kinds of motion in a report."""
    report.kind_values = [float(kind.value) for kind in kinds]
    report.kind_sentences = [kind.sentence for kind in kinds]
    report.kind_counts = [kind.met for kind in kinds]
    report.kind_starts = starts


def add_warnings(report: PlanReport, warnings: Sequence[PlanWarning]) -> None:
    """Add warnings to a report: identifiers and sentences."""
    report.warning_kinds = [one.kind.name for one in warnings]
    report.warnings = [one.sentence for one in warnings]


def add_reference(report: PlanReport, plan: Plan, reference: SampledPlan) -> None:
    """Add to a report what the samples of a plan show."""
    most = peaks(plan, reference.samples)
    limited = np.isfinite([joint.motor.no_load_speed for joint in plan.arm.joints]).any()
    report.peak_torques = most.torques.tolist()
    report.peak_torque_shares = most.torque_shares.tolist()
    report.peak_speeds = most.speeds.tolist()
    report.peak_speed_shares = most.speed_shares.tolist() if limited else []
    report.torque_interpolation_error = reference.torque_error
    add_execution(report, reference)
    if reference.robustness is not None:
        add_warnings(report, [*plan.warnings, *robustness_warnings(
            reference.execution, reference.robustness, plan.arm.reach, plan.arm)])


def add_execution(report: PlanReport, reference: SampledPlan) -> None:
    """Add to a report what a controller makes of the samples of a plan, also on other arms."""
    certificate, controller = reference.execution, reference.execution.controller
    for name, own in EXECUTION_FIELDS.items():
        setattr(report, name, float(getattr(certificate, own)))
    for name, own in ROBUSTNESS_FIELDS.items() if reference.robustness else ():
        setattr(report, name, float(getattr(reference.robustness, own)))
    report.controller_rate, report.effort_hold = controller.rate, controller.hold.value
    report.controller_stiffness = controller.gains.stiffness.tolist()
    report.controller_damping = controller.gains.damping.tolist()
    report.controller_period = reference.controller_period
    report.start_hold = reference.start_hold


def duration_message(nanoseconds: int) -> Duration:
    """Return a duration message."""
    seconds, rest = divmod(int(nanoseconds), 10**9)
    return Duration(sec=seconds, nanosec=rest)


def duration_seconds(duration: Duration) -> float:
    """Return a duration message in seconds."""
    return float(duration.sec + duration.nanosec * 1e-9)


def joint_trajectory(reference: SampledPlan, joint_names: Sequence[str]) -> JointTrajectory:
    """Return the trajectory for a joint_trajectory_controller with an effort interface."""
    samples, n = reference.samples, len(joint_names)
    points = joint_points(reference.times_ns, samples.coordinates[:, :n], samples.rates[:, :n],
                          samples.accelerations[:, :n], reference.efforts)
    return JointTrajectory(joint_names=list(joint_names), points=points)


def joint_points(times_ns: NDArray[np.int64], positions: Array, velocities: Array,
                 accelerations: Array, efforts: Array) -> list[JointTrajectoryPoint]:
    """Return the points of a joint trajectory, from arrays of shape (k,) [ns] and (k, n)."""
    rows = zip(*map(_rows, (positions, velocities, accelerations, efforts)), strict=True)
    return _timed(times_ns, [
        JointTrajectoryPoint(positions=position, velocities=velocity, accelerations=acceleration,
                             effort=effort)
        for position, velocity, acceleration, effort in rows])


def _rows(values: Array) -> list[array[float]]:
    """Return rows as messages keep them."""
    return [array('d', row) for row in values.tolist()]


def _timed(times_ns: NDArray[np.int64], points: list[Any]) -> list[Any]:
    """Return points with their times: set in what they have, as to make it takes longer."""
    for point, time in zip(points, times_ns.tolist(), strict=True):
        since = point.time_from_start
        since.sec, since.nanosec = divmod(time, 10**9)
    return points


def flexible_trajectory(plan: Plan, reference: SampledPlan, joints: JointTrajectory,
                        frame: str) -> FlexibleTrajectory:
    """Return the trajectory with the bending of the links, costates and the tip's path."""
    samples = reference.samples
    message = FlexibleTrajectory(
        joint_trajectory=joints, modal_names=list(plan.arm.passive_names),
        points=_flexible_points(plan.arm.n_joints, samples, reference.times_ns),
        tip_path=[point_message(place) for place in samples.tip],
        payload_mass=plan.task.payload_mass)
    message.header.frame_id = frame
    return message


def report_trajectory(report: PlanReport, plan: Plan, reference: SampledPlan,
                      settings: PlannerSettings) -> FlexibleTrajectory:
    """Return the trajectory of a sampled plan, and add to its report what the samples show."""
    add_reference(report, plan, reference)
    joints = joint_trajectory(reference, settings.joint_names)
    return flexible_trajectory(plan, reference, joints, settings.base_frame)


def _flexible_points(n: int, samples: Samples,
                     times_ns: NDArray[np.int64]) -> list[FlexiblePoint]:
    columns = (samples.coordinates[:, n:], samples.rates[:, n:], samples.position_costates,
               samples.velocity_costates, samples.torque_costates)
    return _timed(times_ns, [
        FlexiblePoint(modal_displacements=displacements, modal_rates=rates,
                      position_costates=positions, velocity_costates=velocities,
                      torque_costates=torques)
        for displacements, rates, positions, velocities, torques in zip(
            *map(_rows, columns), strict=True)])
