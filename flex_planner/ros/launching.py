"""What the launch files share; for ``ros2 launch``, whose packages nothing else needs."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, SomeSubstitutionsType
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def declare_arguments() -> list[DeclareLaunchArgument]:
    """Return the arguments of every launch file."""
    return [
        DeclareLaunchArgument('namespace', default_value='', description='Of all nodes'),
        DeclareLaunchArgument(
            'arm', default_value='', description='Name of an arm in config/arms, or path of an '
            'arm file; default: that of params_file. What has one entry per joint follows the arm '
            'where params_file leaves it out'),
        DeclareLaunchArgument(
            'params_file', default_value='', description='Parameters of the nodes; default: '
            'config/paper.yaml, or none if there is an arm'),
        DeclareLaunchArgument(
            'use_sim_time', default_value='false', choices=['true', 'false'],
            description='Whether the nodes follow /clock')]


def create_node(context: LaunchContext, executable: str, name: str,
                remappings: list[tuple[SomeSubstitutionsType, SomeSubstitutionsType]],
                **parameters: object) -> Node:
    """
    Return a node of this package with the parameters that the arguments give it.

    Parameters
    ----------
    context : LaunchContext
        With values of the arguments.
    executable, name : str
        Of the node.
    remappings : list of pairs
        Of names.
    **parameters : object
        More of them, which count more than those of the file.

    """
    arm, file, clock = (LaunchConfiguration(argument).perform(context)
                        for argument in ('arm', 'params_file', 'use_sim_time'))
    if not arm and not file:
        file = str(Path(get_package_share_directory('flex_planner'), 'config', 'paper.yaml'))
    if arm:
        parameters['arm'] = ParameterValue(arm, value_type=str)
    if clock == 'true':
        parameters['use_sim_time'] = True
    return Node(
        package='flex_planner', executable=executable, name=name, output='screen',
        namespace=LaunchConfiguration('namespace'), remappings=remappings,
        parameters=[*([file] if file else []), *([parameters] if parameters else [])])
