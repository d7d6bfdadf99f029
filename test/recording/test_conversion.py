"""Messages to bytes and back: as they were, as other decoders read them, or refused by name."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace as Message

from flex_planner.base.errors import InvalidValueError, RecordingError
from flex_planner.recording import definition_folder, MessageTypes, read_recording
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from recording_support import (
    leaf,
    leaves,
    of_lark,
    START,
    state,
    STATES,
    TRAJECTORY,
    trajectory,
    TREE,
    tree,
)


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


# Other decoders


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
def test_bytes_of_rclpy_with_spare_ones_at_the_end_are_read(types: MessageTypes) -> None:
    serialization = pytest.importorskip('rclpy.serialization')
    sensor_msgs = pytest.importorskip('sensor_msgs.msg')
    message = sensor_msgs.JointState(name=['a'], position=[1.0])
    data = serialization.serialize_message(message)
    assert len(data) > len(types.encode(STATES.type_name, message))
    assert types.decode(STATES.type_name, data).position.tolist() == [1.0]
