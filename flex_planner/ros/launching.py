"""What the launch files share; for ``ros2 launch``, whose packages nothing else needs."""

from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from flex_planner.arms.urdf_files import expand_urdf, find_urdf
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
            'urdf', default_value='', description='URDF or xacro file for the nodes, in place of '
            'the one that the arm file names, and for a robot_state_publisher; without an arm '
            'file every link is rigid'),
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
    arm, file, clock, urdf = (LaunchConfiguration(argument).perform(context) for argument in (
        'arm', 'params_file', 'use_sim_time', 'urdf'))
    if urdf:
        parameters['robot_description'] = _description(urdf)
    if not arm and not file and not urdf:
        file = str(Path(get_package_share_directory('flex_planner'), 'config', 'paper.yaml'))
    if arm:
        parameters['arm'] = ParameterValue(arm, value_type=str)
    if clock == 'true':
        parameters['use_sim_time'] = True
    return Node(
        package='flex_planner', executable=executable, name=name, output='screen',
        namespace=LaunchConfiguration('namespace'), remappings=remappings,
        parameters=[*([file] if file else []), *([parameters] if parameters else [])])


def create_views(context: LaunchContext) -> list[Node]:
    """
    Return what shows the arm: a robot_state_publisher if there is a URDF file, RViz if wanted.

    The robot_state_publisher has the links that do not bend, beside the frames of the simulated
    arm; it hears of the joints from ``joint_states``, where they have the names of the URDF file.

    """
    urdf, rviz = (LaunchConfiguration(argument).perform(context) for argument in ('urdf', 'rviz'))
    space, views = LaunchConfiguration('namespace'), []
    if urdf:
        views.append(Node(package='robot_state_publisher', executable='robot_state_publisher',
                          namespace=space,
                          parameters=[{'robot_description': _description(urdf)}]))
    if rviz == 'true':
        file = Path(get_package_share_directory('flex_planner'), 'rviz', 'flex_planner.rviz')
        views.append(Node(package='rviz2', executable='rviz2', namespace=space,
                          arguments=['--display-config', str(file)]))
    return views


def _description(urdf: str) -> ParameterValue:
    return ParameterValue(expand_urdf(find_urdf(urdf, Path())), value_type=str)
