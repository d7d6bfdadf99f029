"""Launch the planner and a simulated arm that follows its trajectories."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the two nodes, with the parameters of one file and the same arm."""
    config = Path(get_package_share_directory('flex_planner'), 'config')
    parameters = [LaunchConfiguration('params_file'), {'arm': LaunchConfiguration('arm')}]
    return LaunchDescription([
        DeclareLaunchArgument(
            'arm', default_value='korayem_ei50',
            description='Name of an arm in config/arms, or path of an arm file',
        ),
        DeclareLaunchArgument(
            'params_file', default_value=str(config / 'planner.yaml'),
            description='Parameters of both nodes',
        ),
        Node(
            package='flex_planner', executable='planner', name='flex_planner',
            output='screen', parameters=parameters,
        ),
        Node(
            package='flex_planner', executable='arm_simulator', name='arm_simulator',
            output='screen', parameters=parameters,
            remappings=[('joint_trajectory', 'flex_planner/joint_trajectory')],
        ),
    ])
