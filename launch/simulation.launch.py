"""Launch the planner and a simulated arm that follows its trajectories."""

from flex_planner.ros.launching import create_node, create_views, declare_arguments
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the two nodes, with the parameters of one file and the same arm."""
    return LaunchDescription([
        *declare_arguments(), DeclareLaunchArgument(
            'rviz', default_value='false', choices=['true', 'false'],
            description='Whether to show plans and the simulated arm in RViz'),
        OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    topic = [('joint_trajectory', 'flex_planner/joint_trajectory')]
    return [create_node(context, 'planner', 'flex_planner', []),
            create_node(context, 'arm_simulator', 'arm_simulator', topic),
            *create_views(context)]
