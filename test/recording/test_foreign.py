"""Recordings of other writers, with whatever they leave out and whatever they add."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import logging
from pathlib import Path
import shutil
from typing import Any

from flex_planner.base.errors import RecordingError
from flex_planner.recording import (
    ForeignChannel,
    LATCHED,
    MessageTypes,
    QosProfile,
    read_attachments,
    read_metadata,
    read_recording,
    read_serialized,
    recover_recording,
)
from mcap.records import Attachment, Channel, Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from other_writers import (
    COPIED,
    FOREIGN,
    messages_of,
    OPTIONS,
    rewrite,
    with_schema,
)
import pytest
from recording_support import LEAF, START, state, STATES, TRAJECTORY, TREE, TREE_TEXT
import yaml

OWN = [TRAJECTORY, *4 * [STATES], TREE]
UNREADABLE = {name for name in FOREIGN if name not in COPIED}


@pytest.mark.parametrize('backwards', [False, True])
@pytest.mark.parametrize('options', OPTIONS.values(), ids=OPTIONS)
def test_whatever_a_writer_leaves_out_everything_known_is_read(
        plan: Path, tmp_path: Path, types: MessageTypes, options: dict[str, Any],
        backwards: bool) -> None:
    file = rewrite(plan, tmp_path / 'other.mcap', options, backwards=backwards)
    found = list(read_recording(file, types))
    assert sorted(m.topic.name for m in found) == sorted(topic.name for topic in OWN)
    times = [m.log_time_ns for m in found]
    assert times == sorted(times)
    assert {m.topic: m.message for m in found}[TREE].name == 'elm'
    assert read_attachments(file) == {'task.yaml': b'payload: 1\n'}
    metadata = read_metadata(file)
    assert {entry.topic.name: entry.message_count for entry in metadata.topics} == {
        TRAJECTORY.name: 1, STATES.name: 4, TREE.name: 1, '/compressed': 1,
        **dict.fromkeys(COPIED, 1)}
    assert (metadata.start_ns, metadata.end_ns) == (START, START + 10)
    assert {channel.name for channel in metadata.foreign} | {'/compressed'} == UNREADABLE


def test_what_is_not_read_is_named_with_its_reason(plan: Path, tmp_path: Path,
                                                   types: MessageTypes,
                                                   caplog: pytest.LogCaptureFixture) -> None:
    file, told = rewrite(plan, tmp_path / 'other.mcap'), list[ForeignChannel]()
    assert len(list(read_recording(file, types, left_out=told.append))) == len(OWN)
    assert {channel.name: channel.message_count for channel in told} == dict.fromkeys(FOREIGN, 1)
    reasons = {channel.name: channel.reason for channel in told}
    assert reasons['/json'] == "its messages are json, not ROS 2's cdr"
    assert reasons['/service'] == 'its type example_interfaces/srv/AddTwoInts_Event is unknown'
    assert reasons['/unknown'].startswith(
        'the recorded definition of its type a_msgs/msg/Thing cannot be used: ')
    with caplog.at_level(logging.WARNING):
        list(read_recording(file, types))
    assert '/protobuf (1 message): its messages are protobuf' in caplog.text
    names = [STATES.name, '/json']
    assert len(list(read_recording(file, types, names, told.append))) == 4
    assert told[-1].name == '/json'


def test_recovery_copies_messages_of_any_type_and_names_the_others(
        plan: Path, tmp_path: Path, types: MessageTypes) -> None:
    file, told = rewrite(plan, tmp_path / 'a b (ü).mcap'), list[ForeignChannel]()
    path = recover_recording(file, types, told.append)
    assert path.name == 'a b (ü)_recovered'
    assert {channel.name for channel in told} == UNREADABLE
    expected = sorted(entry for entry in messages_of(file) if entry[0] not in UNREADABLE)
    assert sorted(messages_of(next(path.glob('*.mcap')))) == expected
    assert [m.topic for m in read_recording(path, types)] == OWN
    original = {entry.topic.name: entry.definition for entry in read_metadata(file).topics}
    for entry in read_metadata(path).topics:
        assert entry.definition == original[entry.topic.name]


def test_recording_with_nothing_of_ros_is_empty_but_no_error(tmp_path: Path,
                                                             types: MessageTypes) -> None:
    with (tmp_path / 'a.mcap').open('wb') as stream:
        writer = Writer(stream, use_statistics=False)
        writer.start()
        channel = writer.register_channel('/a', 'json', 0)
        writer.add_message(channel, 0, b'{}', 0)
        writer.finish()  # type: ignore[no-untyped-call]
    assert list(read_recording(tmp_path, types)) == []
    assert [str(channel) for channel in read_metadata(tmp_path).foreign] == [
        "/a (1 message): its messages are json, not ROS 2's cdr"]
    with pytest.raises(RecordingError, match='no complete message or attachment; /a '):
        recover_recording(tmp_path, types)


# Definitions


def test_type_recorded_with_another_definition_is_read_by_that(
        plan: Path, tmp_path: Path, types: MessageTypes) -> None:
    other = tmp_path / 'tiny_interfaces'
    (other / 'msg').mkdir(parents=True)
    (other / 'msg' / 'Leaf.msg').write_text('uint8 colour\nfloat32 length\n')
    (other / 'msg' / 'Tree.msg').write_text(TREE_TEXT)
    for known in (MessageTypes.load([other]), MessageTypes.load()):
        found = [m.message for m in read_recording(plan, known, [TREE.name])]
        assert (found[0].name, found[0].best.length, found[0].age.sec) == ('elm', 0.25, -1)


@pytest.mark.parametrize(('text', 'hashed', 'readable'), [
    ('float64 x\n', True, True),  # the hash says what it is
    ('float64 x\n', False, False),
    ('$?', False, False),
    ('', False, True),  # nothing speaks against the known one
    (TREE_TEXT.replace('bool alive', 'bool[] alive'), False, False)])
def test_definition_that_is_not_that_of_the_messages_does_no_harm(
        plan: Path, tmp_path: Path, types: MessageTypes, text: str, hashed: bool,
        readable: bool) -> None:
    if 'Leaf' in text:
        text += f'{"=" * 80}\nMSG: tiny_interfaces/Leaf\n{LEAF}'
    file = rewrite(plan, tmp_path / 'a.mcap', {}, with_schema(TREE.type_name, text, hashed))
    told = list[ForeignChannel]()
    found = list(read_recording(file, types, [TREE.name, STATES.name], told.append))
    assert [m.topic for m in found] == [*4 * [STATES], *readable * [TREE]]
    assert [channel.name for channel in told] == (not readable) * [TREE.name]


def test_definition_that_contradicts_its_hash_is_not_used(plan: Path, tmp_path: Path) -> None:
    file = rewrite(plan, tmp_path / 'a.mcap', {}, with_schema(TREE.type_name, 'bool x\n', True))
    told = list[ForeignChannel]()
    assert len(list(read_recording(file, MessageTypes.load(), left_out=told.append))) == 5
    assert 'contradicts the recorded type hash' in {c.name: c.reason for c in told}[TREE.name]


@pytest.mark.parametrize('text', [
    'a: [', '[[' * 2000, '!!timestamp x', '!!int x', '2020-99-99', '{[]: 1}', '- 5', '\x00', '7',
    '- {depth: 100000000000, reliability: [], durability: {}}', '- {depth: true}'])
def test_quality_of_service_that_is_none_is_the_default(text: str) -> None:
    assert QosProfile.from_yaml(text) == QosProfile()


# Folders


@pytest.mark.parametrize('content', [
    b'', b'5', b'[]', b'a: [', b'\xff\xfe', b'rosbag2_bagfile_information: 7',
    b'rosbag2_bagfile_information: {relative_file_paths: 7}',
    b'rosbag2_bagfile_information: {relative_file_paths: [7, {}, null]}',
    b'rosbag2_bagfile_information: {relative_file_paths: ["folder/plan_0.mcap"]}'])
def test_file_is_read_whatever_its_metadata_file_says(plan: Path, types: MessageTypes,
                                                      content: bytes) -> None:
    (plan / 'metadata.yaml').write_bytes(content)
    assert read_metadata(plan).message_count == 6
    assert recover_recording(plan, types).is_dir()


def test_files_of_any_name_are_read_in_the_order_that_the_metadata_file_lists(
        plan: Path, tmp_path: Path, types: MessageTypes) -> None:
    folder = tmp_path / 'Ordner für Läufe'
    folder.mkdir()
    for name, shift in (('zweite.mcap', 100), ('erste.mcap', 0), ('fremd.mcap', 50)):
        rewrite(plan, folder / name, OPTIONS['nothing'], moved(shift))
    with pytest.raises(RecordingError, match=r'holds 3 \.mcap files, but must hold one, or'):
        read_metadata(folder)
    (folder / 'metadata.yaml').write_text(yaml.safe_dump({'rosbag2_bagfile_information': {
        'relative_file_paths': ['erste.mcap', 'zweite.mcap']}}))
    found = [m.log_time_ns - START for m in read_recording(folder, types, [STATES.name])]
    assert found == [0, 1, 2, 3, 100, 101, 102, 103]
    assert [m.log_time_ns - START for m in read_serialized(folder, [TREE.name])] == [10, 110]
    assert recover_recording(folder, types).name == 'Ordner für Läufe_recovered'


def test_files_that_overlap_in_time_are_merged(plan: Path, tmp_path: Path,
                                               types: MessageTypes) -> None:
    folder = tmp_path / 'parts'
    folder.mkdir()
    for i, shift in enumerate((2, 0)):
        rewrite(plan, folder / f'a_{i}.mcap', {}, moved(shift))
    found = [m.log_time_ns - START for m in read_recording(folder, types, [STATES.name])]
    assert found == [0, 1, 2, 2, 3, 3, 4, 5]


@pytest.mark.parametrize(('name', 'hint'), [
    ('a_0.mcap.zstd', 'zstd -d'), ('a_0.db3', 'ros2 bag convert'), ('a.bag', 'rosbags-convert')])
def test_bag_of_another_kind_is_refused_with_what_to_do(tmp_path: Path, name: str,
                                                        hint: str) -> None:
    (tmp_path / name).write_text('')
    with pytest.raises(RecordingError, match=hint):
        read_metadata(tmp_path)


def moved(shift: int) -> Callable[[Any], Any]:
    """Return a change of log times."""
    return lambda record: (replace(record, log_time=record.log_time + shift)
                           if hasattr(record, 'publish_time') else record)


# Damage


@pytest.mark.parametrize(('content', 'reason'), [
    (b'', 'it is empty'), (bytes(100), 'it does not begin and end like one'),
    (b'\x89MCAP0\r\n', 'it ends within a record'),
    (b'\x89MCAP0\r\n' + bytes(100), 'a.mcap is damaged')])
def test_what_is_no_recording_is_refused_in_a_sentence(tmp_path: Path, types: MessageTypes,
                                                       content: bytes, reason: str) -> None:
    (tmp_path / 'a.mcap').write_bytes(content)
    for read in (read_metadata, read_attachments):
        with pytest.raises(RecordingError, match=reason):
            read(tmp_path / 'a.mcap')
    with pytest.raises(RecordingError, match='holds no complete message'):
        recover_recording(tmp_path / 'a.mcap', types)
    for odd in ('/dev/null', '/dev/zero'):
        with pytest.raises(RecordingError, match='it is no file'):
            read_metadata(odd)


@pytest.mark.parametrize('name', ['unchunked_nothing', 'nothing'])
def test_message_that_is_cut_is_never_taken_for_whole(plan: Path, tmp_path: Path,
                                                      types: MessageTypes, name: str) -> None:
    file = rewrite(plan, tmp_path / 'a.mcap', OPTIONS[name])
    content, whole = file.read_bytes(), set(messages_of(file))
    for size in range(60, len(content), 41):
        file.write_bytes(content[:size])
        with pytest.raises(RecordingError):
            read_metadata(file)
        try:
            path = recover_recording(file, types)
        except RecordingError:
            continue
        assert set(messages_of(next(path.glob('*.mcap')))) <= whole
        shutil.rmtree(path)


def test_unknown_compression_is_named(plan: Path, tmp_path: Path) -> None:
    file = tmp_path / 'a.mcap'
    content = next(plan.glob('*.mcap')).read_bytes()
    file.write_bytes(content.replace(b'\x04\0\0\0zstd', b'\x04\0\0\0zzzz'))
    with file.open('rb') as stream:
        assert [r.compression for r in StreamReader(stream, emit_chunks=True).records
                if isinstance(r, Chunk)] == ['zzzz']
    with pytest.raises(RecordingError, match="the compression 'zzzz' is unknown"):
        read_metadata(file)


def test_attachments_and_times_that_cannot_be_copied_are_named(plan: Path, tmp_path: Path,
                                                               types: MessageTypes) -> None:
    def change(record: Any) -> Any:
        if isinstance(record, Attachment):
            return replace(record, name='a\nb')
        if isinstance(record, Channel) and record.topic == TREE.name:
            return replace(record, topic=STATES.name)
        if hasattr(record, 'publish_time') and record.log_time == START + 3:
            return replace(record, log_time=2**64 - 1)
        return record

    told = list[ForeignChannel]()
    path = recover_recording(rewrite(plan, tmp_path / 'a.mcap', {}, change), types, told.append)
    assert [m.log_time_ns - START for m in read_recording(path, types, [STATES.name])] == [0, 1, 2]
    reasons = {channel.name: channel.reason for channel in told if channel.name not in FOREIGN}
    assert reasons.keys() == {"attachment 'a\\nb'", STATES.name}


def test_messages_that_are_not_of_their_type_are_left_out_one_by_one(
        plan: Path, tmp_path: Path, types: MessageTypes) -> None:
    good = types.encode(STATES.type_name, state(2))

    def change(record: Any) -> Any:
        return (replace(record, data=good[:20])
                if getattr(record, 'data', None) == good else record)

    file, told = rewrite(plan, tmp_path / 'a.mcap', {}, change), list[ForeignChannel]()
    assert len(list(read_recording(file, types, [STATES.name], told.append))) == 3
    ((name, count),) = [(channel.name, channel.message_count) for channel in told]
    assert (name, count) == (STATES.name, 1)
    path = recover_recording(file, types)
    assert read_metadata(path).topics[1].message_count == 3
    assert read_metadata(path).topics[0].topic.qos == LATCHED
