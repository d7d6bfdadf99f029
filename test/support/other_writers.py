"""Recordings as others write them: the mcap library with any options, foreign channels."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

# what a writer may leave out; each alone, and all together
PLAIN: dict[str, Any] = {
    'index_types': IndexType.NONE, 'repeat_channels': False, 'repeat_schemas': False,
    'use_statistics': False, 'use_summary_offsets': False, 'enable_crcs': False}
OPTIONS: dict[str, dict[str, Any]] = {
    'all': {},
    **{name: {name: value} for name, value in PLAIN.items()},
    'no_summary': {**PLAIN, 'enable_crcs': True},
    'nothing': PLAIN,
    'unchunked': {'use_chunking': False},
    'unchunked_nothing': {**PLAIN, 'use_chunking': False},
    'lz4': {'compression': CompressionType.LZ4, 'chunk_size': 1000},
    'zstd': {'compression': CompressionType.ZSTD, 'chunk_size': 1000},
    'uncompressed': {'compression': CompressionType.NONE, 'enable_data_crcs': True},
}
Change = Callable[[Any], Any]


def records(file: Path) -> list[Any]:
    with file.open('rb') as stream:
        found = list(StreamReader(stream).records)
    seen: set[tuple[type, int]] = set()
    kept = []
    for record in found:  # the summary repeats schemas and channels
        key = (type(record), getattr(record, 'id', id(record)))
        if key not in seen:
            kept.append(record)
        seen.add(key)
    return kept


def rewrite(source: Path, target: Path, options: dict[str, Any] | None = None,
            change: Change = lambda record: record, backwards: bool = False) -> Path:
    """Write the file of a recording again, in another way, with records changed."""
    found = [record for record in map(change, records(next(source.glob('*.mcap')))) if record]
    messages = [record for record in found if isinstance(record, Message)]
    with target.open('wb') as stream:
        writer = Writer(stream, **(options or {}))
        writer.start()
        schemas = {0: 0}
        channels: dict[int, int] = {}
        for record in found:
            if isinstance(record, Schema):
                schemas[record.id] = writer.register_schema(
                    record.name, record.encoding, record.data)
            elif isinstance(record, Channel):
                channels[record.id] = writer.register_channel(
                    record.topic, record.message_encoding, schemas[record.schema_id],
                    record.metadata)
            elif isinstance(record, Attachment):
                writer.add_attachment(record.create_time, record.log_time, record.name,
                                      record.media_type, record.data)
        for record in reversed(messages) if backwards else messages:
            writer.add_message(channels[record.channel_id], record.log_time, record.data,
                               record.publish_time)
        add_foreign(writer, messages[0].log_time if messages else 0)
        writer.finish()  # type: ignore[no-untyped-call]
    return target


FOREIGN = ('/json', '/protobuf', 'no name of ROS', '/untyped', '/unknown', '/service',
           '/flex_planner/plan_path/_action/feedback', '/compressed')
# those of ROS 2, whose bytes can be played and copied without a definition
COPIED = ('/unknown', '/service', '/flex_planner/plan_path/_action/feedback')


def add_foreign(writer: Writer, time: int) -> None:
    """Add a message on a channel of each kind that is not ours."""
    def add(topic: str, encoding: str, schema: int, data: bytes,
            metadata: dict[str, str] | None = None) -> None:
        channel = writer.register_channel(topic, encoding, schema, metadata or {})
        writer.add_message(channel, time, data, time)

    cdr = bytes([0, 1, 0, 0])
    add('/json', 'json', writer.register_schema('Thing', 'jsonschema', b'{}'), b'{}')
    add('/protobuf', 'protobuf', writer.register_schema('a.Thing', 'protobuf', b'\xff'), b'\x08')
    string = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data\n')
    add('no name of ROS', 'cdr', string, cdr + b'\x01\0\0\0\0')
    add('/untyped', 'cdr', 0, cdr)
    add('/unknown', 'cdr', writer.register_schema('a_msgs/msg/Thing', 'ros2msg', b'$?'), cdr,
        {'offered_qos_profiles': '[: no YAML', 'topic_type_hash': 'RIHS01_00'})
    add('/service', 'cdr', writer.register_schema(
        'example_interfaces/srv/AddTwoInts_Event', 'ros2msg', b''), cdr)
    add('/flex_planner/plan_path/_action/feedback', 'cdr', writer.register_schema(
        'flex_planner_interfaces/action/PlanPath_FeedbackMessage', 'ros2msg', b''), cdr)
    add('/compressed', 'cdr', string, b'\x28\xb5\x2f\xfd')


def with_schema(type_name: str, text: str, hashed: bool) -> Change:
    """Return a change of the schema of a type, with the hash of the true one or without any."""
    numbers: list[int] = []

    def change(record: Any) -> Any:
        if isinstance(record, Schema) and record.name == type_name:
            numbers.append(record.id)
            return replace(record, data=text.encode())
        if isinstance(record, Channel) and record.schema_id in numbers and not hashed:
            kept: Iterable[tuple[str, str]] = record.metadata.items()
            return replace(record, metadata={
                key: value for key, value in kept if key != 'topic_type_hash'})
        return record

    return change


def messages_of(file: Path) -> list[tuple[str, int, bytes]]:
    """Return topic, time and bytes of each message by the reader of the mcap library."""
    with file.open('rb') as stream:
        return [(channel.topic, message.log_time, message.data)
                for _, channel, message in make_reader(stream).iter_messages()]
