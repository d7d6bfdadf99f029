"""
Launch the planner so that a joint_trajectory_controller carries out what it publishes.

The controller needs an effort command interface, version 4.22.0 or later, and the joint names of
the planner's parameters, as in config/controllers.yaml; a launch file of the robot starts its
controller manager. Its rate and gains belong into those parameters, too (controller_rate,
controller_stiffness, controller_damping): trajectories are certified for them.

"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from flex_planner.ros.launching import create_node, declare_arguments
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    """Return the planner for a controller, and what starts that controller if it is wanted."""
    config = Path(get_package_share_directory('flex_planner'), 'config')
    return LaunchDescription([
        *declare_arguments(),
        DeclareLaunchArgument(
            'controller', default_value='joint_trajectory_controller',
            description='Name of the controller, in the namespace unless it begins with /'),
        DeclareLaunchArgument(
            'start_hold', default_value='1.0', description='How long trajectories hold the arm '
            'before the motion, so that the controller leads it to the start [s]; 0: not'),
        DeclareLaunchArgument(
            'spawn', default_value='false', choices=['true', 'false'],
            description='Whether to have a running controller manager start the controller'),
        DeclareLaunchArgument(
            'controllers_file', default_value=str(config / 'controllers.yaml'),
            description='Parameters of the controller, where it is to be started'),
        OpaqueFunction(function=_nodes),
        Node(
            package='controller_manager', executable='spawner', output='screen',
            namespace=LaunchConfiguration('namespace'),
            condition=IfCondition(LaunchConfiguration('spawn')),
            arguments=[LaunchConfiguration('controller'), '--param-file',
                       LaunchConfiguration('controllers_file')],
        ),
    ])


def _nodes(context: LaunchContext) -> list[Node]:
    topic = [LaunchConfiguration('controller'), '/joint_trajectory']
    hold = ParameterValue(LaunchConfiguration('start_hold'), value_type=float)
    return [create_node(context, 'planner', 'flex_planner', [('~/joint_trajectory', topic)],
                        start_hold=hold)]
