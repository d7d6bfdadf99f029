"""The description of a robot from a parameter or a topic, with an arm file beside it or alone."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from flex_planner.arms.arm_files import ArmFileError, load_arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.urdf_files import UrdfError
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.dynamics.cache_key import describe_fields
from flex_planner.ros.runtime import descriptions
from flex_planner.ros.runtime.descriptions import hear_description
from flex_planner.ros.runtime.parameters import ARM_PARAMETERS, declare_arm
import pytest
from ros_support import Client
from std_msgs.msg import String

FOLDER = Path(__file__).parents[3] / 'examples' / 'urdf'
URDF = (FOLDER / 'two_tubes.urdf').read_text()


class GivenNode:
    """A node with parameters, of which those of an arm are asked for."""

    def __init__(self, **given: str) -> None:
        self._parameter_overrides, self.asked = given, list[str]()
        self._values: dict[str, SimpleNamespace] = {}

    def declare_parameter(self, name: str, default: str, descriptor: Any) -> SimpleNamespace:
        self.asked.append(name)
        assert descriptor.read_only
        assert descriptor.description
        self._values[name] = SimpleNamespace(value=self._parameter_overrides.get(name, default))
        return self._values[name]

    def get_parameter(self, name: str) -> SimpleNamespace:
        return self._values[name]


def declared(**given: str) -> SpatialArm:
    node = GivenNode(**given)
    arm = declare_arm(node)  # type: ignore[arg-type]
    assert tuple(node.asked) == ARM_PARAMETERS
    assert isinstance(arm, SpatialArm)
    return arm


def overlay(folder: Path, *left_out: str) -> str:
    """Return an arm file whose URDF is not where it says, or that names none."""
    lines = (FOLDER / 'two_tubes.yaml').read_text().splitlines(keepends=True)
    path = folder / 'overlay.yaml'
    path.write_text(''.join(line for line in lines if not line.startswith(left_out)))
    return str(path)


@pytest.mark.parametrize('left_out', [('nothing',), ('urdf:',)])
def test_description_stands_for_the_file_that_the_arm_file_names(tmp_path: Path,
                                                                 left_out: tuple[str]) -> None:
    arm = declared(arm=overlay(tmp_path, *left_out), robot_description=URDF)
    assert describe_fields(arm) == describe_fields(load_arm(FOLDER / 'two_tubes.yaml'))


def test_description_alone_is_a_rigid_arm() -> None:
    arm = declared(robot_description=URDF)
    assert (arm.name, arm.n_modes) == ('two_tubes', 0)
    assert arm.joint_names == ('yaw', 'shoulder', 'elbow')
    assert arm.joints[1].motor.standstill_torque == 60


@pytest.mark.parametrize(('given', 'kind', 'message'), [
    ({'arm': 'korayem_ei50', 'robot_description': URDF}, ArmFileError, 'links is .* a mapping'),
    ({'robot_description': '<robot'}, UrdfError, 'robot_description: is no XML'),
    ({'robot_description': '<robot/>'}, UrdfError, 'robot_description: links without a joint'),
    ({'robot_description': URDF, 'robot_description_topic': 'there'}, InvalidValueError,
     "robot_description_topic is 'there', but must be empty where robot_description is given")])
def test_bad_descriptions_are_refused(given: dict[str, str], kind: type[FlexPlannerError],
                                      message: str) -> None:
    with pytest.raises(kind, match=message):
        declared(**given)


def test_description_is_heard_on_its_topic() -> None:
    with Client() as sender, Client() as hearer:
        sender.node.create_publisher(String, '/described', descriptions._LATCHED).publish(
            String(data=URDF))
        assert hear_description(hearer.node, '/described') == URDF
        with pytest.raises(InvalidValueError, match="robot_description_topic is 'no topic'"):
            hear_description(hearer.node, 'no topic')


def test_nothing_on_the_topic_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(descriptions, '_PATIENCE', 0.1)
    with Client() as client, pytest.raises(FlexPlannerError, match='nothing has come on /silent'):
        hear_description(client.node, '/silent')
