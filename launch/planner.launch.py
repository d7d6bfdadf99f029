"""Launch the planner alone."""

from flex_planner.ros.launching import create_node, declare_arguments
from launch import LaunchContext, LaunchDescription
from launch.actions import OpaqueFunction
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the planner, with the parameters of a file and an arm."""
    return LaunchDescription([*declare_arguments(), OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    return [create_node(context, 'planner', 'flex_planner', [])]
