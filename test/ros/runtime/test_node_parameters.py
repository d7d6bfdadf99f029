"""Parameters of a node in a process: files in a namespace, what is written wrongly, dumps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flex_planner.ros.runtime.processes import NodeProcess
import pytest
from rcl_interfaces.srv import ListParameters
from ros_support import Planner, STARTING
import yaml

FILE = """
/**/flex_planner:
  ros__parameters:
    effort_weights: [1, 2.5]
    controller_stiffness: [90, 80]
    payload_step: 3
    sampling_stp: 0.005
flex_planer:
  ros__parameters:
    payload_step: 4.0
"""


class Robot(Planner):
    """A planner in a namespace, with a file of parameters."""

    def __init__(self, folder: Path, file: Path) -> None:
        super().__init__(folder, 'korayem_rigid', space='/robot', parameter_file=file,
                         record=False)

    def dump(self) -> str:
        """Return what ``ros2 param dump`` prints."""
        names = self.call(ListParameters, f'{self.name}/list_parameters',
                          ListParameters.Request()).result.names
        values = {name: self.parameter(name) for name in names}
        text: str = yaml.dump({self.name: {'ros__parameters': values}}, default_flow_style=False)
        return text


def test_dumped_parameters_are_loaded_again(tmp_path: Path) -> None:
    own, path = tmp_path / 'own.yaml', tmp_path / 'dump.yaml'
    own.write_text(FILE)
    # one after the other: of two nodes with one name, either may answer
    with Robot(tmp_path, own) as robot:
        text = robot.dump()
    path.write_text(text)
    with Robot(tmp_path, path) as again:
        assert again.dump() == text
        assert 'WARN' not in again.log()


@pytest.fixture(scope='module')
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    folder = tmp_path_factory.mktemp('robot')
    (folder / 'own.yaml').write_text(FILE)
    with Robot(folder, folder / 'own.yaml') as robot:
        yield robot


def test_file_is_read_in_a_namespace_and_whole_numbers_are_floats(robot: Robot) -> None:
    assert list(robot.parameter('effort_weights')) == [1.0, 2.5]
    assert list(robot.parameter('controller_stiffness')) == [90.0, 80.0]
    assert robot.parameter('payload_step') == 3.0


def test_misspelt_parameter_is_named_with_the_one_that_is_meant(robot: Robot) -> None:
    assert 'there is no parameter sampling_stp (did you mean sampling_step?)' in robot.log()
    assert robot.log().count('there is no parameter') == 1


def test_whole_numbers_and_lists_of_all_numbers_can_be_set(robot: Robot) -> None:
    assert robot.set_parameter('payload_step', 2).successful
    assert robot.parameter('payload_step') == 2.0
    for given, kept in (([3, 4], [3.0, 4.0]), ('[1, 0.5]', [1.0, 0.5])):
        assert robot.set_parameter('effort_weights', given).successful
        assert list(robot.parameter('effort_weights')) == kept
    for wrong in ('[1, two]', '[1, 2, 3.5]', '[', [0, 1], True):
        assert not robot.set_parameter('effort_weights', wrong).successful
    assert 'one of fast' in robot.set_parameter('search', '[1, 2]').reason
    assert list(robot.parameter('effort_weights')) == [1.0, 0.5]


@pytest.mark.parametrize(('arguments', 'reason'), [
    ({'parameter_file': Path('/none.yaml')}, "Couldn't parse params file: '--params-file /none"),
    ({'parameters': {'stiffness': '[1.0, two]'}}, "Couldn't parse parameter override rule")])
def test_command_line_that_rcl_cannot_read_is_an_error_in_one_sentence(
        tmp_path: Path, arguments: dict[str, object], reason: str) -> None:
    log = tmp_path / 'log.txt'
    with NodeProcess('flex_planner.ros.arm_simulator', log=log, **arguments) as node:
        assert node.process.wait(STARTING) == 1
    said = log.read_text()
    assert f'arm_simulator: ROS cannot start: failed to initialize rcl: {reason}' in said
    assert 'Traceback' not in log.read_text()
