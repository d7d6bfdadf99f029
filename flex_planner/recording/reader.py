"""
Read a recording: ours, or an MCAP bag of ``ros2 bag record`` and others, of one file or several.

All checksums that a file has are verified before anything of it is used: a plan moves an arm.
What is no message of ROS 2, or of an unknown type, is left out, which is logged.

"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
import heapq
import logging
from pathlib import Path
from typing import Any, NamedTuple

from flex_planner.base.errors import RecordingError
from flex_planner.recording.channels import RecordedChannel
from flex_planner.recording.decoding import Decoder
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.folders import recording_files
from flex_planner.recording.mcap_records import (
    FileContents,
    open_file,
    read_blocks,
    read_messages,
    scan_file,
)
from flex_planner.recording.metadata import (
    FileSummary,
    ForeignChannel,
    RecordingMetadata,
    TopicSummary,
)
from flex_planner.recording.topics import Definition, Topic
from mcap.records import Attachment

LOG = logging.getLogger(__name__)


class RecordedMessage(NamedTuple):
    """A message of a recording with its topic and log time [ns]."""

    topic: Topic
    log_time_ns: int
    message: Any


class SerializedMessage(NamedTuple):
    """The bytes of a message with its topic, the definition of its type, and log time [ns]."""

    topic: Topic
    definition: Definition
    log_time_ns: int
    data: bytes


def read_recording(
    path: Path | str, types: MessageTypes, topics: Collection[str] | None = None,
    left_out: Callable[[ForeignChannel], None] | None = None,
) -> Iterator[RecordedMessage]:
    """
    Yield the messages of a recording in the order of their log times.

    A type that was recorded with another definition than the one in `types` is read by the
    definition that the recording carries.

    Parameters
    ----------
    path : path
        Folder of the recording or its .mcap file.
    types : MessageTypes
        Definitions of the messages.
    topics : collection of str, optional
        Names of the topics wanted; default all.
    left_out : callable, optional
        Called at the end with each topic of which messages could not be read, and why; default:
        that is logged.

    Raises
    ------
    RecordingError
        If the file is missing or damaged.

    """
    decoder, unread = Decoder(types), UnreadMessages()
    for topic, definition, log_time, data in read_serialized(path, topics, unread.add):
        try:
            message = decoder.decode(definition, data)
        except RecordingError as error:
            unread.add(ForeignChannel(name=topic.name, reason=str(error), message_count=1))
        else:
            yield RecordedMessage(topic, log_time, message)
    for channel in unread.channels():
        (left_out or _log)(channel)


def read_serialized(
    path: Path | str, topics: Collection[str] | None = None,
    left_out: Callable[[ForeignChannel], None] | None = None,
) -> Iterator[SerializedMessage]:
    """
    Yield the messages of a recording as they lie in it, see `read_recording`.

    Raises
    ------
    RecordingError
        If the file is missing or damaged.

    """
    scanned = _scan(path)
    wanted = None if topics is None else set(topics)
    for channel in RecordingMetadata.join(_summarize(*entry) for entry in scanned).foreign:
        if wanted is None or channel.name in wanted:
            (left_out or _log)(channel)
    parts = [_read_file(file, contents, wanted) for file, contents in scanned]
    if _one_after_another([contents for _, contents in scanned]):
        for part in parts:
            yield from part
    else:
        yield from heapq.merge(*parts, key=lambda message: message.log_time_ns)


def read_attachments(path: Path | str) -> dict[str, bytes]:
    """Return the attachments of a recording by name; RecordingError if it cannot be read."""
    found: dict[str, bytes] = {}
    for file, _ in _scan(path):
        with open_file(file) as stream:
            found.update((record.name, record.data) for block in read_blocks(stream)
                         for record in block if isinstance(record, Attachment))
    return found


def read_metadata(path: Path | str) -> RecordingMetadata:
    """Return the summary of a recording; RecordingError if it cannot be read."""
    return RecordingMetadata.join(_summarize(*entry) for entry in _scan(path))


class UnreadMessages:
    """Counts the messages of each topic that could not be read, by the reason."""

    def __init__(self) -> None:
        self._counts: dict[tuple[str, str], int] = {}

    def add(self, channel: ForeignChannel) -> None:
        """Count messages of a channel."""
        key = channel.name, channel.reason
        self._counts[key] = self._counts.get(key, 0) + channel.message_count

    def channels(self) -> list[ForeignChannel]:
        """Return each topic, reason and number of messages."""
        return [ForeignChannel(name=name, reason=reason, message_count=count)
                for (name, reason), count in self._counts.items()]


def _scan(path: Path | str) -> list[tuple[Path, FileContents]]:
    """Return the files of a recording, all of them there and whole, and what they hold."""
    return [(file, scan_file(file)) for file in recording_files(path)]


def _read_file(file: Path, contents: FileContents,
               topics: Collection[str] | None) -> Iterator[SerializedMessage]:
    """Yield the messages of ROS 2 in a file."""
    for record in read_messages(file, contents):
        channel = contents.table.find(record.channel_id)
        if channel.topic and (topics is None or channel.topic.name in topics):
            yield SerializedMessage(channel.topic, channel.definition, record.log_time,
                                    record.data)


def _one_after_another(files: list[FileContents]) -> bool:
    """Return whether no message of a file is earlier than one of the file before."""
    filled = [contents for contents in files if contents.counts]
    return all(before.end_ns <= after.start_ns
               for before, after in zip(filled, filled[1:], strict=False))


def _summarize(file: Path, contents: FileContents) -> RecordingMetadata:
    """Return the summary of a file."""
    extent = FileSummary(name=file.name, start_ns=contents.start_ns, end_ns=contents.end_ns,
                         message_count=contents.counts.total())
    found: dict[int, RecordedChannel] = {
        number: contents.table.find(number)
        for number in sorted({*contents.table.channels, *contents.counts})}
    return RecordingMetadata(
        files=(extent,), custom_data=contents.custom_data,
        topics=tuple(
            TopicSummary(topic=channel.topic, definition=channel.definition,
                         message_count=contents.counts[number])
            for number, channel in found.items() if channel.topic),
        foreign=tuple(
            ForeignChannel(name=channel.name, reason=channel.reason,
                           message_count=contents.counts[number])
            for number, channel in found.items() if not channel.topic))


def _log(channel: ForeignChannel) -> None:
    LOG.warning('left out: %s', channel)
