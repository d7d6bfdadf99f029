"""Recordings: what other readers make of them, what they refuse, and that none is half-done."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import errno
import json
import os
from pathlib import Path
import resource
import subprocess
import sys
import time
from types import SimpleNamespace as Message
from typing import Any

from flex_planner.base.errors import InvalidValueError, RecordingError
from flex_planner.recording import (
    DEFAULT,
    definition_folder,
    Durability,
    LATCHED,
    MessageTypes,
    QosProfile,
    read_attachments,
    read_metadata,
    read_recording,
    Recording,
    Reliability,
    Topic,
)
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.records import Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.rosbag2 import Writer as RosbagsWriter
from rosbags.rosbag2.enums import StoragePlugin
from rosbags.typesys import get_typestore, Stores
import yaml

TRAJECTORY = Topic('/planner/trajectory', 'trajectory_msgs/msg/JointTrajectory', LATCHED)
STATES = Topic('/planner/states', 'sensor_msgs/msg/JointState')
TREE = Topic('/planner/tree', 'tiny_interfaces/msg/Tree')
# rclpy's type support imports lark, which imports a deprecated module.
of_lark = pytest.mark.filterwarnings('ignore:module .sre_:DeprecationWarning')
START = 1_700_000_000_000_000_000  # [ns]

LEAF = """\
uint8 GREEN=1
uint8 BROWN=2

