"""
Read a recording: ours, or an MCAP bag of ``ros2 bag record``, in one file or in several.

All checksums that a file has are verified before anything of it is used: a plan moves an arm.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
import re
import struct
from typing import Any, BinaryIO, Final, NamedTuple
import zlib

from flex_planner.base.errors import RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.metadata import FileSummary, RecordingMetadata, TopicSummary
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
PART: Final = re.compile(r'(.+)_(\d+)\.mcap')
CHECKSUM_AND_MAGIC: Final = 4 + 8  # bytes at the end that the summary's checksum leaves out


class RecordedMessage(NamedTuple):
    """A message of a recording with its topic and log time [ns]."""

    topic: Topic
    log_time_ns: int
    message: Any


class SerializedMessage(NamedTuple):
    """The bytes of a message with its topic, the hash of its type if known, and log time [ns]."""

    topic: Topic
    type_hash: str
    log_time_ns: int
    data: bytes


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
    checked: set[Topic] = set()
    for topic, type_hash, log_time, data in read_serialized(path, topics):
        if topic not in checked:
            check_definition(path, topic, type_hash, types)
            checked.add(topic)
        yield RecordedMessage(topic, log_time, types.decode(topic.type_name, data))


def read_serialized(
    path: Path | str, topics: Collection[str] | None = None
) -> Iterator[SerializedMessage]:
    """
    Yield the messages of a recording as they lie in it, see `read_recording`.

    Raises
    ------
    RecordingError
        If the file is missing or damaged, or holds something else than messages of ROS 2.

    """
    for file in _verify_files(path):
        with _open(file) as reader:
            channels: dict[int, Topic] = {}
            for schema, channel, record in reader.iter_messages(topics):
                if channel.id not in channels:
                    channels[channel.id] = topic_of(schema, channel)
                yield SerializedMessage(channels[channel.id],
                                        channel.metadata.get('topic_type_hash', ''),
                                        record.log_time, record.data)


def read_attachments(path: Path | str) -> dict[str, bytes]:
    """Return the attachments of a recording by name; RecordingError if it cannot be read."""
    found: dict[str, bytes] = {}
    for file in _verify_files(path):
        with _open(file) as reader:
            found.update((entry.name, entry.data) for entry in reader.iter_attachments())
    return found


def read_metadata(path: Path | str) -> RecordingMetadata:
    """Return the summary of a recording; RecordingError if it cannot be read."""
    return RecordingMetadata.join(_file_metadata(file) for file in _verify_files(path))


def _file_metadata(file: Path) -> RecordingMetadata:
    """Return the summary of one file."""
    with _open(file) as reader:
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            raise RecordingError(f'{file} has no summary: its writer did not finish; '
                                 'try flex-planner recover')
        extent = FileSummary(
            name=file.name, start_ns=summary.statistics.message_start_time,
            end_ns=summary.statistics.message_end_time,
            message_count=summary.statistics.message_count)
        return RecordingMetadata(
            files=(extent,), custom_data=_custom_data(reader),
            topics=tuple(_summarize(summary, number) for number in sorted(summary.channels)))


def _verify_files(path: Path | str) -> list[Path]:
    """Return the files of a recording, all of them there and whole."""
    files = recording_files(path)
    for file in files:
        with _reading(file), file.open('rb') as stream:
            _verify(stream)
    missing = _listed_files(expand_path(path) / 'metadata.yaml') - {file.name for file in files}
    if missing:
        raise RecordingError(f'{path} lacks {", ".join(sorted(missing))}, which its '
                             'metadata.yaml lists')
    return files


@contextmanager
def _open(file: Path) -> Iterator[McapReader]:
    """Open a file of a recording."""
    with _reading(file), file.open('rb') as stream:
        yield make_reader(stream, validate_crcs=True)


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn what a file raises that is missing or damaged into RecordingError."""
    try:
        yield
    except OSError as error:
        raise RecordingError(f'cannot read {path}: {error.strerror or error}') from error
    except DAMAGE as error:
        raise RecordingError(f'{path} is damaged or not an MCAP file: {error}') from error


def _verify(stream: BinaryIO) -> None:
    """Raise unless the checksums of data and summary are right; mcap ignores the latter."""
    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True)
    (footer,) = deque(reader.records, maxlen=1)
    if isinstance(footer, Footer) and footer.summary_crc:
        stream.seek(footer.summary_start)
        if zlib.crc32(stream.read()[:-CHECKSUM_AND_MAGIC]) != footer.summary_crc:
            raise McapError('the checksum of the summary is wrong')


def recording_files(path: Path | str) -> list[Path]:
    """
    Return the .mcap files of a recording in their order.

    Raises
    ------
    RecordingError
        If a folder has none, or some that are not the parts of one recording.

    """
    path = expand_path(path)
    if not path.is_dir():
        return [path]
    files = {file.name: file for file in path.glob('*.mcap')}
    parts = {name: PART.fullmatch(name) for name in files}
    order = sorted(files, key=lambda name: int(part[2]) if (part := parts[name]) else -1)
    expected = [f'{part[1]}_{i}.mcap' for i in range(len(order)) if (part := parts[order[0]])]
    if not files or (len(files) > 1 and order != expected):
        raise RecordingError(f'{path} holds {len(files)} .mcap files, but must hold one, or the '
                             'parts <name>_0.mcap, <name>_1.mcap and so on')
    return [files[name] for name in order]


def _listed_files(file: Path) -> set[str]:
    """Return the names of the files that a metadata.yaml lists, none without one."""
    if not file.exists():
        return set()
    with _reading(file):
        content = yaml.safe_load(file.read_text(encoding='utf-8'))
    known = content.get('rosbag2_bagfile_information') if isinstance(content, dict) else None
    return set((known or {}).get('relative_file_paths') or ())


def topic_of(schema: Schema | None, channel: Channel) -> Topic:
    """Return the topic of a channel."""
    if schema is None or channel.message_encoding != 'cdr':
        raise RecordingError(f'{channel.topic} holds no ROS 2 messages')
    qos = QosProfile.from_yaml(channel.metadata.get('offered_qos_profiles', ''))
    return Topic(channel.topic, schema.name, qos)


def check_definition(
    path: Path | str, topic: Topic, type_hash: str, types: MessageTypes
) -> None:
    """Raise RecordingError unless a type is known by the definition it was recorded with."""
    known = types.type_hash(topic.type_name)
    if type_hash and type_hash != known:
        raise RecordingError(
            f'{path} holds {topic.type_name} with the type hash {type_hash}, '
            f'but its definition here has {known}'
        )


def _summarize(summary: Summary, number: int) -> TopicSummary:
    """Return topic, hash and count of a channel."""
    channel = summary.channels[number]
    counts = {} if summary.statistics is None else summary.statistics.channel_message_counts
    return TopicSummary(
        topic=topic_of(summary.schemas.get(channel.schema_id), channel),
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
