"""Writing: the layout of the file, all or nothing, and what is refused."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys
import time
from typing import Any

from flex_planner.base.errors import InvalidValueError, RecordingError
from flex_planner.recording import (
    LATCHED,
    MessageTypes,
    QosProfile,
    read_attachments,
    read_metadata,
    read_recording,
    Recording,
    Topic,
)
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
import pytest
from recording_support import (
    mcap_records,
    record,
    state,
    STATES,
    summary_of,
    TRAJECTORY,
    trajectory,
    TREE,
)
import yaml

SUPPORT = Path(__file__).parents[1] / 'support'


# Layout


def test_file_is_an_indexed_mcap_of_profile_ros2(plan: Path) -> None:
    summary = summary_of(plan)
    assert [chunk.compression for chunk in summary.chunk_indexes] == ['zstd']
    assert len(summary.chunk_indexes[0].message_index_offsets) == 3
    with (plan / 'plan_0.mcap').open('rb') as stream:
        header = make_reader(stream).get_header()
    assert (header.profile, header.library.split('/')[0]) == ('ros2', 'flex_planner')


def test_file_has_every_checksum(plan: Path) -> None:
    with (plan / 'plan_0.mcap').open('rb') as stream:
        records = list(StreamReader(stream, emit_chunks=True).records)
    checksums = [getattr(record, name) for record in records for name in vars(record)
                 if name.endswith('_crc')]
    assert len(checksums) == 3  # of the chunk, the data and the summary
    assert all(checksums)


def test_channels_carry_cdr_schema_hash_and_quality_of_service(
    plan: Path, types: MessageTypes
) -> None:
    schema, channel, _, _ = mcap_records(plan)[0]
    assert (schema.name, schema.encoding) == (TRAJECTORY.type_name, 'ros2msg')
    assert schema.data.decode() == types.schema(TRAJECTORY.type_name)
    assert channel.message_encoding == 'cdr'
    assert channel.metadata['topic_type_hash'] == types.type_hash(TRAJECTORY.type_name)
    (qos,) = yaml.safe_load(channel.metadata['offered_qos_profiles'])
    infinite = {'sec': 9223372036, 'nsec': 854775807}
    assert qos == {
        'history': 'keep_last', 'depth': 1, 'reliability': 'reliable',
        'durability': 'transient_local', 'deadline': infinite, 'lifespan': infinite,
        'liveliness': 'automatic', 'liveliness_lease_duration': infinite,
        'avoid_ros_namespace_conventions': False}
    assert '&' not in channel.metadata['offered_qos_profiles']  # no YAML aliases


def test_identical_inputs_give_identical_bytes(tmp_path: Path, interfaces: Path) -> None:
    first = record(tmp_path / 'a', MessageTypes.load([interfaces]))
    time.sleep(0.01)
    second = record(tmp_path / 'b', MessageTypes.load([interfaces]))
    for name in ('plan_0.mcap', 'metadata.yaml'):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    assert sorted(path.name for path in first.iterdir()) == ['metadata.yaml', 'plan_0.mcap']


def test_bytes_do_not_depend_on_the_process(plan: Path, interfaces: Path, tmp_path: Path) -> None:
    code = (f'import sys; sys.path.insert(0, {str(SUPPORT)!r}); '
            'import pathlib, recording_support as t; '
            f'types = t.MessageTypes.load([pathlib.Path({str(interfaces)!r})]); '
            f't.record(pathlib.Path({str(tmp_path / "other")!r}), types)')
    other_process = {'PYTHONHASHSEED': '7', 'MALLOC_PERTURB_': '85', 'TZ': 'Asia/Tokyo'}
    subprocess.run([sys.executable, '-c', code], check=True, env=os.environ | other_process)
    other = (tmp_path / 'other' / 'plan' / 'plan_0.mcap').read_bytes()
    assert other == (plan / 'plan_0.mcap').read_bytes()


def test_many_messages_span_several_chunks(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        for i in range(4):
            recording.write(TRAJECTORY, trajectory(5000), i)
    assert len(summary_of(recording.path).chunk_indexes) > 1
    times = [m.log_time_ns for m in read_recording(tmp_path / 'plan', types, [TRAJECTORY.name])]
    assert times == [0, 1, 2, 3]


def test_recording_without_messages_is_readable(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        recording.attach('failure.yaml', b'', media_type='application/yaml')
    assert list(read_recording(recording.path, types)) == []
    assert read_metadata(recording.path).message_count == 0
    assert read_attachments(recording.path) == {'failure.yaml': b''}


# Refusals


@pytest.mark.parametrize('name', ['', '.', '..', '.hidden', 'a/b', '/abs', '-rf', ' a', 'a\n'])
def test_name_that_could_lead_elsewhere_is_refused(
    tmp_path: Path, types: MessageTypes, name: str
) -> None:
    with pytest.raises(InvalidValueError, match='^name is'):
        record(tmp_path / 'folder', types, name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(('times', 'complaint'), [
    ([-1], r'log_time_ns is -1, but must be in \[0, 9223372036854775807\] ns'),
    ([2**63], 'log_time_ns is 9223372036854775808'),
    ([1.5], 'log_time_ns is 1.5, but must be an integer'),
    ([5, 4], 'log_time_ns is 4, but must be >= 5, the last one'),
])
def test_log_times_do_not_run_backwards(
    tmp_path: Path, types: MessageTypes, times: list[int], complaint: str
) -> None:
    with pytest.raises(InvalidValueError, match=complaint):
        with Recording.create(tmp_path, 'plan', types) as recording:
            for log_time in times:
                recording.write(STATES, state(), log_time)


def test_refused_message_leaves_the_recording_whole(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        recording.write(STATES, state(), 7)
        with pytest.raises(InvalidValueError, match="with the field 'name'"):
            recording.write(STATES, trajectory(), 9)
        with pytest.raises(RecordingError, match='unknown message type a_msgs/msg/B'):
            recording.write(Topic('/b', 'a_msgs/msg/B'), trajectory(), 9)
        recording.write(STATES, state(), 8)
    assert [m.log_time_ns for m in read_recording(recording.path, types)] == [7, 8]
    assert [t.topic for t in read_metadata(recording.path).topics] == [STATES]


def test_topic_keeps_its_type_and_quality_of_service(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        recording.write(STATES, state(), 0)
        for other in (Topic(STATES.name, TREE.type_name),
                      Topic(STATES.name, STATES.type_name, LATCHED)):
            with pytest.raises(InvalidValueError, match='the same as before'):
                recording.write(other, state(), 0)


def test_closed_recording_takes_nothing(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        pass
    with pytest.raises(RecordingError, match='is closed'):
        recording.write(STATES, state(), 0)


@pytest.mark.parametrize('name', ['', 'task.yaml', 'a\nb', '\ud800'])
def test_attachment_needs_a_name_of_its_own(
    tmp_path: Path, types: MessageTypes, name: str
) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        recording.attach('task.yaml', b'', media_type='application/yaml')
        with pytest.raises(InvalidValueError, match='name of an attachment'):
            recording.attach(name, b'', media_type='application/yaml')


def test_depth_and_custom_data_are_checked(tmp_path: Path, types: MessageTypes) -> None:
    with pytest.raises(InvalidValueError, match='depth is 0, but must be at least 1'):
        QosProfile(depth=0)
    wrong: Any
    for wrong in ({'payload': 3.0}, {3: 'payload'}, {'payload': '\ud800'}):
        with pytest.raises(InvalidValueError, match=r'custom_data\[.* with a string as its key'):
            Recording.create(tmp_path, 'plan', types, custom_data=wrong).__enter__()
    assert list(tmp_path.iterdir()) == []
