"""
A controller with the action FollowJointTrajectory, whose parameter says what is wrong with it.

The parameter behaviour is one of: carry_out, refuse, silent (does not say whether it accepts),
slow (accepts after 2 s), abort, wrong (succeeds with an error code), hang (never ends, but can be
canceled), stubborn (nor can it be canceled), leave (ends while it carries out a plan).

"""

from __future__ import annotations

import sys
import time
from typing import Any

from control_msgs.action import FollowJointTrajectory
import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

Result = FollowJointTrajectory.Result


class FakeController(Node):
    """Says on ~/events what it was asked for."""

    def __init__(self) -> None:
        super().__init__('fake_controller')
        self.declare_parameter('behaviour', 'carry_out')
        group = ReentrantCallbackGroup()
        self._events = self.create_publisher(String, '~/events', 100)
        self._trajectories = self.create_publisher(JointTrajectory, '~/accepted', 10)
        self._ended = Future()
        self.server = ActionServer(
            self, FollowJointTrajectory, '~/follow_joint_trajectory', self._execute,
            callback_group=group, goal_callback=self._on_goal, cancel_callback=self._on_cancel)
        self._goals: list[Any] = []
        self.create_timer(0.05, self._look, callback_group=group)

    @property
    def _behaviour(self) -> str:
        return str(self.get_parameter('behaviour').value)

    def _say(self, text: str) -> None:
        self._events.publish(String(data=text))

    async def _on_goal(self, goal: Any) -> GoalResponse:
        self._say(f'goal of {len(goal.trajectory.points)} points')
        if self._behaviour == 'refuse':
            return GoalResponse.REJECT
        if self._behaviour == 'silent':
            await Future()
        if self._behaviour == 'slow':
            time.sleep(2.0)
        self._trajectories.publish(goal.trajectory)
        return GoalResponse.ACCEPT

    def _on_cancel(self, goal: Any) -> CancelResponse:
        self._say('cancel')
        stubborn = self._behaviour == 'stubborn'
        return CancelResponse.REJECT if stubborn else CancelResponse.ACCEPT

    def _look(self) -> None:
        """End what was told to."""
        for goal, ended in list(self._goals):
            if goal.is_cancel_requested and not ended.done():
                ended.set_result(None)

    async def _execute(self, goal: Any) -> Any:
        self._say('accepted')
        behaviour = self._behaviour
        if behaviour == 'leave':
            rclpy.shutdown()
            return Result()
        if behaviour in ('hang', 'slow', 'stubborn'):
            ended: Future = Future()
            self._goals.append((goal, ended))
            await ended
        if goal.is_cancel_requested:
            goal.canceled()
            return Result(error_string='canceled')
        if behaviour == 'abort':
            goal.abort()
            return Result(error_code=Result.PATH_TOLERANCE_VIOLATED,
                          error_string='joint2 is 0.3 rad off')
        goal.succeed()
        return Result(error_code=-5 if behaviour == 'wrong' else 0)


def main() -> None:
    rclpy.init(args=sys.argv)
    node = FakeController()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
