"""
Call a planner node by its service, and by its action with progress and cancellation.

Start a planner in another terminal; this works with any arm of two joints.

    tools/run planner --ros-args --params-file config/paper.yaml
    tools/run python examples/call_the_node.py

"""

from __future__ import annotations

import sys
from typing import Any

from action_msgs.msg import GoalStatus
from flex_planner_interfaces.action import PlanPath as PlanPathAction
from flex_planner_interfaces.msg import MotionTask, PlanReport
from flex_planner_interfaces.srv import PlanPath
from geometry_msgs.msg import Point
import rclpy
from rclpy.action import ActionClient
from rclpy.node import Node

NAME = '/flex_planner/plan_path'  # of the service and of the action
PATIENCE = 30.0  # [s]
TASK = MotionTask(space=MotionTask.CARTESIAN, start_point=Point(x=0.5, y=0.0),
                  goal_point=Point(x=0.5, y=0.5), duration=1.0, payload_mass=1.0,
                  publish=True)  # on the controller's topic, if it passes its certificate
# slow to plan for a flexible arm, whose links swing a thousand times during the motion
SLOW = MotionTask(space=MotionTask.CARTESIAN, start_point=TASK.start_point,
                  goal_point=TASK.goal_point, duration=100.0, payload_mass=1.0)


def call_service(node: Node) -> None:
    """Plan, and wait for the answer."""
    client = node.create_client(PlanPath, NAME)
    if not client.wait_for_service(PATIENCE):
        sys.exit(f'no planner answers at {NAME} within {PATIENCE:g} s: start one, see above')
    report = wait_for(node, client.call_async(PlanPath.Request(task=TASK))).report
    if report.error_code != PlanReport.NONE:
        sys.exit(f'error {report.error_code}: {report.error_msg}')
    print(f'service: J = {report.cost:.4f}, tip error {report.tip_error * 1e3:.1e} mm, '
          f'recording {report.recording or "none"}')


def call_action(node: Node) -> None:
    """Start a slow plan, watch its progress for a while, and cancel it."""
    client, heard = ActionClient(node, PlanPathAction, NAME), list[str]()

    def on_feedback(message: Any) -> None:
        progress = message.feedback  # ten times per second
        heard.append(f'{progress.phase}, iteration {progress.iteration}')
        if heard.count(heard[-1]) == 1:
            print(f'action: {heard[-1]}')

    client.wait_for_server(PATIENCE)
    goal = wait_for(node, client.send_goal_async(PlanPathAction.Goal(task=SLOW), on_feedback))
    result = goal.get_result_async()
    while len(heard) < 10 and not result.done():
        rclpy.spin_once(node, timeout_sec=0.1)
    if not result.done():
        wait_for(node, goal.cancel_goal_async())
    outcome = wait_for(node, result)
    canceled = outcome.status == GoalStatus.STATUS_CANCELED
    print(f'action: {"canceled" if canceled else "done"}, {outcome.result.report.error_msg}')


def wait_for(node: Node, future: Any) -> Any:
    """Wait for a future and return its result."""
    rclpy.spin_until_future_complete(node, future)
    return future.result()


if __name__ == '__main__':
    rclpy.init()
    client_node = rclpy.create_node('call_the_node')
    call_service(client_node)
    call_action(client_node)
    rclpy.shutdown()
