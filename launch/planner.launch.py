"""Launch the planner alone."""

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
        Node(
            package='flex_planner', executable='planner', name='flex_planner',
            output='screen', parameters=parameters,
        ),
    ])
