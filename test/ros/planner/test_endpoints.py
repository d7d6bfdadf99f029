"""The end of goals in a process that is told to end meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from flex_planner.ros.planner.endpoints import Endpoint, fill_plan, RequestHandlers
from flex_planner.ros.planner.outcome import Outcome, unknown_failure
from flex_planner_interfaces.action import PlanPath as PlanAction
from flex_planner_interfaces.srv import PlanPath
import pytest
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from ros_support import DOMAIN


@pytest.fixture
def node() -> Iterator[Node]:
    """Return a node with a context of its own, which a test may end."""
    context = Context()
    context.init(domain_id=DOMAIN)
    node = Node('endpoint_test', context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


def test_goal_whose_answer_comes_after_the_end_of_ros_ends_quietly(
        node: Node, capfd: pytest.CaptureFixture[str]) -> None:
    concluded: list[Any] = []

    def never(request: Any, state: Any) -> Outcome:
        raise AssertionError('nothing works on the request')

    async def end_ros(pending: Any, task: Any) -> Outcome:
        node.context.shutdown()
        concluded.append(pending)
        return unknown_failure(ValueError('too late'))

    handlers = RequestHandlers(lambda work, task: 'a request', lambda pending, reason: True,
                               end_ros)
    endpoint = Endpoint(node, 'plan', (PlanPath, PlanAction), handlers, never, fill_plan)
    client = ActionClient(node, PlanAction, 'plan')
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    client.send_goal_async(PlanAction.Goal())
    for _ in range(300):
        if not node.context.ok():
            break
        executor.spin_once(timeout_sec=0.1)
    client.destroy()
    endpoint.close()
    assert concluded
    assert 'Traceback' not in capfd.readouterr().err
