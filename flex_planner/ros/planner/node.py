"""The planner node: services and actions that plan, topics that carry the plan to controllers."""

from __future__ import annotations

import sys
from typing import Any

from flex_planner.base.processes import helper_processes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.robustness import prepare_robustness
from flex_planner.ros.messages.markers import motion_markers
from flex_planner.ros.messages.plans import duration_seconds
from flex_planner.ros.planner.diagnostics import Diagnostics, Record
from flex_planner.ros.planner.endpoints import Endpoint, fill_plan, fill_search, RequestHandlers
from flex_planner.ros.planner.map_starts import Starts
from flex_planner.ros.planner.outcome import Outcome, unknown_failure
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.request_planner import RequestPlanner
from flex_planner.ros.planner.request_queue import PendingRequest, RequestQueue, Work
from flex_planner.ros.planner.streamer import Streamer
from flex_planner.ros.runtime.parameters import (
    apply_changes,
    declare,
    declare_arm,
    judge_changes,
)
from flex_planner.ros.runtime.running import run_node
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces import action
from flex_planner_interfaces.msg import FlexibleTrajectory, MotionTask
from flex_planner_interfaces.srv import FindMaxPayload, PlanPath
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                     durability=DurabilityPolicy.TRANSIENT_LOCAL)
_STOP_TIMEOUT = 0.5
_SWITCH_INTERVAL = 5e-4  # [s], the solver hands over to callbacks that soon where it can


class PlannerNode(Node):  # type: ignore[misc]
    """
    Plans motions of one arm on request.

    Services and actions
    --------------------
    ~/plan_path : flex_planner_interfaces/srv/PlanPath, flex_planner_interfaces/action/PlanPath
    ~/find_max_payload : flex_planner_interfaces/srv/FindMaxPayload, .../action/FindMaxPayload

    Topics published
    ----------------
    ~/joint_trajectory : trajectory_msgs/msg/JointTrajectory, latched
    ~/flexible_trajectory : flex_planner_interfaces/msg/FlexibleTrajectory, latched
    ~/reference_states : sensor_msgs/msg/JointState, along a published plan, by another process
    ~/markers : visualization_msgs/msg/MarkerArray, latched
    /diagnostics : diagnostic_msgs/msg/DiagnosticArray

    Raises
    ------
    FlexPlannerError
        If a parameter or the arm's file is wrong.

    """

    def __init__(self) -> None:
        super().__init__('flex_planner')
        helper_processes()  # what the environment says is refused at once
        arm = declare_arm(self)
        self._settings = declare(self, PlannerSettings.for_arm(arm))
        self._settings.check_joints(arm.n_joints)
        self._streamer = Streamer(self)
        self.add_on_set_parameters_callback(self._judge_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self.get_logger().info(f'preparing the dynamics of {arm.name}')
        starts = Starts(self._settings.map_store, arm)
        if self._settings.map_store:
            self.get_logger().info(f'requests may start from {len(starts)} motions of '
                                   f'{self._settings.map_store}')
        self._planner = RequestPlanner(
            ArmModel(arm), OutcomeRecorder(arm, self.get_fully_qualified_name()), starts)
        prepare_robustness(arm)
        self._queue = RequestQueue(self._settings.queue_length)
        self._joints = self.create_publisher(JointTrajectory, '~/joint_trajectory', LATCHED)
        self._flexible = self.create_publisher(
            FlexibleTrajectory, '~/flexible_trajectory', LATCHED)
        self._markers = self.create_publisher(MarkerArray, '~/markers', LATCHED)
        self._record = Record()
        self._diagnostics = Diagnostics(self, self._queue, self._record, self._streamer,
                                        self._joints, arm.name)
        self._endpoints = self._create_endpoints()
        self._streamer.wait_until_ready()
        self.get_logger().info(f'ready to plan for {arm.name}')

    def _create_endpoints(self) -> list[Endpoint]:
        handlers = RequestHandlers(self._submit, self._queue.withdraw, self._conclude)
        plan, search = self._planner.plan, self._planner.find_max_payload
        return [
            Endpoint(self, '~/plan_path', (PlanPath, action.PlanPath), handlers,
                     lambda request, state: plan(request.task, state), fill_plan),
            Endpoint(self, '~/find_max_payload', (FindMaxPayload, action.FindMaxPayload), handlers,
                     search, fill_search)]

    def _judge_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        return judge_changes(self._settings, changes)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        self._settings = apply_changes(self._settings, changes)

    def _submit(self, work: Work) -> PendingRequest:
        return self._queue.submit(work, self._settings, self.executor)

    async def _conclude(self, pending: PendingRequest, task: MotionTask) -> Outcome:
        """Return the outcome of a request; an exception here would end the node."""
        try:
            outcome: Outcome = await pending.future
            if task.publish and outcome.publishable:
                self._publish(outcome, pending.state.settings)
        except Exception as error:
            self.get_logger().error(f'a request failed: {type(error).__name__}: {error}')
            outcome = unknown_failure(error)
        self._record.add(outcome.report)
        self._log(outcome)
        return outcome

    def _publish(self, outcome: Outcome, settings: PlannerSettings) -> None:
        """Publish a plan and stream it from now on."""
        plan, reference = outcome.plan, outcome.reference
        if plan is None or reference is None:
            return
        markers = motion_markers(plan.arm, reference, settings.base_frame)
        self._joints.publish(outcome.trajectory.joint_trajectory)
        self._flexible.publish(outcome.trajectory)
        self._markers.publish(markers)
        self._streamer.start(plan, reference, settings)

    def _log(self, outcome: Outcome) -> None:
        report = outcome.report
        seconds = duration_seconds(report.planning_time)
        if outcome.publishable:
            search = outcome.search
            found = f'maximum payload {search.payload:.6g} kg, ' if search else ''
            self.get_logger().info(
                f'{found}planned in {seconds:.2f} s ({report.strategy}): J = {report.cost:.6g}, '
                f'tip error {report.tip_error * 1e3:.2g} mm, recorded in '
                f'{report.recording or "-"}')
        else:
            self.get_logger().warning(f'error {report.error_code}: {report.error_msg}')

    def destroy_node(self) -> Any:
        """Stop the streamer and the worker, then the node."""
        self._streamer.close()
        if not self._queue.close(_STOP_TIMEOUT):
            self._planner.abandon()
        return super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the planner node until a signal ends it."""
    sys.setswitchinterval(_SWITCH_INTERVAL)
    run_node(PlannerNode, 'flex_planner', args)


if __name__ == '__main__':
    main()