uint8 colour       # GREEN or BROWN
float64 length     # [m]
"""
TREE_TEXT = """\
string<=8 name     # of the tree
bool alive
Leaf best
Leaf[] leaves
Leaf[2] pair
float64[3] position   # [m]
int16[<=4] rings
float32[] sap
string[] notes
builtin_interfaces/Duration age
byte flag
byte[] flags
"""


def header(seconds: int = 0) -> Message:
    return Message(stamp=Message(sec=seconds, nanosec=7), frame_id='base')


def point(i: int) -> Message:
    effort = [] if i == 0 else [4.0, -5.0]
    when = Message(sec=i, nanosec=999_999_999)
    return Message(positions=[0.1 * i, 1.0], velocities=[0.0, -0.0], accelerations=[],
                   effort=effort, time_from_start=when)


def trajectory(count: int = 3) -> Message:
    points = [point(i) for i in range(count)]
    return Message(header=header(), joint_names=['shoulder', 'ellbögen'], points=points)


def state(i: int = 0) -> Message:
    return Message(header=header(i), name=['q1'], position=np.array([0.5 * i]),
                   velocity=(1, 2), effort=[])


def leaf(colour: int = 1) -> Message:
    return Message(colour=colour, length=0.25)


def tree(**changes: object) -> Message:
    fields: dict[str, object] = {
        'name': 'elm', 'alive': True, 'best': leaf(), 'leaves': [leaf(2), leaf()],
        'pair': (leaf(), leaf()), 'position': [1.0, 2.0, 3.0], 'rings': [-1, 2], 'sap': [0.5],
        'notes': ['', 'a'], 'age': Message(sec=-1, nanosec=5), 'flag': b'\xff',
        'flags': [b'\x00', b'\x80']}
    return Message(**{**fields, **changes})


@pytest.fixture(scope='module')
def interfaces(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('definitions') / 'tiny_interfaces'
    (folder / 'msg').mkdir(parents=True)
    (folder / 'msg' / 'Leaf.msg').write_text(LEAF)
    (folder / 'msg' / 'Tree.msg').write_text(TREE_TEXT)
    return folder


@pytest.fixture(scope='module')
def types(interfaces: Path) -> MessageTypes:
    return MessageTypes.load([interfaces])


def record(folder: Path, types: MessageTypes, name: str = 'plan') -> Path:
    with Recording.create(folder, name, types, custom_data={'version': '0.1'}) as recording:
        recording.attach('task.yaml', b'payload: 1\n', media_type='application/yaml', time_ns=5)
        recording.write(TRAJECTORY, trajectory(), START)
        for i in range(4):
            recording.write(STATES, state(i), START + i)
        recording.write(TREE, tree(), START + 10)
    return recording.path


@pytest.fixture
def plan(tmp_path: Path, types: MessageTypes) -> Path:
    return record(tmp_path, types)


def mcap_records(path: Path) -> list[tuple[Any, Any, Any, Any]]:
    with (path / 'plan_0.mcap').open('rb') as stream:
        reader = make_reader(stream, True, [DecoderFactory()])
        return list(reader.iter_decoded_messages())


def summary_of(path: Path) -> Summary:
    with (path / 'plan_0.mcap').open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary


# Encoding


def test_our_reader_returns_what_was_written(plan: Path, types: MessageTypes) -> None:
    messages = list(read_recording(plan, types))
    assert [m.topic for m in messages] == [TRAJECTORY, *4 * [STATES], TREE]
    assert [m.log_time_ns - START for m in messages] == [0, 0, 1, 2, 3, 10]
    found = messages[0].message
    assert found.joint_names == ['shoulder', 'ellbögen']
    assert [p.time_from_start.nanosec for p in found.points] == 3 * [999_999_999]
    np.testing.assert_array_equal(found.points[2].positions, [0.2, 1.0])
    assert [len(p.effort) for p in found.points] == [0, 2, 2]
    assert np.signbit(found.points[1].velocities).tolist() == [False, True]


def test_custom_type_with_every_kind_of_field_round_trips(types: MessageTypes) -> None:
    found = types.decode(TREE.type_name, types.encode(TREE.type_name, tree()))
    assert (found.name, found.alive, found.notes) == ('elm', True, ['', 'a'])
    assert [x.colour for x in found.leaves] == [2, 1]
    assert [x.length for x in found.pair] == [0.25, 0.25]
    assert (found.age.sec, found.age.nanosec) == (-1, 5)
    assert (found.flag, found.flags.tolist()) == (-1, [0, -128])
    assert (found.rings.tolist(), found.sap.tolist()) == ([-1, 2], [0.5])


def test_decoded_messages_encode_to_the_same_bytes(types: MessageTypes) -> None:
    for topic, message in ((TRAJECTORY, trajectory()), (STATES, state()), (TREE, tree())):
        data = types.encode(topic.type_name, message)
        assert types.encode(topic.type_name, types.decode(topic.type_name, data)) == data


def test_numpy_scalars_and_rosbags_classes_are_messages_too(types: MessageTypes) -> None:
    duration = types.message_class('builtin_interfaces/msg/Duration')
    with_numpy = tree(age=duration(np.int64(-1), np.uint32(5)), alive=np.True_,
                      rings=np.array([-1, 2], np.int64), flags=np.array([0, -128], np.int8))
    assert types.encode(TREE.type_name, with_numpy) == types.encode(TREE.type_name, tree())


def test_cdr_is_little_endian_and_padded_with_zeros(types: MessageTypes) -> None:
    data = types.encode('tiny_interfaces/msg/Leaf', Message(colour=1, length=1.0))
    assert data.hex() == '00010000' + '01' + 7 * '00' + '000000000000f03f'


def test_empty_message_needs_no_attribute(types: MessageTypes) -> None:
    assert types.encode('std_msgs/msg/Empty', object()) == b'\0\1\0\0\0'


@pytest.mark.parametrize(('changes', 'complaint'), [
    ({'name': 'a long name'}, r'length of Tree\.name is 11, .* at most 8 bytes'),
    ({'name': 3}, r'Tree\.name is 3, .* a string'),
    ({'name': '\ud800'}, r'Tree\.name .* UTF-8'),
    ({'position': [1.0, 2.0]}, r'length of Tree\.position is 2, but must be 3'),
    ({'rings': [1, 2, 3, 4, 5]}, r'length of Tree\.rings is 5, but must be at most 4'),
    ({'rings': [40000]}, r'Tree\.rings is 40000, .*\[-32768, 32767\]'),
    ({'rings': [1.5, 2.0]}, r'Tree\.rings is \[1\.5, 2\.0\], .* int16'),
    ({'sap': [1e39]}, r'Tree\.sap is 1e\+39, .* float32'),
    ({'position': [[1.0, 2.0, 3.0]]}, r'Tree\.position .* a sequence of numbers'),
    ({'position': 1.0}, r'Tree\.position is 1\.0, .* a sequence of numbers'),
    ({'position': [[1.0], 2.0]}, r'Tree\.position .* a sequence of numbers'),
    ({'notes': 'abc'}, r"Tree\.notes is 'abc', .* a sequence"),
    ({'best': leaf(256)}, r'Tree\.best\.colour is 256, .*\[0, 255\]'),
    ({'leaves': [leaf(), leaf(-1)]}, r'Tree\.leaves\[1\]\.colour is -1'),
    ({'best': Message(colour=1)}, r"Tree\.best .* a message with the field 'length'"),
    ({'alive': 1}, r'Tree\.alive is 1, .* bool'),
    ({'flag': b'ab'}, r'length of Tree\.flag is 2'),
    ({'flags': [b'a', 1]}, r'Tree\.flags .* a sequence of numbers'),
])
def test_values_that_do_not_fit_are_named(
    types: MessageTypes, changes: dict[str, object], complaint: str
) -> None:
    with pytest.raises(InvalidValueError, match=complaint):
        types.encode(TREE.type_name, tree(**changes))


def test_bytes_that_are_no_message_are_refused(types: MessageTypes) -> None:
    data = types.encode(TREE.type_name, tree())
    for wrong in (b'', b'\0\2\0\0' + data[4:], data[:-30], data[:4] + b'\xff' * 40):
        with pytest.raises(RecordingError):
            types.decode(TREE.type_name, wrong)


# Definitions


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
    with pytest.raises(RecordingError, match='no message definitions of absent_msgs in /nowhere'):
        definition_folder('absent_msgs', paths)


def test_recording_does_not_import_ros() -> None:
    code = ('import sys; import flex_planner.recording as r; r.MessageTypes.load(); '
            'assert not {"rclpy", "casadi", "matplotlib"} & set(sys.modules)')
    subprocess.run([sys.executable, '-c', code], check=True)


# Other readers


@pytest.mark.parametrize('part', ['', 'plan_0.mcap'])
def test_rosbags_reads_the_folder_and_the_bare_file(
    plan: Path, types: MessageTypes, part: str
) -> None:
    with AnyReader([plan / part], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        assert reader.message_count == 6
        assert (reader.start_time, reader.end_time) == (START, START + 11)  # exclusive
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            assert types.encode(connection.msgtype, message) == data


def test_rosbags_reads_the_quality_of_service(plan: Path) -> None:
    with AnyReader([plan], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        extras = {c.topic: c.ext for c in reader.connections}
    assert isinstance(latched := extras[TRAJECTORY.name], ConnectionExtRosbag2)
    (qos,) = latched.offered_qos_profiles
    assert (qos.durability.name, qos.depth) == ('TRANSIENT_LOCAL', 1)
    assert isinstance(default := extras[STATES.name], ConnectionExtRosbag2)
    (qos,) = default.offered_qos_profiles
    assert (qos.reliability.name, qos.durability.name) == ('RELIABLE', 'VOLATILE')


def test_mcap_ros2_support_reads_every_message(plan: Path, types: MessageTypes) -> None:
    records = mcap_records(plan)
    assert [channel.topic for _, channel, _, _ in records][0] == TRAJECTORY.name
    assert len(records) == 6
    for schema, _, message, decoded in records:
        if schema.name != TREE.type_name:  # it returns a byte as an unsigned number
            assert types.encode(schema.name, decoded) == message.data
    found = records[-1][3]
    assert (found.name, list(found.rings), found.flag, found.age.sec) == ('elm', [-1, 2], 255, -1)


finite = st.floats(width=64)
leaves = st.builds(leaf, st.integers(0, 255))
trees = st.builds(tree, name=st.text(st.characters(max_codepoint=126, min_codepoint=32),
                                     max_size=8),
                  leaves=st.lists(leaves, max_size=3), rings=st.lists(st.integers(-9, 9),
                                                                      max_size=4),
                  sap=st.lists(st.floats(width=32), max_size=3), notes=st.lists(st.text('ab')),
                  flag=st.integers(0, 127), flags=st.just([]))


@given(message=trees)
def test_an_independent_decoder_agrees_on_every_alignment(
    types: MessageTypes, message: Message
) -> None:
    data = types.encode(TREE.type_name, message)
    definition = types.schema(TREE.type_name).encode()
    schema = Schema(id=1, name=TREE.type_name, encoding='ros2msg', data=definition)
    decode = DecoderFactory().decoder_for('cdr', schema)
    assert decode is not None
    assert types.encode(TREE.type_name, decode(data)) == data


@of_lark
def test_rclpy_reads_our_bytes_and_we_encode_its_messages(types: MessageTypes) -> None:
    serialization = pytest.importorskip('rclpy.serialization')
    trajectory_msgs = pytest.importorskip('trajectory_msgs.msg')
    ours = types.encode(TRAJECTORY.type_name, trajectory())
    theirs = serialization.deserialize_message(ours, trajectory_msgs.JointTrajectory)
    assert theirs.points[2].positions.tolist() == [0.2, 1.0]
    assert types.encode(TRAJECTORY.type_name, theirs) == ours


@of_lark
@pytest.mark.parametrize(
    'name', ['MotionTask', 'PlanReport', 'FlexiblePoint', 'FlexibleTrajectory'])
def test_own_messages_of_rclpy_are_encoded_as_rclpy_reads_them(name: str) -> None:
    serialization = pytest.importorskip('rclpy.serialization')
    interfaces = pytest.importorskip('flex_planner_interfaces.msg')
    if not hasattr(interfaces, name):  # the folder of the sources
        pytest.skip('flex_planner_interfaces is not built')
    message = getattr(interfaces, name)()
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    data = types.encode(f'flex_planner_interfaces/msg/{name}', message)
    assert serialization.deserialize_message(data, type(message)) == message


@of_lark
def test_rclpy_message_survives_the_recording(tmp_path: Path, types: MessageTypes) -> None:
    serialization = pytest.importorskip('rclpy.serialization')
    msg = pytest.importorskip('diagnostic_msgs.msg')
    status = msg.DiagnosticStatus(level=b'\x02', values=[msg.KeyValue(key='a', value='1')])
    message = msg.DiagnosticArray(status=[status, msg.DiagnosticStatus()])
    topic = Topic('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray')
    with Recording.create(tmp_path, 'plan', types) as recording:
        recording.write(topic, message, 0)
    (record,) = mcap_records(recording.path)
    assert serialization.deserialize_message(record[2].data, msg.DiagnosticArray) == message


@of_lark
def test_bytes_of_rclpy_with_spare_ones_at_the_end_are_read(types: MessageTypes) -> None:
    serialization = pytest.importorskip('rclpy.serialization')
    sensor_msgs = pytest.importorskip('sensor_msgs.msg')
    message = sensor_msgs.JointState(name=['a'], position=[1.0])
    data = serialization.serialize_message(message)
    assert len(data) > len(types.encode(STATES.type_name, message))
    assert types.decode(STATES.type_name, data).position.tolist() == [1.0]


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


def test_metadata_file_has_every_key_of_version_9(plan: Path, types: MessageTypes) -> None:
    content = yaml.safe_load((plan / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    topics = content.pop('topics_with_message_count')
    extent = {'duration': {'nanoseconds': 10}, 'message_count': 6,
              'starting_time': {'nanoseconds_since_epoch': START}}
    assert content == {
        'version': 9, 'storage_identifier': 'mcap', **extent, 'compression_format': '',
        'compression_mode': '', 'relative_file_paths': ['plan_0.mcap'],
        'files': [{'path': 'plan_0.mcap', **extent}], 'custom_data': {'version': '0.1'},
        'ros_distro': 'jazzy'}
    assert [topic['message_count'] for topic in topics] == [1, 4, 1]
    assert topics[2]['topic_metadata'] == {
        'name': TREE.name, 'type': TREE.type_name, 'serialization_format': 'cdr',
        'offered_qos_profiles': [DEFAULT.to_dict()],
        'type_description_hash': types.type_hash(TREE.type_name)}


def test_metadata_record_in_the_file_repeats_the_metadata_file(plan: Path) -> None:
    content = yaml.safe_load((plan / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    with (plan / 'plan_0.mcap').open('rb') as stream:
        (record,) = make_reader(stream).iter_metadata()
    assert record.name == 'rosbag2'
    assert yaml.safe_load(record.metadata['serialized_metadata']) == content


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


def test_identical_inputs_give_identical_bytes(tmp_path: Path, interfaces: Path) -> None:
    first = record(tmp_path / 'a', MessageTypes.load([interfaces]))
    time.sleep(0.01)
    second = record(tmp_path / 'b', MessageTypes.load([interfaces]))
    for name in ('plan_0.mcap', 'metadata.yaml'):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    assert sorted(path.name for path in first.iterdir()) == ['metadata.yaml', 'plan_0.mcap']


def test_bytes_do_not_depend_on_the_process(plan: Path, interfaces: Path, tmp_path: Path) -> None:
    code = (f'import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); '
            'import pathlib, test_writer as t; '
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


# All or nothing


def test_nothing_is_visible_before_the_end(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        recording.write(STATES, state(), 0)
        assert [path.name[:6] for path in tmp_path.iterdir()] == ['.plan.']
    assert [path.name for path in tmp_path.iterdir()] == ['plan']


@pytest.mark.parametrize('error', [KeyError, OSError, KeyboardInterrupt])
def test_exception_in_the_block_leaves_nothing(
    tmp_path: Path, types: MessageTypes, error: type[BaseException]
) -> None:
    with pytest.raises(error), Recording.create(tmp_path, 'plan', types) as recording:
        recording.write(STATES, state(), 0)
        raise error
    assert list(tmp_path.iterdir()) == []


def test_folder_is_complete_and_on_the_disk_when_renamed(
    tmp_path: Path, types: MessageTypes, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[str] = []
    fsync = os.fsync

    def note(descriptor: int) -> None:
        synced.append(Path(os.readlink(f'/proc/self/fd/{descriptor}')).name)
        fsync(descriptor)

    def check(stage: Path, target: Path) -> None:
        assert read_metadata(stage).message_count == 6
        assert synced == ['plan_0.mcap', 'metadata.yaml', stage.name]
        os.rename(stage, target)

    monkeypatch.setattr(os, 'fsync', note)
    monkeypatch.setattr(Path, 'rename', check)
    assert record(tmp_path, types).is_dir()
    assert synced[-1] == tmp_path.name


@pytest.mark.parametrize('taken', ['folder', 'empty', 'file', 'link'])
def test_existing_name_is_not_overwritten(
    tmp_path: Path, types: MessageTypes, taken: str
) -> None:
    target = tmp_path / 'plan'
    if taken in ('folder', 'empty'):
        target.mkdir()
    if taken == 'folder':
        (target / 'mine').write_text('precious')
    if taken == 'file':
        target.write_text('precious')
    if taken == 'link':
        target.symlink_to('nowhere')
    before = sorted(tmp_path.rglob('*'))
    with pytest.raises(RecordingError, match='exists and is never overwritten'):
        record(tmp_path, types)
    assert sorted(tmp_path.rglob('*')) == before


@pytest.mark.parametrize('content', [True, False])
def test_name_taken_meanwhile_is_not_overwritten(
    tmp_path: Path, types: MessageTypes, content: bool
) -> None:
    with (
        pytest.raises(RecordingError, match='exists and is never overwritten'),
        Recording.create(tmp_path, 'plan', types),
    ):
        (tmp_path / 'plan').mkdir()
        if content:
            (tmp_path / 'plan' / 'mine').write_text('precious')
    assert [path.name for path in tmp_path.iterdir()] == ['plan']


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """Let the kernel refuse to write more, as on a full disk; root is no exception."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize('size', [0, 100, 4000])
def test_refused_write_is_an_error_and_leaves_nothing(
    tmp_path: Path, types: MessageTypes, size: int
) -> None:
    with pytest.raises(RecordingError, match='cannot write .*: File too large'):
        with file_size_limit(size):
            record(tmp_path, types)
    assert list(tmp_path.iterdir()) == []


