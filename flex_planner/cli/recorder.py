"""Recordings like those of the planner node, of requests from the command line, without ROS."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import time

from flex_planner.capacity.results import MaxPayload
from flex_planner.cli.request import Request
from flex_planner.optimal_control.path_constraints import write_constraint
from flex_planner.optimal_control.task import Task
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.ros.messages.classes import (
    FlexibleTrajectory,
    MotionTask,
    PayloadSearch,
    PlanReport,
)
from flex_planner.ros.messages.payload_searches import (
    report_from_search,
    search_message,
    SearchOptions,
)
from flex_planner.ros.messages.plans import (
    duration_message,
    OBJECTIVE_FIELDS,
    report_from_plan,
    report_trajectory,
)
from flex_planner.ros.messages.points import point_message
from flex_planner.ros.messages.robustness import enter_robustness
from flex_planner.ros.messages.via_points import fill_via_points
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.settings.planner import PlannerSettings

_NODE = '/flex_planner'  # so that the topics are those of the node


class RequestRecorder:
    """
    Records a request and its outcome, as the node would.

    Parameters
    ----------
    request : Request
        The request.
    folder : Path
        Of the recordings.

    Raises
    ------
    RecordingError
        If the definitions of the messages are not found.

    """

    def __init__(self, request: Request, folder: Path) -> None:
        task = request.task
        self._message = task_message(request)
        sampling = request.sampling
        settings = PlannerSettings.for_arm(task.arm)
        if sampling.controller is not None:
            settings = settings.with_controller(sampling.controller)
        if sampling.controller_period is not None:
            settings = replace(settings, controller_period=sampling.controller_period)
        self._settings = replace(
            settings, elbow=request.elbow, tolerance=task.tolerance,
            allowed_planning_time=request.time_limit, recording_folder=str(folder),
            effort_weights=task.effort_weights.tolist(),
            sampling_step=sampling.longest_step, torque_tolerance=sampling.torque_tolerance,
            start_hold=sampling.start_hold)
        self._recorder = OutcomeRecorder(task.arm, _NODE)

    def record_plan(self, plan: Plan, reference: SampledPlan | None,
                    gains: FeedbackGains | None = None) -> Path:
        """Record a plan, and gains along it; return the folder. `reference` only if solved."""
        return self._record(report_from_plan(plan), plan, reference, plan.planning_time, None,
                            gains)

    def record_search(self, found: MaxPayload, accuracy: float, step: float,
                      reference: SampledPlan | None) -> Path:
        """Record a search for the maximum payload, see `record_plan`."""
        options = SearchOptions(method=found.method, accuracy=accuracy, step=step)
        return self._record(report_from_search(found), found.plan, reference,
                            found.planning_time, search_message(found, options))

    def _record(self, report: PlanReport, plan: Plan | None, reference: SampledPlan | None,
                seconds: float, search: PayloadSearch | None,
                gains: FeedbackGains | None = None) -> Path:
        """Write a recording; the request is said to have come when planning began."""
        trajectory, took = FlexibleTrajectory(), int(seconds * 1e9)
        if plan is not None and reference is not None:
            trajectory = report_trajectory(report, plan, reference, self._settings)
        report.planning_time = duration_message(took)
        state = RequestState(settings=self._settings, stamp_ns=time.time_ns() - took)
        return self._recorder.write(self._message, state, Outcome(
            report=report, trajectory=trajectory, plan=plan, reference=reference, search=search,
            gains=gains))


def task_message(request: Request) -> MotionTask:
    """Return a request as the node would have got it."""
    task = request.task
    message = MotionTask(
        space=MotionTask.JOINT, elbow=request.elbow, duration=task.duration,
        payload_mass=task.payload_mass, payload_inertia=task.payload_inertia,
        position_weights=task.position_weights.tolist(),
        velocity_weights=task.velocity_weights.tolist(),
        torque_rate_weight=task.torque_rate_weight.tolist(),
        max_torque_rate=task.max_torque_rate.tolist(),
        effort_weights=task.effort_weights.tolist(), tolerance=task.tolerance,
        allow_large_bending=task.allow_large_bending,
        path_constraints=[write_constraint(one) for one in task.path_constraints],
        allowed_planning_time=request.time_limit)
    for name in OBJECTIVE_FIELDS if request.objectives else ():
        setattr(message, name, getattr(request.objectives, name).tolist())
    if request.objectives:
        enter_robustness(message, request.objectives.robustness)
    _fill_start(message, task)
    fill_via_points(message, task)
    if task.goal_point.size:
        message.goal_point = point_message(task.goal_point)
        message.space = (MotionTask.CARTESIAN if task.start_point.size
                         else MotionTask.CARTESIAN_GOAL)
    else:
        message.goal_positions = task.goal_positions.tolist()
    return message


def _fill_start(message: MotionTask, task: Task) -> None:
    """Enter the state at the start."""
    message.start_velocities = task.start_velocities.tolist()
    message.start_modal_displacements = task.start_modal_displacements.tolist()
    if task.start_point.size:
        message.start_point = point_message(task.start_point)
    else:
        message.start_positions = task.start_positions.tolist()
