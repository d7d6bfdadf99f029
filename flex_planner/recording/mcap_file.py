"""
One file of a recording.

Every channel carries CDR with the definition of its type: a single channel of another kind would
make ``ros2 bag play`` refuse the file. Everything that is not a message is an attachment.

"""

from __future__ import annotations

from collections.abc import Mapping
from typing import BinaryIO, Final

from flex_planner.base.version import VERSION
from flex_planner.recording.metadata import FileSummary, RecordingMetadata, TopicSummary
from flex_planner.recording.topics import Definition, Topic
from mcap.writer import CompressionType, LIBRARY_IDENTIFIER, Writer

CHUNK_SIZE: Final = 2**16  # bytes before compression; a killed process loses the last chunk
_MESSAGE_HEADER: Final = 31  # bytes


class _Channel:
    """A topic with its number in the file and the messages so far."""

    def __init__(self, topic: Topic, number: int, definition: Definition) -> None:
        self.topic = topic
        self.number = number
        self.definition = definition
        self.count = 0

    def summary(self) -> TopicSummary:
        """Return the topic's entry in the metadata."""
        return TopicSummary(topic=self.topic, definition=self.definition,
                            message_count=self.count)


class RecordingFile:
    """
    An MCAP file that is being written, of messages that are encoded and checked already.

    Parameters
    ----------
    stream : binary file
        Where the bytes go.
    name : str
        Name of the file.

    """

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream = stream
        self._name = name
        self._channels: dict[str, _Channel] = {}
        self._schemas: dict[Definition, int] = {}
        self._times: tuple[int, int] | None = None
        self._pending = 0
        self._writer = Writer(stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD,
                              enable_data_crcs=True)
        self._writer.start('ros2', f'flex_planner/{VERSION} {LIBRARY_IDENTIFIER}')
        self._written = stream.tell()

    def size_with(self, data: bytes) -> int:
        """Return the bytes of the file with one more message, at most; 0 if it is the first."""
        if self._times is None:
            return 0
        return self._written + self._pending + _MESSAGE_HEADER + len(data)

    def write(self, topic: Topic, definition: Definition, data: bytes, time: int) -> None:
        """Add a message of a topic, whose definition is the same every time."""
        channel = self._channels.get(topic.name) or self._add_channel(topic, definition)
        self._writer.add_message(channel.number, time, data, publish_time=time)
        channel.count += 1
        self._times = (time if self._times is None else self._times[0], time)
        self._pending += _MESSAGE_HEADER + len(data)
        self._hand_over()

    def attach(self, name: str, data: bytes, media_type: str, time: int) -> None:
        """Add a file."""
        self._writer.add_attachment(time, time, name, media_type, data)
        self._hand_over()

    def finish(self, custom_data: Mapping[str, str]) -> RecordingMetadata:
        """Write metadata and index, and return the metadata."""
        start, end = self._times or (0, 0)
        topics = tuple(channel.summary() for channel in self._channels.values())
        extent = FileSummary(name=self._name, start_ns=start, end_ns=end,
                             message_count=sum(topic.message_count for topic in topics))
        metadata = RecordingMetadata(files=(extent,), topics=topics, custom_data=custom_data)
        self._writer.add_metadata('rosbag2', {'serialized_metadata': metadata.to_record()})
        self._writer.finish()  # type: ignore[no-untyped-call]
        return metadata

    def _add_channel(self, topic: Topic, definition: Definition) -> _Channel:
        """Add a topic to the file, with the schema of its type."""
        schema = self._schemas.get(definition)
        if schema is None:
            schema = self._writer.register_schema(definition.type_name, definition.encoding,
                                                  definition.text)
            self._schemas[definition] = schema
        metadata = {'offered_qos_profiles': topic.qos.to_yaml(),
                    'topic_type_hash': definition.type_hash}
        number = self._writer.register_channel(topic.name, 'cdr', schema, metadata)
        self._channels[topic.name] = _Channel(topic, number, definition)
        return self._channels[topic.name]

    def _hand_over(self) -> None:
        """Let the system have every chunk as soon as it is complete."""
        if (position := self._stream.tell()) != self._written:
            self._stream.flush()
            self._written, self._pending = position, 0