def test_failed_write_cannot_be_passed_over(tmp_path: Path, types: MessageTypes) -> None:
    noise = np.random.default_rng(0).normal(size=400_000)
    with pytest.raises(RecordingError, match='a write to it has failed'):
        with Recording.create(tmp_path, 'plan', types) as recording:
            with file_size_limit(1000), pytest.raises(RecordingError, match='too large'):
                recording.write(STATES, Message(**{**vars(state()), 'position': noise}), 0)
    assert list(tmp_path.iterdir()) == []


def test_disk_that_fills_up_at_the_very_end_is_an_error(
    tmp_path: Path, types: MessageTypes, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, 'fsync', full)
    with pytest.raises(RecordingError, match=r'cannot write .*/plan: No space left'):
        record(tmp_path, types)
    assert list(tmp_path.iterdir()) == []


def test_recording_in_a_folder_that_cannot_be_synced_is_kept(
    tmp_path: Path, types: MessageTypes, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture
) -> None:
    fsync = os.fsync

    def refuse(descriptor: int) -> None:
        if os.readlink(f'/proc/self/fd/{descriptor}') == str(tmp_path):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        fsync(descriptor)

    monkeypatch.setattr(os, 'fsync', refuse)
    assert read_metadata(record(tmp_path, types)).message_count == 6
    assert 'is written, but not forced to the disk: ' in caplog.text


