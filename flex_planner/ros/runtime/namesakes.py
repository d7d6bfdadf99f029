"""A warning where two nodes have one name."""

from __future__ import annotations

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

_PERIOD = 1.0  # [s]


class NamesakeWatch:
    """
    Warns where another node has the name of a node, each time that one appears.

    Parameters
    ----------
    node : Node
        The node.

    """

    def __init__(self, node: Node) -> None:
        self._node, self._several = node, False
        node.create_timer(_PERIOD, self._look, ReentrantCallbackGroup(),
                          Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        own = self._node.get_name(), self._node.get_namespace()
        several = self._node.get_node_names_and_namespaces().count(own) > 1
        if several and not self._several:
            self._node.get_logger().warning(
                f'another node is named {self._node.get_fully_qualified_name()}, too: either may '
                'answer a request, and both publish on the same topics; end one, or start it '
                'with --ros-args -r __node:=ANOTHER_NAME (a node that was killed still counts '
                'for some 20 s)')
        self._several = several
