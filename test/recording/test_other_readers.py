"""What other readers make of our recordings."""

from __future__ import annotations

from pathlib import Path

from flex_planner.recording import MessageTypes, Recording, Topic
import pytest
from recording_support import mcap_records, of_lark, START, STATES, TRAJECTORY, TREE
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.typesys import get_typestore, Stores


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
