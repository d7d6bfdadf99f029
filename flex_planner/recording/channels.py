"""The channels of an MCAP file of any writer: messages of ROS 2, or what else they hold."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.errors import InvalidValueError
from flex_planner.recording.topics import Definition, QosProfile, Topic
from mcap.records import Channel, McapRecord, Schema


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedChannel:
    """
    A channel as a file describes it.

    Attributes
    ----------
    name : str
        Of its topic, as it stands in the file.
    topic : Topic or None
        None where it holds no messages of ROS 2.
    definition : Definition
        Of its type.
    reason : str
        Why it has no topic.

    """

    name: str
    topic: Topic | None = None
    definition: Definition = Definition('')
    reason: str = ''

    @classmethod
    def of(cls, channel: Channel, schema: Schema | None) -> RecordedChannel:
        """Return the channel that two records describe."""
        if channel.message_encoding != 'cdr':
            encoding = channel.message_encoding
            if not encoding or not encoding.isprintable():
                encoding = 'of an unknown encoding'
            return cls(name=channel.topic, reason=f"its messages are {encoding}, not ROS 2's cdr")
        if schema is None:
            return cls(name=channel.topic, reason='the type of its messages is not recorded')
        type_name = _full_type_name(schema.name)
        qos = QosProfile.from_yaml(channel.metadata.get('offered_qos_profiles', ''))
        try:
            topic = Topic(f'/{channel.topic.removeprefix("/")}', type_name, qos)
        except InvalidValueError as error:
            return cls(name=channel.topic, reason=str(error))
        return cls(name=channel.topic, topic=topic, definition=Definition(
            type_name, schema.encoding, schema.data, channel.metadata.get('topic_type_hash', '')))


class ChannelTable:
    """The channels of a file by their numbers, collected record by record."""

    def __init__(self) -> None:
        self.channels: dict[int, RecordedChannel] = {}
        self._schemas: dict[int, Schema] = {}

    def add(self, record: McapRecord) -> None:
        """Take a schema or a channel, which may come again; pass over all else."""
        if isinstance(record, Schema):
            self._schemas.setdefault(record.id, record)
        elif isinstance(record, Channel) and record.id not in self.channels:
            schema = self._schemas.get(record.schema_id)
            self.channels[record.id] = RecordedChannel.of(record, schema)

    def find(self, number: int) -> RecordedChannel:
        """Return the channel of a message."""
        return self.channels.get(number) or RecordedChannel(
            name=f'channel {number}', reason='no record describes it')


def _full_type_name(name: str) -> str:
    """Return a type's name with its part msg, which ROS 1 and some writers leave out."""
    package, _, rest = name.partition('/')
    return name if '/' in rest or not rest else f'{package}/msg/{rest}'
