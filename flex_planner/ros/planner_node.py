"""The planner node: services that plan, topics that carry the plan to controllers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from flex_planner.model import ArmModel
from flex_planner.ros.conversions import duration_seconds
from flex_planner.ros.parameters import declare, declare_arm, judge_changes, validated_changes
from flex_planner.ros.payload_messages import fill_response, search_without_result
from flex_planner.ros.planning import busy, Outcome, Planning, unknown_failure
from flex_planner.ros.recorder import OutcomeRecorder
from flex_planner.ros.running import run_node
from flex_planner.ros.settings import PlannerSettings
from flex_planner.ros.worker import Worker
from flex_planner_interfaces.msg import FlexibleTrajectory, MotionTask
from flex_planner_interfaces.srv import FindMaxPayload, PlanPath
from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                     durability=DurabilityPolicy.TRANSIENT_LOCAL)
_STOP_TIMEOUT = 0.5
# from the parameters, whether to stop, and the time waited [ns] to what came of a request
Work = Callable[[PlannerSettings, Callable[[], bool], int], Outcome]


class PlannerNode(Node):  # type: ignore[misc]
    """
    Plans motions of one arm on request.

    Services
    --------
    ~/plan_path : flex_planner_interfaces/srv/PlanPath
    ~/find_max_payload : flex_planner_interfaces/srv/FindMaxPayload

    Topics published
    ----------------
    ~/joint_trajectory : trajectory_msgs/msg/JointTrajectory, latched
    ~/flexible_trajectory : flex_planner_interfaces/msg/FlexibleTrajectory, latched

    Raises
    ------
    FlexPlannerError
        If a parameter or the arm's file is wrong.

    """

    def __init__(self) -> None:
        super().__init__('flex_planner')
        arm = declare_arm(self)
        self._settings = declare(self, PlannerSettings.for_arm(arm))
        self._settings.check_joints(arm.n_joints)
        self.add_on_set_parameters_callback(self._judge_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self.get_logger().info(f'preparing the dynamics of {arm.name}')
        self._planning = Planning(ArmModel(arm),
                                  OutcomeRecorder(arm, self.get_fully_qualified_name()))
        self._worker = Worker(self._settings.queue_length)
        self._joints = self.create_publisher(JointTrajectory, '~/joint_trajectory', LATCHED)
        self._flexible = self.create_publisher(
            FlexibleTrajectory, '~/flexible_trajectory', LATCHED)
        # in the group that all else is in, a request that waits would hold up the others
        group = ReentrantCallbackGroup()
        self.create_service(PlanPath, '~/plan_path', self._on_plan_path, callback_group=group)
        self.create_service(FindMaxPayload, '~/find_max_payload', self._on_find_max_payload,
                            callback_group=group)
        self.get_logger().info(f'ready to plan for {arm.name}')

    def _judge_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        return judge_changes(self._settings, changes)

    def _apply_parameters(self, changes: list[Parameter]) -> None:
        self._settings = validated_changes(self._settings, changes)

    async def _on_plan_path(self, request: PlanPath.Request,
                            response: PlanPath.Response) -> PlanPath.Response:
        """Plan a motion."""
        outcome = await self._answered(partial(self._planning.plan, request.task), request.task)
        response.report, response.trajectory = outcome.report, outcome.trajectory
        return response

    async def _on_find_max_payload(self, request: FindMaxPayload.Request,
                                   response: FindMaxPayload.Response) -> FindMaxPayload.Response:
        """Search for the maximum payload."""
        outcome = await self._answered(partial(self._planning.find_max_payload, request),
                                       request.task)
        response.report, response.trajectory = outcome.report, outcome.trajectory
        fill_response(response, outcome.search or search_without_result(request))
        return response

    async def _answered(self, work: Work, task: MotionTask) -> Outcome:
        """Return what a request led to: an exception here would end the node."""
        try:
            outcome: Outcome = await self._outcome(work)
            if task.publish and outcome.publishable:
                self._publish(outcome)
        except Exception as error:
            self.get_logger().error(f'a request failed: {type(error).__name__}: {error}')
            outcome = unknown_failure(error)
        self._log(outcome)
        return outcome

    def _outcome(self, work: Work) -> Future:
        """Hand a request to the worker and return what it will lead to."""
        executor, settings = self.executor, self._settings
        future, accepted = Future(executor=executor), time.monotonic_ns()

        def job() -> None:
            future.set_result(work(settings, lambda: self._worker.stopping,
                                   time.monotonic_ns() - accepted))
            # a future that another thread completes does not wake the executor by itself
            executor.wake()

        if not self._worker.submit(job):
            future.set_result(busy(settings.queue_length))
        return future

    def _publish(self, outcome: Outcome) -> None:
        self._joints.publish(outcome.trajectory.joint_trajectory)
        self._flexible.publish(outcome.trajectory)

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
        """Stop the worker, then the node."""
        self._worker.stop(_STOP_TIMEOUT)
        return super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the planner node until it is told to stop."""
    run_node(PlannerNode, 'flex_planner', args)


if __name__ == '__main__':
    main()
