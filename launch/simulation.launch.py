"""Launch the planner and a simulated arm that follows its trajectories."""

from flex_planner.ros.launching import create_node, declare_arguments
from launch import LaunchContext, LaunchDescription
from launch.actions import OpaqueFunction
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the two nodes, with the parameters of one file and the same arm."""
    return LaunchDescription([*declare_arguments(), OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    topic = [('joint_trajectory', 'flex_planner/joint_trajectory')]
    return [create_node(context, 'planner', 'flex_planner', []),
            create_node(context, 'arm_simulator', 'arm_simulator', topic)]
