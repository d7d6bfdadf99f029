"""
Write a recording: an MCAP file and its metadata.yaml, as rosbag2 stores a bag.

Every channel carries CDR with a ros2msg schema: a single channel of another kind would make
``ros2 bag play`` refuse the file. Everything that is not a message is an attachment.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from operator import index
from pathlib import Path
import re
from typing import BinaryIO, Final

from flex_planner import __version__
from flex_planner.errors import InvalidValueError, RecordingError
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.metadata import checked_custom_data, RecordingMetadata, TopicSummary
from flex_planner.recording.staging import os_errors, output_file, staged_folder
from flex_planner.recording.topics import Topic
from mcap.writer import CompressionType, LIBRARY_IDENTIFIER, Writer

NAME: Final = re.compile(r'[A-Za-z0-9_][A-Za-z0-9_.-]*')  # cannot lead elsewhere or hide
LARGEST_TIME: Final = 2**63 - 1  # [ns], rosbag2 counts with a signed 64-bit integer


class _Channel:
    """A topic with its number in the file and the messages so far."""

    def __init__(self, topic: Topic, number: int, type_hash: str) -> None:
        self.topic = topic
        self.number = number
        self.type_hash = type_hash
        self.count = 0

    def summary(self) -> TopicSummary:
        """Return what the metadata say of the topic."""
        return TopicSummary(topic=self.topic, type_hash=self.type_hash, message_count=self.count)


class Recording:
    """
    A recording that is being written; made by `Recording.create`, for one thread.

    Parameters
    ----------
    stream : binary file
        Where the MCAP bytes go.
    path : Path
        Folder that the recording will be.
    types : MessageTypes
        Definitions of the messages.
    custom_data : mapping of str to str
        Free text for the metadata.

    """

    def __init__(
        self, stream: BinaryIO, path: Path, types: MessageTypes, custom_data: Mapping[str, str]
    ) -> None:
        self.path = path
        self._types = types
        self._custom_data = custom_data
        self._channels: dict[str, _Channel] = {}
        self._schemas: dict[str, int] = {}
        self._attachments: set[str] = set()
        self._times: tuple[int, int] | None = None
        self._writable = True
        self._writer = Writer(stream, compression=CompressionType.ZSTD, enable_data_crcs=True)
        with self._writing():
            self._writer.start('ros2', f'flex_planner/{__version__} {LIBRARY_IDENTIFIER}')

    @classmethod
    @contextmanager
    def create(
        cls,
        folder: Path | str,
        name: str,
        types: MessageTypes,
        *,
        custom_data: Mapping[str, str] | None = None,
    ) -> Iterator[Recording]:
        """
        Write the recording ``folder/name`` in a with block, whole or not at all.

        The folder appears when the block ends; an exception in the block leaves nothing behind.

        Parameters
        ----------
        folder : path
            Folder of recordings; made if missing.
        name : str
            Name of the recording: letters, digits, ``_``, ``-`` and ``.``.
        types : MessageTypes
            Definitions of the messages.
        custom_data : mapping of str to str, optional
            Free text for the metadata, e.g. the planner's version.

        Raises
        ------
        InvalidValueError
            If the name or the custom data are malformed.
        RecordingError
            If the name is taken (a recording is never overwritten), or the system refuses to
            write.

        """
        if not NAME.fullmatch(name):
            raise InvalidValueError('name', name, 'letters, digits, _ and, not in front, - and .')
        path = Path(folder) / name
        custom_data = checked_custom_data(custom_data or {})
        with staged_folder(path) as stage:
            with output_file(stage / f'{name}_0.mcap', path) as stream:
                recording = cls(stream, path, types, custom_data)
                yield recording
                metadata = recording._finish()
            with output_file(stage / 'metadata.yaml', path) as stream, os_errors(path):
                stream.write(metadata.to_file().encode())

    def write(self, topic: Topic, message: object, log_time_ns: int) -> None:
        """
        Add a message.

        Parameters
        ----------
        topic : Topic
            Topic, type and quality of service; the same object every time.
        message : object
            An rclpy message, a rosbags message, or anything with the same attributes.
        log_time_ns : int
            When the message was sent and received [ns]; not before the message written last.

        Raises
        ------
        InvalidValueError
            If the message does not fit the type, the time runs backwards, or the topic was
            written with another type or quality of service. Nothing is written then.
        RecordingError
            If the type is unknown or the system refuses to write.

        """
        time = self._checked_time(log_time_ns)
        known = self._channels.get(topic.name)
        if known is not None and known.topic != topic:
            raise InvalidValueError('topic', topic, f'the same as before, {known.topic}')
        data = self._types.encode(topic.type_name, message)
        with self._writing():
            channel = known or self._add_channel(topic)
            self._writer.add_message(channel.number, time, data, publish_time=time)
        channel.count += 1
        self._times = (time if self._times is None else self._times[0], time)

    def attach(self, name: str, data: bytes, *, media_type: str, time_ns: int = 0) -> None:
        """
        Add a file, e.g. the arm and the task; rosbag2 ignores it and Foxglove lists it.

        Parameters
        ----------
        name : str
            Name of the file, once in a recording.
        data : bytes
            Content.
        media_type : str
            For example ``'application/yaml'``.
        time_ns : int
            When the file was made [ns]; 0 if unknown.

        Raises
        ------
        InvalidValueError
            If the name is empty, not printable or taken, or the time is negative.
        RecordingError
            If the system refuses to write.

        """
        if not name or not name.isprintable() or name in self._attachments:
            raise InvalidValueError('name of an attachment', name, 'printable and not taken')
        time = _integer_time('time_ns', time_ns)
        with self._writing():
            self._writer.add_attachment(time, time, name, media_type, data)
        self._attachments.add(name)

    def _add_channel(self, topic: Topic) -> _Channel:
        """Add a topic to the file, with the schema of its type."""
        schema = self._schemas.get(topic.type_name)
        if schema is None:
            text = self._types.schema(topic.type_name)
            schema = self._writer.register_schema(topic.type_name, 'ros2msg', text.encode())
            self._schemas[topic.type_name] = schema
        type_hash = self._types.type_hash(topic.type_name)
        metadata = {'offered_qos_profiles': topic.qos.to_yaml(), 'topic_type_hash': type_hash}
        number = self._writer.register_channel(topic.name, 'cdr', schema, metadata)
        self._channels[topic.name] = _Channel(topic, number, type_hash)
        return self._channels[topic.name]

    def _checked_time(self, log_time_ns: int) -> int:
        """Return a log time that does not run backwards."""
        time = _integer_time('log_time_ns', log_time_ns)
        if self._times is not None and time < self._times[1]:
            raise InvalidValueError('log_time_ns', time, f'>= {self._times[1]}, the last one')
        return time

    def _finish(self) -> RecordingMetadata:
        """Write the metadata and the index, and return the metadata."""
        start, end = self._times or (0, 0)
        metadata = RecordingMetadata(
            file_name=f'{self.path.name}_0.mcap',
            start_ns=start,
            end_ns=end,
            topics=tuple(channel.summary() for channel in self._channels.values()),
            custom_data=self._custom_data,
        )
        with self._writing():
            self._writer.add_metadata('rosbag2', {'serialized_metadata': metadata.to_record()})
            self._writer.finish()  # type: ignore[no-untyped-call]
        self._writable = False
        return metadata

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Let nothing follow a write that failed, even if the caller goes on."""
        if not self._writable:
            raise RecordingError(f'{self.path} is closed or a write to it has failed')
        self._writable = False
        with os_errors(self.path):
            yield
        self._writable = True


def _integer_time(field: str, value: int) -> int:
    """Return a time that rosbag2 can hold [ns]."""
    try:
        time = index(value)
    except TypeError:
        raise InvalidValueError(field, value, 'an integer [ns]') from None
    if not 0 <= time <= LARGEST_TIME:
        raise InvalidValueError(field, time, f'in [0, {LARGEST_TIME}] ns')
    return time
