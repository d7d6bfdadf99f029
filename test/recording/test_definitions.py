"""Definitions of messages: found, hashed as installed, and refused with a reason."""

from __future__ import annotations

import json
import os
from pathlib import Path
import subprocess
import sys

from flex_planner.base.errors import RecordingError
from flex_planner.recording import definition_folder, MessageTypes
import pytest
from recording_support import LEAF, TRAJECTORY, TREE_TEXT


def installed_hashes() -> dict[str, str]:
    prefixes = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    files = [f for p in prefixes if p for f in Path(p, 'share').glob('*/msg/*.json')]
    entries = [e for f in files for e in json.loads(f.read_text())['type_hashes']]
    return {entry['type_name']: entry['hash_string'] for entry in entries}


def test_type_hashes_are_those_of_the_installed_packages() -> None:
    expected = installed_hashes()
    if TRAJECTORY.type_name not in expected:
        pytest.skip('no ROS packages installed')
    types = MessageTypes.load()
    known = {name: value for name, value in expected.items() if name in types}
    assert {name: types.type_hash(name) for name in known} == known
    assert len(known) > 150


def test_own_interfaces_are_found_and_have_the_generated_hashes() -> None:
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    assert 'flex_planner_interfaces/msg/MotionTask' in types
    for name, value in installed_hashes().items():
        if name.startswith('flex_planner_interfaces/msg/'):
            assert types.type_hash(name) == value


def test_schema_of_an_own_type_keeps_its_comments(types: MessageTypes) -> None:
    schema = types.schema('tiny_interfaces/msg/Tree')
    parts = schema.split(80 * '=' + '\n')
    assert parts[0] == TREE_TEXT
    assert parts[1] == f'MSG: tiny_interfaces/Leaf\n{LEAF}'
    assert parts[2] == 'MSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n'


@pytest.mark.parametrize(('text', 'complaint'), [
    ('float64 2length', 'cannot use the definition of bad_interfaces/msg/Bad'),
    ('wstring name', 'unknown message type bad_interfaces/msg/wstring'),
    ('nowhere_msgs/Thing[] things', 'unknown message type nowhere_msgs/msg/Thing'),
])
def test_bad_definitions_are_refused(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / 'bad_interfaces' / 'msg').mkdir(parents=True)
    (tmp_path / 'bad_interfaces' / 'msg' / 'Bad.msg').write_text(text)
    with pytest.raises(RecordingError, match=complaint):
        MessageTypes.load([tmp_path / 'bad_interfaces'])


def test_a_standard_type_cannot_be_redefined(tmp_path: Path) -> None:
    (tmp_path / 'sensor_msgs' / 'msg').mkdir(parents=True)
    (tmp_path / 'sensor_msgs' / 'msg' / 'JointState.msg').write_text('float64[] angle\n')
    with pytest.raises(RecordingError, match='different definition'):
        MessageTypes.load([tmp_path / 'sensor_msgs'])


def test_folder_without_definitions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r'no \.msg files'):
        MessageTypes.load([tmp_path])


def test_definition_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'msg').mkdir()
    (tmp_path / 'msg' / 'Bad.msg').write_bytes(b'# \xff')
    with pytest.raises(RecordingError, match='cannot read the definitions in'):
        MessageTypes.load([tmp_path])


def test_definitions_are_found_under_the_ament_prefixes(tmp_path: Path, interfaces: Path) -> None:
    share = tmp_path / 'prefix' / 'share'
    share.mkdir(parents=True)
    (share / 'tiny_interfaces').symlink_to(interfaces)
    paths = {'AMENT_PREFIX_PATH': f'/nowhere{os.pathsep}{tmp_path / "prefix"}'}
    assert definition_folder('tiny_interfaces', paths) == share / 'tiny_interfaces'
    with pytest.raises(RecordingError, match='no message definitions of absent_msgs in .*/now'):
        definition_folder('absent_msgs', paths)


def test_recording_does_not_import_ros() -> None:
    code = ('import sys; import flex_planner.recording as r; r.MessageTypes.load(); '
            'assert not {"rclpy", "casadi", "matplotlib"} & set(sys.modules)')
    subprocess.run([sys.executable, '-c', code], check=True)
