"""Reading what we and others wrote, and what is damaged."""

from __future__ import annotations

from pathlib import Path

from flex_planner.base.errors import RecordingError
from flex_planner.recording import (
    MessageTypes,
    read_attachments,
    read_metadata,
    read_recording,
    Recording,
    Topic,
)
from mcap.reader import make_reader
import pytest
from recording_support import START, state, STATES, summary_of, TRAJECTORY, TREE
from rosbags.rosbag2 import Writer as RosbagsWriter
from rosbags.rosbag2.enums import StoragePlugin
from rosbags.typesys import get_typestore, Stores
import yaml


def test_summary_is_read_back(plan: Path) -> None:
    metadata = read_metadata(plan / 'plan_0.mcap')
    assert [t.topic for t in metadata.topics] == [TRAJECTORY, STATES, TREE]
    assert (metadata.start_ns, metadata.duration_ns, metadata.message_count) == (START, 10, 6)
    assert metadata.custom_data == {'version': '0.1'}
    written = yaml.safe_load((plan / 'metadata.yaml').read_text())
    assert metadata.to_dict() == written['rosbag2_bagfile_information']


def test_attachments_are_read_back(plan: Path) -> None:
    assert read_attachments(plan) == {'task.yaml': b'payload: 1\n'}
    with (plan / 'plan_0.mcap').open('rb') as stream:
        (attachment,) = make_reader(stream).iter_attachments()
    assert (attachment.media_type, attachment.log_time) == ('application/yaml', 5)


def test_bag_of_rosbags_is_read(tmp_path: Path, types: MessageTypes) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    with RosbagsWriter(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(STATES.name, STATES.type_name, typestore=store)
        writer.write(connection, 5, types.encode(STATES.type_name, state()))
    (found,) = read_recording(tmp_path / 'bag', types)
    assert found.topic == STATES
    assert found.message.name == ['q1']
    assert read_metadata(tmp_path / 'bag').message_count == 1


def test_topics_of_one_type_share_a_schema(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        for name in ('/a', '/b'):
            recording.write(Topic(name, STATES.type_name), state(), 0)
    assert len(summary_of(recording.path).schemas) == 1
    assert [m.topic.name for m in read_recording(recording.path, types)] == ['/a', '/b']


def test_topics_can_be_selected(plan: Path, types: MessageTypes) -> None:
    assert [m.topic for m in read_recording(plan, types, [TREE.name])] == [TREE]
    assert list(read_recording(plan, types, [])) == []


def test_missing_recording_is_an_error(tmp_path: Path, types: MessageTypes) -> None:
    with pytest.raises(RecordingError, match='No such file'):
        list(read_recording(tmp_path / 'absent', types))
    with pytest.raises(RecordingError, match=r'holds 0 \.mcap files'):
        read_attachments(tmp_path)


def test_truncated_recording_is_an_error(plan: Path, types: MessageTypes) -> None:
    file = plan / 'plan_0.mcap'
    content = file.read_bytes()
    for size in [*range(60), *range(60, len(content), 97)]:
        file.write_bytes(content[:size])
        with pytest.raises(RecordingError):
            list(read_recording(plan, types))
        with pytest.raises(RecordingError):
            read_metadata(plan)
        with pytest.raises(RecordingError):
            read_attachments(plan)


def test_one_damaged_byte_anywhere_is_an_error(plan: Path) -> None:
    file = plan / 'plan_0.mcap'
    content = file.read_bytes()
    for position in [*range(0, len(content), 17), *range(len(content) - 40, len(content))]:
        damaged = bytearray(content)
        damaged[position] ^= 0xff
        file.write_bytes(damaged)
        with pytest.raises(RecordingError):
            read_metadata(plan)
