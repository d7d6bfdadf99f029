"""Write a recording: MCAP files and their metadata.yaml, as rosbag2 stores a bag."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, ExitStack
from operator import index
from pathlib import Path
from typing import Final

from flex_planner.base.errors import InvalidValueError, RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.mcap_file import RecordingFile
from flex_planner.recording.metadata import check_custom_data, RecordingMetadata
from flex_planner.recording.staging import os_errors, output_file, staged_folder
from flex_planner.recording.topics import Definition, Topic

LARGEST_TIME: Final = 2**63 - 1  # [ns], rosbag2 counts with a signed 64-bit integer


class Recording:
    """
    A recording that is being written; made by `Recording.create`, for one thread.

    Parameters
    ----------
    stage : Path
        Folder where its files are written.
    path : Path
        Folder that the recording will be.
    types : MessageTypes
        Definitions of the messages.
    custom_data : mapping of str to str
        Free text for the metadata.
    max_bytes : int or None
        Size at which the next file begins.

    """

    def __init__(
        self, stage: Path, path: Path, types: MessageTypes, custom_data: Mapping[str, str],
        max_bytes: int | None
    ) -> None:
        self.path = path
        self._stage = stage
        self._types = types
        self._custom_data = custom_data
        self._max_bytes = max_bytes
        self._topics: dict[str, tuple[Topic, Definition]] = {}
        self._attachments: set[str] = set()
        self._last: int | None = None
        self._parts: list[RecordingMetadata] = []
        self._open_file = ExitStack()
        self._file = self._begin_file()
        self._writable = True

    @classmethod
    @contextmanager
    def create(
        cls,
        folder: Path | str,
        name: str,
        types: MessageTypes,
        *,
        custom_data: Mapping[str, str] | None = None,
        max_bytes: int | None = None,
    ) -> Iterator[Recording]:
        """
        Write the recording ``folder/name`` in a with block, whole or not at all.

        The folder appears when the block ends; an exception in the block leaves nothing behind.

        Parameters
        ----------
        folder : path
            Folder of recordings; made if missing.
        name : str
            Name of the recording: a printable file name that does not begin with ``.`` or
            ``-``.
        types : MessageTypes
            Definitions of the messages.
        custom_data : mapping of str to str, optional
            Free text for the metadata, e.g. the planner's version.
        max_bytes : int, optional
            A message that would make a file larger than this begins the next, as rosbag2
            splits a bag; the file's index, and a single larger message, may exceed it.
            Default: one file.

        Raises
        ------
        InvalidValueError
            If the name, the custom data or the size are malformed.
        RecordingError
            If the name is taken (a recording is never overwritten), or the system refuses to
            write.

        """
        if not may_be_named(name):
            raise InvalidValueError('name', name, 'a printable file name that does not begin with '
                                    '. or -')
        if max_bytes is not None and max_bytes < 1:
            raise InvalidValueError('max_bytes', max_bytes, 'at least 1')
        path = expand_path(folder) / name
        custom_data = check_custom_data(custom_data or {})
        with staged_folder(path) as stage:
            recording = cls(stage, path, types, custom_data, max_bytes)
            with recording._open_file:
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
        self._check_time(log_time_ns)
        self._check_topic(topic)
        data = self._types.encode(topic.type_name, message)
        self.copy(topic, self._definition(topic), data, log_time_ns)

    def copy(self, topic: Topic, definition: Definition, data: bytes, log_time_ns: int) -> None:
        """
        Add a message of another recording as it lies in that.

        Parameters
        ----------
        topic, definition : Topic, Definition
            Of the message; the same every time.
        data : bytes
            In CDR.
        log_time_ns : int
            See `write`.

        Raises
        ------
        InvalidValueError, RecordingError
            See `write`.

        """
        time = self._check_time(log_time_ns)
        self._check_topic(topic)
        known = self._topics.get(topic.name, (topic, definition))
        if known[1] != definition:
            raise InvalidValueError(f'definition of {topic.name}', definition.type_name,
                                    'the same as before')
        with self._writing():
            if self._max_bytes and self._file.size_with(data) > self._max_bytes:
                self._end_file()
                self._file = self._begin_file()
            self._file.write(topic, definition, data, time)
        self._topics[topic.name], self._last = known, time

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
            raise InvalidValueError('name of an attachment', name, 'printable and used only once')
        time = _integer_time('time_ns', time_ns)
        with self._writing():
            self._file.attach(name, data, media_type, time)
        self._attachments.add(name)

    def _check_time(self, log_time_ns: int) -> int:
        """Return a log time that does not run backwards."""
        time = _integer_time('log_time_ns', log_time_ns)
        if self._last is not None and time < self._last:
            raise InvalidValueError('log_time_ns', time, f'>= {self._last}, the last one')
        return time

    def _check_topic(self, topic: Topic) -> None:
        """Raise if a topic was written otherwise before."""
        before = self._topics.get(topic.name)
        if before is not None and before[0] != topic:
            raise InvalidValueError('topic', topic, f'the same as before, {before[0]}')

    def _begin_file(self) -> RecordingFile:
        """Open the next file."""
        name = f'{self.path.name}_{len(self._parts)}.mcap'
        stream = self._open_file.enter_context(output_file(self._stage / name, self.path))
        with os_errors(self.path):
            return RecordingFile(stream, name)

    def _definition(self, topic: Topic) -> Definition:
        """Return the definition of a topic's type, which takes long to put together."""
        known = self._topics.get(topic.name)
        if known is not None and known[0].type_name == topic.type_name:
            return known[1]
        return self._types.definition(topic.type_name)

    def _end_file(self) -> None:
        """Write metadata and index of the open file and close it."""
        self._parts.append(self._file.finish(self._custom_data))
        self._open_file.close()

    def _finish(self) -> RecordingMetadata:
        """End the last file, and return the metadata of all."""
        with self._writing():
            self._end_file()
        self._writable = False
        return RecordingMetadata.join(self._parts)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Let nothing follow a write that failed, even if the caller goes on."""
        if not self._writable:
            raise RecordingError(f'{self.path} is closed or a write to it has failed')
        self._writable = False
        with os_errors(self.path):
            yield
        self._writable = True


def may_be_named(name: str) -> bool:
    """Return whether a recording may have a name: it cannot lead elsewhere or hide."""
    return (bool(name) and name.isprintable() and '/' not in name and name[0] not in '.-'
            and name == name.strip())


def _integer_time(field: str, value: int) -> int:
    """Return a time that rosbag2 can hold [ns]."""
    try:
        time = index(value)
    except TypeError:
        raise InvalidValueError(field, value, 'an integer [ns]') from None
    if not 0 <= time <= LARGEST_TIME:
        raise InvalidValueError(field, time, f'in [0, {LARGEST_TIME}] ns')
    return time
