"""The demonstration, from start to end."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import re

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.cli import demonstration
from flex_planner.cli.demo_motions import demo_motion
from flex_planner.ros.messages.plans import task_from_message
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import MotionTask
from flex_planner_interfaces.srv import PlanPath
import numpy as np
import pytest
import rclpy
from ros_support import DOMAIN
from rosbags.highlevel import AnyReader


@pytest.fixture(scope='module', autouse=True)
def ros() -> Iterator[None]:
    rclpy.init(domain_id=DOMAIN)
    yield
    rclpy.shutdown()


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp('demo')


@pytest.fixture(scope='module')
def table(folder: Path, ros: None) -> dict[str, str]:
    rows = [re.split(' {2,}', line.strip(), maxsplit=1)
            for line in demonstration.run(folder).splitlines()]
    return {row[0]: row[1] for row in rows}


def test_table_shows_motion_certificate_and_files(table: dict[str, str]) -> None:
    assert list(table) == [
        'arm', 'motion', 'planned in', 'warning', 'on the topic after', 'cost J', 'joint 1',
        'joint 2', 'certificate', 'collocation residual', 'boundary error',
        'Hamiltonian drift', 're-simulated tip error', 'residual vibration',
        'simulated arm, at rest', 'picture', 'recording', 'output folder']
    assert table['arm'] == 'Korayem 2009 two-link arm, EI = 50 N m^2'
    assert table['motion'] == '(0.5, 0.0) m to (0.5, 0.5) m in 1 s with 1 kg'
    assert float(table['cost J']) == pytest.approx(0.64717, abs=1e-4)
    assert float(table['re-simulated tip error'].removesuffix(' mm')) < 0.01
    assert float(table['on the topic after'].removesuffix(' s')) > 0


def test_simulated_arm_arrives(table: dict[str, str]) -> None:
    row = table['simulated arm, at rest']
    found = re.fullmatch(r'tip error (\S+) mm, vibration (\S+) mm', row)
    assert found is not None
    assert float(found[1]) < 0.01
    assert float(found[2]) < 0.01


def test_picture_and_recording_are_in_the_folder(table: dict[str, str], folder: Path) -> None:
    assert Path(table['picture']) == folder / 'motion.png'
    assert Path(table['picture']).read_bytes().startswith(b'\x89PNG')
    recording = Path(table['recording'])
    assert recording.parent == folder / 'recordings'
    with AnyReader([recording]) as reader:
        assert '/flex_planner/joint_trajectory' in reader.topics


@pytest.mark.parametrize(('name', 'space'), [
    ('korayem_ei50', MotionTask.CARTESIAN), ('spatial_3r', MotionTask.CARTESIAN_GOAL),
    ('tudor_like', MotionTask.CARTESIAN_GOAL)])
def test_arms_in_space_have_a_motion_to_a_point_too(name: str, space: int) -> None:
    motion, arm = demo_motion(name), load_arm(name)
    message = demonstration._task(motion)
    assert message.space == space
    assert message.publish
    task = task_from_message(message, arm, PlannerSettings.for_arm(arm))
    assert task.goal_point.tolist() == list(motion.goal)
    start = motion.initial_positions(arm)
    np.testing.assert_allclose(task.start_positions, start, atol=1e-12)


def test_arm_without_a_motion_is_refused_by_name() -> None:
    with pytest.raises(InvalidValueError, match='--arm is .* did you mean tudor_like'):
        demo_motion('tudorlike')


def test_demonstration_waits_for_nodes_with_a_limit(ros: None) -> None:
    client = demonstration.DemoClient()
    try:
        with pytest.raises(demonstration.DemoError, match='no planner within 0.1 s'):
            client.wait('planner', client.create_client(PlanPath, '/absent').service_is_ready, 0.1)
    finally:
        client.destroy_node()
