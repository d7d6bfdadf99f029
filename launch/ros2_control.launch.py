"""
Launch the planner so that a joint_trajectory_controller carries out what it publishes.

The controller needs an effort command interface, and the joint names of the planner's parameters;
its own launch file starts it. Its rate and gains belong into those parameters, too
(controller_rate, controller_stiffness, controller_damping): trajectories are certified for them.

"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the planner, with the parameters of a file and an arm."""
    config = Path(get_package_share_directory('flex_planner'), 'config')
    parameters = [LaunchConfiguration('params_file'), {'arm': LaunchConfiguration('arm')}]
    return LaunchDescription([
        DeclareLaunchArgument(
            'arm', default_value='korayem_ei50',
            description='Name of an arm in config/arms, or path of an arm file',
        ),
        DeclareLaunchArgument(
            'params_file', default_value=str(config / 'planner.yaml'),
            description='Parameters of the node',
        ),
        DeclareLaunchArgument(
            'controller', default_value='/joint_trajectory_controller',
            description='Full name of the controller',
        ),
        Node(
            package='flex_planner', executable='planner', name='flex_planner',
            output='screen', parameters=parameters,
            remappings=[('~/joint_trajectory',
                         [LaunchConfiguration('controller'), '/joint_trajectory'])],
        ),
    ])
