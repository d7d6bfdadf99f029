"""What the launch files start, by a double of launch, and with launch itself where it is there."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
import runpy
import signal
import subprocess
import sys
from types import SimpleNamespace
from typing import Any
from xml.dom import minidom

from ament_index_python.packages import get_package_share_directory
from flex_planner.arms.arm_files import load_arm
from flex_planner.ros.settings.planner import PlannerSettings
import launch_double
import pytest
from ros_support import Client, STARTING
import yaml

ROOT = Path(__file__).resolve().parents[2]
LAUNCH_FILES = sorted(path.name for path in ROOT.glob('launch/*.launch.py'))
each_file = pytest.mark.parametrize('name', LAUNCH_FILES)
SCRIPT = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
path, *pairs = sys.argv[1:]
service = LaunchService()
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    PythonLaunchDescriptionSource(path),
    launch_arguments=[tuple(pair.split(':=')) for pair in pairs])]))
sys.exit(service.run())
"""


def started(name: str, **given: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the arguments of a launch file, and what nodes of this package are given."""
    with launch_double.doubled():
        description = runpy.run_path(str(ROOT / 'launch' / name))['generate_launch_description']()
        (entities,) = description.arguments
        arguments = {entity.arguments[0]: entity.keywords for entity in entities
                     if isinstance(entity, launch_double.DeclareLaunchArgument)}
        values = {argument: words['default_value'] for argument, words in arguments.items()}
        (opaque,) = (entity.keywords['function'] for entity in entities
                     if isinstance(entity, launch_double.OpaqueFunction))
        nodes = opaque(launch_double.LaunchContext({**values, **given}))
        return arguments, [node.keywords for node in nodes]


@pytest.mark.parametrize(('name', 'executables'), [
    ('planner.launch.py', ['planner']), ('ros2_control.launch.py', ['planner']),
    ('simulation.launch.py', ['planner', 'arm_simulator'])])
def test_launch_file_starts_nodes_in_the_namespace(name: str, executables: list[str]) -> None:
    arguments, nodes = started(name)
    assert [node['executable'] for node in nodes] == executables
    assert {node['package'] for node in nodes} == {'flex_planner'}
    assert [node['namespace'].arguments for node in nodes] == [('namespace',)] * len(nodes)
    assert {'namespace', 'arm', 'params_file', 'use_sim_time'} <= arguments.keys()
    assert all(words['description'] for words in arguments.values())


@each_file
@pytest.mark.parametrize(('given', 'file', 'arm'), [
    ({}, 'paper.yaml', None), ({'arm': 'three_links'}, None, 'three_links'),
    ({'params_file': '/own.yaml'}, 'own.yaml', None),
    ({'params_file': '/own.yaml', 'arm': '12'}, 'own.yaml', '12')])
def test_nodes_get_the_file_and_the_arm_that_are_given(name: str, given: dict[str, str],
                                                       file: str | None, arm: str | None) -> None:
    for node in started(name, **given)[1]:
        files = [Path(entry).name for entry in node['parameters'] if isinstance(entry, str)]
        single = {key: value for entry in node['parameters'] if isinstance(entry, dict)
                  for key, value in entry.items()}
        assert files == ([file] if file else [])
        assert (single['arm'].value if 'arm' in single else None) == arm
        assert 'use_sim_time' not in single


def test_nodes_follow_the_clock_if_they_are_told_to() -> None:
    for node in started('simulation.launch.py', use_sim_time='true')[1]:
        assert node['parameters'][-1]['use_sim_time'] is True


def test_urdf_goes_to_the_nodes_and_to_a_robot_state_publisher() -> None:
    urdf = ROOT / 'examples' / 'urdf' / 'two_tubes.urdf'
    nodes = started('simulation.launch.py', urdf=str(urdf), arm='two_tubes.yaml', rviz='true')[1]
    assert [node['executable'] for node in nodes] == [
        'planner', 'arm_simulator', 'robot_state_publisher', 'rviz2']
    for node in nodes[:3]:
        assert node['parameters'][-1]['robot_description'].value == urdf.read_text()
    # alone, it is the arm: no preset and none of its parameters
    (planner,) = started('planner.launch.py', urdf=str(urdf))[1]
    assert [list(entry) for entry in planner['parameters']] == [['robot_description']]


def test_xacro_file_is_expanded_for_the_nodes(tmp_path: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'xacro', SimpleNamespace(process_file=minidom.parse))
    file = tmp_path / 'arm.urdf.xacro'
    file.write_text('<robot name="arm"><!-- a comment --><link name="base"/></robot>')
    (planner,) = started('planner.launch.py', urdf=str(file))[1]
    sent = planner['parameters'][-1]['robot_description'].value
    assert sent == minidom.parse(str(file)).toxml()


def test_rviz_shows_topics_that_are_there() -> None:
    (path,) = ROOT.glob('rviz/*.rviz')
    displays = yaml.safe_load(path.read_text())['Visualization Manager']['Displays']
    topics = {display['Topic']['Value'] for display in displays if 'Topic' in display}
    assert topics == {'flex_planner/markers', 'arm_simulator/markers'}


def test_controllers_file_is_that_of_the_default_controller_of_the_planner() -> None:
    text = (ROOT / 'config' / 'controllers.yaml').read_text()
    content = {key.removeprefix('/**/'): value['ros__parameters']
               for key, value in yaml.safe_load(text).items()}
    controller, settings = (content['joint_trajectory_controller'],
                            PlannerSettings.for_arm(load_arm('korayem_ei50')))
    assert content['controller_manager']['update_rate'] == settings.controller_rate
    assert controller['joints'] == settings.joint_names
    assert controller['command_interfaces'] == ['effort']
    gains = [controller['gains'][name] for name in controller['joints']]
    assert [gain['p'] for gain in gains] == settings.controller_stiffness
    assert [gain['d'] for gain in gains] == settings.controller_damping
    assert not controller['allow_nonzero_velocity_at_trajectory_end']
    arguments, (planner,) = started('ros2_control.launch.py')
    assert Path(arguments['controllers_file']['default_value']).name == 'controllers.yaml'
    (rule,) = planner['remappings']
    assert rule[0] == '~/joint_trajectory'
    assert arguments['start_hold']['default_value'] == '1.0'


@pytest.mark.skipif(find_spec('launch_ros') is None, reason='launch is not installed')
@each_file
def test_launch_starts_an_arm_with_three_joints_in_a_namespace(name: str, tmp_path: Path) -> None:
    path = Path(get_package_share_directory('flex_planner'), 'launch', name)
    log, nodes = tmp_path / 'log.txt', 1 + (name == 'simulation.launch.py')
    with Client() as client, log.open('wb') as output:
        process = subprocess.Popen(
            [sys.executable, '-c', SCRIPT, path, 'arm:=three_links', 'namespace:=robot'],
            stdout=output, stderr=subprocess.STDOUT)
        try:
            client.wait('the nodes', lambda: log.read_text().count('Three flexible links') > nodes,
                        STARTING)
            client.wait('the planner', lambda: 'robot.flex_planner]: ready' in log.read_text())
        finally:
            process.send_signal(signal.SIGINT)  # by others, launch leaves its nodes behind
            process.wait(STARTING)
    assert 'Traceback' not in log.read_text()