def test_unwritable_folder_is_an_error(tmp_path: Path, types: MessageTypes) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(RecordingError, match=r'cannot write .*/file/plan: '):
        record(tmp_path / 'file', types)


def test_recording_is_as_readable_as_any_new_folder(plan: Path, tmp_path: Path) -> None:
    (tmp_path / 'other').mkdir()
    assert plan.stat().st_mode == (tmp_path / 'other').stat().st_mode


# Refusals


@pytest.mark.parametrize('name', ['', '.', '..', '.hidden', 'a/b', '/abs', '-rf', 'a b', 'a\n'])
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


@pytest.mark.parametrize('name', ['relative', '/', '/a//b', '/a b', '/1a', '/a/', '~/a', '/a\n'])
def test_topic_name_that_rosbag2_refuses_is_refused(name: str) -> None:
    with pytest.raises(InvalidValueError, match='topic name'):
        Topic(name, STATES.type_name)


@pytest.mark.parametrize('name', ['JointState', 'sensor_msgs/JointState', 'a/msg/b', 'A/msg/B'])
def test_type_name_is_that_of_a_message(name: str) -> None:
    with pytest.raises(InvalidValueError, match='message type'):
        Topic('/a', name)


def test_depth_and_custom_data_are_checked(tmp_path: Path, types: MessageTypes) -> None:
    with pytest.raises(InvalidValueError, match='depth is 0, but must be at least 1'):
        QosProfile(depth=0)
    wrong: Any
    for wrong in ({'payload': 3.0}, {3: 'payload'}, {'payload': '\ud800'}):
        with pytest.raises(InvalidValueError, match=r'custom_data\[.* with a string as its key'):
            Recording.create(tmp_path, 'plan', types, custom_data=wrong).__enter__()
    assert list(tmp_path.iterdir()) == []


