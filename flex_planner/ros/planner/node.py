"""The planner node: services and actions that plan, topics that carry the plan to controllers."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
import sys
import time
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.processes import helper_processes
from flex_planner.base.text import printable
from flex_planner.logs.identified_uncertainty import find_uncertainty
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.robustness import prepare_robustness
from flex_planner.planning.uncertainty import ASSUMED, Uncertainty
from flex_planner.ros.messages.classes import WHY_NOT_ROS
from flex_planner.ros.messages.plans import duration_seconds, planning_time_limit
from flex_planner.ros.motion_recorder import MotionRecorder
from flex_planner.ros.planner.arm_bending import ArmBending
from flex_planner.ros.planner.arm_state import ArmState, Latest
from flex_planner.ros.planner.controller import Controller
from flex_planner.ros.planner.diagnostics import Diagnostics, Record
from flex_planner.ros.planner.endpoints import Endpoint, fill_plan, fill_search, RequestHandlers
from flex_planner.ros.planner.execution import ExecutionEnd
from flex_planner.ros.planner.map_starts import Starts
from flex_planner.ros.planner.outcome import canceled_outcome, Outcome, unknown_failure
from flex_planner.ros.planner.plan_topics import PlanTopics
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.replanner import Replanner
from flex_planner.ros.planner.request_planner import RequestPlanner
from flex_planner.ros.planner.request_queue import PendingRequest, RequestQueue, Work
from flex_planner.ros.runtime.parameters import (
    apply_changes,
    ARM_PARAMETERS,
    declare,
    declare_arm,
    judge_changes,
    name_arm_file,
    warn_of_unknown,
)
from flex_planner.ros.runtime.running import run_node
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces import action
from flex_planner_interfaces.msg import MotionTask, PlanReport
from flex_planner_interfaces.srv import FindMaxPayload, PlanPath
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

_STOP_TIMEOUT, _RECORDING_TIMEOUT = 0.5, 1.0  # [s]
_LOG_PERIOD = 1.0  # [s], of plans that replace others, many a second
_SWITCH_INTERVAL = 5e-4  # [s], the solver hands over to callbacks that soon where it can


class PlannerNode(Node):  # type: ignore[misc]
    """
    Plans motions of one arm on request.

    Services and actions
    --------------------
    ~/plan_path : flex_planner_interfaces/srv/PlanPath, flex_planner_interfaces/action/PlanPath
    ~/find_max_payload : flex_planner_interfaces/srv/FindMaxPayload, .../action/FindMaxPayload

    Topics subscribed
    -----------------
    joint_states : sensor_msgs/msg/JointState
        Where the arm is; the name is that of the parameter joint_states_topic.
    ~/state_estimate : sensor_msgs/msg/JointState
        Joints and modal coordinates of the moving arm, for plans that replace others.

    Action called
    -------------
    That of the parameter execute_action : control_msgs/action/FollowJointTrajectory

    Topics published
    ----------------
    ~/joint_trajectory : trajectory_msgs/msg/JointTrajectory, latched
    ~/flexible_trajectory : flex_planner_interfaces/msg/FlexibleTrajectory, latched
    ~/feedback_gains : flex_planner_interfaces/msg/FeedbackGains, latched
        With the parameter feedback_gains.
    ~/reference_states : sensor_msgs/msg/JointState, along a published plan, by another process
    ~/markers : visualization_msgs/msg/MarkerArray, latched
    /diagnostics : diagnostic_msgs/msg/DiagnosticArray

    Raises
    ------
    FlexPlannerError
        If a parameter or the arm's file is wrong.

    """

    def __init__(self) -> None:
        if WHY_NOT_ROS:
            raise FlexPlannerError(WHY_NOT_ROS)
        super().__init__('flex_planner')
        warn_of_unknown(self, PlannerSettings, ARM_PARAMETERS)
        helper_processes()  # what the environment says is refused at once
        arm = declare_arm(self)
        uncertainty = self._find_uncertainty(arm)
        self._settings = declare(self, PlannerSettings.for_arm(arm))
        self._settings.check_joints(arm.n_joints)
        recorder = OutcomeRecorder(arm, self.resolve_topic_name)
        self._motions = MotionRecorder(self, self._settings, recorder.write_motion)
        self._topics = PlanTopics(
            self, self._motions.begin if self._settings.record_motions else None)
        self.add_on_set_parameters_callback(self._judge_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self.get_logger().info(f'preparing the dynamics of {arm.name}')
        starts = Starts(self._settings.map_store, arm)
        if self._settings.map_store:
            self.get_logger().info(f'requests may start from {len(starts)} motions of '
                                   f'{printable(self._settings.map_store)}')
        self._arm_state = ArmState(self, self._settings)
        action_name = self._settings.execute_action
        self._controller = Controller(self, action_name) if action_name else None
        self._planner = RequestPlanner(
            ArmModel(arm), recorder, starts, self._arm_state,
            Replanner(self._topics.running, self._now_ns, self._listen_for_bending(arm)),
            uncertainty)
        prepare_robustness(arm)
        self._queue = RequestQueue(self._settings.queue_length, self._settings.max_waiting_time)
        self._record, self._logs_next = Record(), 0.0
        self._diagnostics = Diagnostics(self, self._queue, self._record, self._topics.streamer,
                                        self._topics.joints, arm.name, self._controller)
        self._endpoints = self._create_endpoints()
        self._topics.streamer.wait_until_ready()
        self.get_logger().info(f'ready to plan for {arm.name}')

    def _create_endpoints(self) -> list[Endpoint]:
        handlers = RequestHandlers(self._submit, self._withdraw, self._conclude)
        plan, search = self._planner.plan, self._planner.find_max_payload
        return [
            Endpoint(self, '~/plan_path', (PlanPath, action.PlanPath), handlers,
                     lambda request, state: plan(request.task, state), fill_plan),
            Endpoint(self, '~/find_max_payload', (FindMaxPayload, action.FindMaxPayload), handlers,
                     search, fill_search)]

    def _find_uncertainty(self, arm: Arm) -> Uncertainty:
        """Return how far the arm may be from its file, which is logged."""
        name = name_arm_file(self)
        found = find_uncertainty(name, arm) if name else ASSUMED
        self.get_logger().info(printable(
            f'errors of the model of {arm.name}, for what is left on other arms and for gains: '
            f'{found}'))
        return found

    def _judge_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        return judge_changes(self._settings, changes)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        self._settings = apply_changes(self._settings, changes)

    def _submit(self, work: Work, task: MotionTask) -> PendingRequest:
        settings, seconds = self._settings, 0.0
        with suppress(InvalidValueError):  # which takes no time to answer
            seconds = planning_time_limit(task, settings)
        motion = self._arm_state.motion(settings) if task.publish else ''
        return self._queue.submit(work, settings, self.executor, seconds, motion)

    def _withdraw(self, pending: PendingRequest, reason: str) -> bool:
        """Cancel a request, also the motion that it led to; return False if it is answered."""
        if not pending.is_open:
            return False
        self._queue.withdraw(pending, reason)
        if pending.execution is not None:
            pending.execution.cancel()
        return True

    async def _conclude(self, pending: PendingRequest, task: MotionTask) -> Outcome:
        """Return the outcome of a request; an exception here would end the node."""
        record = None
        try:
            outcome: Outcome = await pending.future
            record = outcome.record
            if task.publish and outcome.publishable:
                outcome = await self._hand_over(outcome, pending, task)
        except Exception as error:
            self.get_logger().error(
                printable(f'a request failed: {type(error).__name__}: {error}'))
            outcome = unknown_failure(error)
        pending.is_open = False
        if record is not None:
            record()
        self._record.add(outcome.report)
        self._log(outcome)
        return outcome

    async def _hand_over(self, outcome: Outcome, pending: PendingRequest,
                         task: MotionTask) -> Outcome:
        """Publish a plan, or let the controller carry it out, unless things have changed."""
        state = pending.state
        if state.withdrawn:
            return canceled_outcome(state)
        self._planner.check_start(outcome, state)
        if not outcome.publishable:
            return outcome
        if self._controller is None:
            self._topics.publish(outcome, state.settings)
            return outcome
        state.report(replace(state.progress, phase='carrying out the plan'))
        track = self._topics.track(outcome)
        if outcome.record is not None:  # to carry it out takes seconds
            outcome.record()
        pending.execution = self._controller.start(
            self._topics.trajectory(outcome, track), state.settings.execute_timeout, self.executor,
            lambda: self._topics.publish(outcome, state.settings, track),
            replaces=outcome.replaces, plan_id=outcome.report.plan_id)
        end: ExecutionEnd = await pending.execution.future
        end.enter(outcome.report)
        if end.code != PlanReport.NONE:
            self._topics.running.drop(outcome.report.plan_id)
        self._planner.record_execution(task, state, outcome.report)
        return outcome

    def _listen_for_bending(self, arm: Arm) -> ArmBending:
        names, topic = [*self._settings.joint_names, *arm.passive_names], '~/state_estimate'
        estimates = Latest(self, JointState, topic)
        return ArmBending(self.resolve_topic_name(topic), names, self._arm_state.angles,
                          estimates.take)

    def _is_due(self) -> bool:
        """Return whether it is a second since that was asked last and so: to log takes long."""
        now, due = time.monotonic(), self._logs_next
        self._logs_next = now + _LOG_PERIOD if now >= due else due
        return now >= due

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _log(self, outcome: Outcome) -> None:
        report = outcome.report
        waited = duration_seconds(report.waiting_time)
        seconds = duration_seconds(report.planning_time) - waited
        if outcome.publishable and outcome.replaces and not self._is_due():
            return
        if outcome.publishable:
            search = outcome.search
            found = f'maximum payload {search.payload:.6g} kg, ' if search else ''
            self.get_logger().info(
                f'{found}planned in {seconds:.2f} s, after {waited:.2f} s in the queue '
                f'({report.strategy}): J = {report.cost:.6g}, '
                f'tip error {report.tip_error * 1e3:.2g} mm, recorded in '
                f'{report.recording or "-"}')
        else:
            self.get_logger().warning(f'error {report.error_code}: {report.error_msg}')

    def destroy_node(self) -> Any:
        """Stop the streamer and the worker, then the node."""
        self._topics.streamer.close()
        self._motions.close()
        if not self._queue.close(_STOP_TIMEOUT):
            self._planner.abandon()
        self._planner.close(_RECORDING_TIMEOUT)
        # or the node would go on within them: others would hear of it until its lease is over, and
        # its shared memory would stay for good
        for endpoint in self._endpoints:
            endpoint.close()
        if self._controller is not None:
            self._controller.close()
        return super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the planner node until a signal ends it."""
    sys.setswitchinterval(_SWITCH_INTERVAL)
    run_node(PlannerNode, 'flex_planner', args)


if __name__ == '__main__':
    main()
