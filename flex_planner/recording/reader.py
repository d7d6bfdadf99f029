"""
Read a recording: ours, or an MCAP bag that ``ros2 bag record`` wrote into one file.

All checksums that a file has are verified before anything of it is used: a plan moves an arm.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
import struct
from typing import Any, BinaryIO, Final, NamedTuple
import zlib

from flex_planner.errors import RecordingError
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.metadata import RecordingMetadata, TopicSummary
from flex_planner.recording.topics import QosProfile, Topic
from mcap.exceptions import McapError
from mcap.reader import make_reader, McapReader
from mcap.records import Channel, Footer, Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
import yaml
from zstandard import ZstdError

# What the libraries raise at damaged content; the last two at a length of terabytes and more.
DAMAGE: Final = (
    McapError, ZstdError, struct.error, yaml.YAMLError,
    KeyError, ValueError, RuntimeError, MemoryError, OverflowError,
)
CHECKSUM_AND_MAGIC: Final = 4 + 8  # bytes at the end that the summary's checksum leaves out


class RecordedMessage(NamedTuple):
    """A message of a recording with its topic and log time [ns]."""

    topic: Topic
    log_time_ns: int
    message: Any


def read_recording(
    path: Path | str, types: MessageTypes, topics: Collection[str] | None = None
) -> Iterator[RecordedMessage]:
    """
    Yield the messages of a recording in the order of their log times.

    Parameters
    ----------
    path : path
        Folder of the recording or its .mcap file.
    types : MessageTypes
        Definitions of the messages.
    topics : collection of str, optional
        Names of the topics wanted; default all.

    Raises
    ------
    RecordingError
        If the file is missing or damaged, or holds a wanted message whose type is unknown or was
        recorded with another definition.

    """
    with _open(path) as (file, reader):
        channels: dict[int, Topic] = {}
        for schema, channel, record in reader.iter_messages(topics):
            if channel.id not in channels:
                channels[channel.id] = _topic(schema, channel)
                _check_definition(file, channels[channel.id], channel, types)
            topic = channels[channel.id]
            message = types.decode(topic.type_name, record.data)
            yield RecordedMessage(topic, record.log_time, message)


def read_attachments(path: Path | str) -> dict[str, bytes]:
    """Return the attachments of a recording by name; RecordingError if it cannot be read."""
    with _open(path) as (_, reader):
        return {attachment.name: attachment.data for attachment in reader.iter_attachments()}


def read_metadata(path: Path | str) -> RecordingMetadata:
    """Return the summary of a recording; RecordingError if it cannot be read."""
    with _open(path) as (file, reader):
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            raise RecordingError(f'{file} has no summary: its writer did not finish')
        return RecordingMetadata(
            file_name=file.name,
            start_ns=summary.statistics.message_start_time,
            end_ns=summary.statistics.message_end_time,
            topics=tuple(_summarize(summary, number) for number in sorted(summary.channels)),
            custom_data=_custom_data(reader),
        )


@contextmanager
def _open(path: Path | str) -> Iterator[tuple[Path, McapReader]]:
    """Open the file of a recording and turn what damaged content raises into RecordingError."""
    file = Path(path)
    try:
        file = _locate(file)
        with file.open('rb') as stream:
            _verify(stream)
            stream.seek(0)
            yield file, make_reader(stream, validate_crcs=True)
    except OSError as error:
        raise RecordingError(f'cannot read {file}: {error.strerror or error}') from error
    except DAMAGE as error:
        raise RecordingError(f'{file} is damaged or no MCAP file: {error}') from error


def _verify(stream: BinaryIO) -> None:
    """Raise unless the checksums of data and summary are right; mcap ignores the latter."""
    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True)
    (footer,) = deque(reader.records, maxlen=1)
    if isinstance(footer, Footer) and footer.summary_crc:
        stream.seek(footer.summary_start)
        if zlib.crc32(stream.read()[:-CHECKSUM_AND_MAGIC]) != footer.summary_crc:
            raise McapError('the checksum of the summary is wrong')


def _locate(path: Path) -> Path:
    """Return the .mcap file of a recording."""
    if not path.is_dir():
        return path
    files = sorted(path.glob('*.mcap'))
    if len(files) != 1:
        raise RecordingError(f'{path} holds {len(files)} .mcap files, but must hold one')
    return files[0]


def _topic(schema: Schema | None, channel: Channel) -> Topic:
    """Return the topic of a channel."""
    if schema is None or channel.message_encoding != 'cdr':
        raise RecordingError(f'{channel.topic} holds no ROS 2 messages')
    qos = QosProfile.from_yaml(channel.metadata.get('offered_qos_profiles', ''))
    return Topic(channel.topic, schema.name, qos)


def _check_definition(file: Path, topic: Topic, channel: Channel, types: MessageTypes) -> None:
    """Raise unless the type is known by the definition it was recorded with."""
    recorded = channel.metadata.get('topic_type_hash')
    known = types.type_hash(topic.type_name)
    if recorded and recorded != known:
        raise RecordingError(
            f'{file} holds {topic.type_name} with the type hash {recorded}, '
            f'but its definition here has {known}'
        )


def _summarize(summary: Summary, number: int) -> TopicSummary:
    """Return topic, hash and count of a channel."""
    channel = summary.channels[number]
    counts = {} if summary.statistics is None else summary.statistics.channel_message_counts
    return TopicSummary(
        topic=_topic(summary.schemas.get(channel.schema_id), channel),
        type_hash=channel.metadata.get('topic_type_hash', ''),
        message_count=counts.get(number, 0),
    )


def _custom_data(reader: McapReader) -> dict[str, str]:
    """Return the custom data from rosbag2's metadata record."""
    for record in reader.iter_metadata():
        if record.name == 'rosbag2':
            content = yaml.safe_load(record.metadata.get('serialized_metadata', ''))
            return dict((content or {}).get('custom_data') or {})
    return {}