# Reading what others wrote, and what is damaged


@pytest.mark.parametrize(('text', 'expected'), [
    ('', DEFAULT),
    ('[]', DEFAULT),
    ('nonsense', DEFAULT),
    (LATCHED.to_yaml(), LATCHED),
    ('- {reliability: best_effort, durability: unknown, depth: 0}',
     QosProfile(reliability=Reliability.BEST_EFFORT)),
    ('- {reliability: 2, durability: 1, depth: 3}',  # metadata version 8
     QosProfile(reliability=Reliability.BEST_EFFORT, durability=Durability.TRANSIENT_LOCAL,
                depth=3)),
])
def test_quality_of_service_is_read_as_far_as_a_bag_knows_it(
    text: str, expected: QosProfile
) -> None:
    assert QosProfile.from_yaml(text) == expected


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


def test_file_of_another_kind_is_refused(tmp_path: Path, types: MessageTypes) -> None:
    with (tmp_path / 'a.mcap').open('wb') as stream:
        writer = McapWriter(stream, use_statistics=False)
        writer.start()
        channel = writer.register_channel('/a', 'json', 0)
        writer.add_message(channel, 0, b'{}', 0)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(RecordingError, match='/a holds no ROS 2 messages'):
        list(read_recording(tmp_path, types))
    with pytest.raises(RecordingError, match='has no summary'):
        read_metadata(tmp_path)
    (tmp_path / 'a.mcap').write_text('no recording')
    with pytest.raises(RecordingError, match='is damaged or not an MCAP file'):
        read_metadata(tmp_path)


def test_topics_can_be_selected(plan: Path, types: MessageTypes) -> None:
    assert [m.topic for m in read_recording(plan, types, [TREE.name])] == [TREE]
    assert list(read_recording(plan, types, [])) == []


def test_type_recorded_with_another_definition_is_refused(
    plan: Path, tmp_path: Path, interfaces: Path
) -> None:
    other = tmp_path / 'tiny_interfaces'
    (other / 'msg').mkdir(parents=True)
    (other / 'msg' / 'Leaf.msg').write_text('uint8 colour\nfloat32 length\n')
    (other / 'msg' / 'Tree.msg').write_text(TREE_TEXT)
    with pytest.raises(RecordingError, match='holds tiny_interfaces/msg/Tree with the type hash'):
        list(read_recording(plan, MessageTypes.load([other])))
    with pytest.raises(RecordingError, match='unknown message type tiny_interfaces/msg/Tree'):
        list(read_recording(plan, MessageTypes.load()))


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
