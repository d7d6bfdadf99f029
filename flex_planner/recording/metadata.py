"""The contents of a recording: rosbag2's metadata.yaml, version 9."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from textwrap import indent
from types import MappingProxyType
from typing import Final

from flex_planner.base.errors import InvalidValueError
from flex_planner.recording.topics import Definition, Topic
import yaml

METADATA_VERSION: Final = 9
_TOPICS: Final = 'topics_with_message_count'
ROS_DISTRO: Final = 'jazzy'
# ten times as quick where PyYAML has libyaml, with the same values
_DUMPER: Final = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicSummary:
    """
    A topic with the number of its messages.

    Parameters
    ----------
    topic : Topic
        Name, type and quality of service.
    definition : Definition
        Of the type.
    message_count : int
        Number of messages.

    """

    topic: Topic
    definition: Definition
    message_count: int

    @property
    def type_hash(self) -> str:
        """Return the RIHS01 hash of the type's definition, empty if unknown."""
        return self.definition.type_hash

    def to_dict(self) -> dict[str, object]:
        """Return the entry of ``topics_with_message_count``."""
        return {
            'topic_metadata': {
                'name': self.topic.name,
                'type': self.topic.type_name,
                'serialization_format': 'cdr',
                'offered_qos_profiles': [self.topic.qos.to_dict()],
                'type_description_hash': self.type_hash,
            },
            'message_count': self.message_count,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ForeignChannel:
    """
    A channel of a recording that holds no messages of ROS 2.

    Parameters
    ----------
    name : str
        Of its topic.
    reason : str
        What it holds, or why it cannot be read.
    message_count : int
        Number of messages.

    """

    name: str
    reason: str
    message_count: int

    def __str__(self) -> str:
        """Return the channel in words."""
        count = self.message_count
        name = self.name if self.name.isprintable() else repr(self.name)
        return f'{name} ({count} message{"" if count == 1 else "s"}): {self.reason}'


@dataclass(frozen=True, slots=True, kw_only=True)
class FileSummary:
    """
    One file of a recording.

    Parameters
    ----------
    name : str
        Name of the MCAP file.
    start_ns, end_ns : int
        Log time of the first and the last message, 0 where there is none [ns].
    message_count : int
        Number of messages.

    """

    name: str
    start_ns: int
    end_ns: int
    message_count: int

    def to_dict(self) -> dict[str, object]:
        """Return the entry of ``files``."""
        return {'path': self.name, **_extent(self.start_ns, self.end_ns, self.message_count)}


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingMetadata:
    """
    Summary of a recording.

    Parameters
    ----------
    files : tuple of FileSummary
        In the order of their messages; one unless the recording was split.
    topics : tuple of TopicSummary
        Topics in the order of their first message.
    custom_data : mapping of str to str
        Free text of the writer, e.g. the version of the planner.
    foreign : tuple of ForeignChannel
        What the files hold besides; not written.

    """

    files: tuple[FileSummary, ...]
    topics: tuple[TopicSummary, ...]
    custom_data: Mapping[str, str]
    foreign: tuple[ForeignChannel, ...] = ()

    def __post_init__(self) -> None:
        """Check and copy the custom data."""
        object.__setattr__(self, 'custom_data', check_custom_data(self.custom_data))

    @property
    def start_ns(self) -> int:
        """Return the log time of the first message, 0 without one [ns]."""
        return min((file.start_ns for file in self.files if file.message_count), default=0)

    @property
    def end_ns(self) -> int:
        """Return the log time of the last message, 0 without one [ns]."""
        return max((file.end_ns for file in self.files if file.message_count), default=0)

    @property
    def message_count(self) -> int:
        """Return the number of messages on all topics."""
        return sum(topic.message_count for topic in self.topics)

    @property
    def duration_ns(self) -> int:
        """Return the time from the first to the last message [ns]."""
        return self.end_ns - self.start_ns

    def to_dict(self) -> dict[str, object]:
        """Return the mapping that rosbag2 reads; at version 9 every key is mandatory."""
        return {
            'version': METADATA_VERSION,
            'storage_identifier': 'mcap',
            **_extent(self.start_ns, self.end_ns, self.message_count),
            _TOPICS: [topic.to_dict() for topic in self.topics],
            'compression_format': '',
            'compression_mode': '',
            'relative_file_paths': [file.name for file in self.files],
            'files': [file.to_dict() for file in self.files],
            'custom_data': dict(self.custom_data),
            'ros_distro': ROS_DISTRO,
        }

    def to_record(self) -> str:
        """Return the text of the MCAP metadata record ``rosbag2``."""
        text, empty = _dump({**self.to_dict(), _TOPICS: []}), f'\n{_TOPICS}: []\n'
        if not self.topics:
            return text
        return text.replace(
            empty, f'\n{_TOPICS}:\n{"".join(_topic_text(topic) for topic in self.topics)}', 1)

    def to_file(self) -> str:
        """Return the text of metadata.yaml."""
        return f'rosbag2_bagfile_information:\n{indent(self.to_record(), "  ")}'

    @classmethod
    def join(cls, parts: Iterable[RecordingMetadata]) -> RecordingMetadata:
        """Return the metadata of a recording from those of its files, at least one."""
        parts = tuple(parts)
        topics: dict[tuple[str, str], TopicSummary] = {}
        for entry in (entry for part in parts for entry in part.topics):
            key = entry.topic.name, entry.topic.type_name
            before = topics.get(key)
            count = entry.message_count + (before.message_count if before else 0)
            topics[key] = replace(before or entry, message_count=count)
        foreign: dict[tuple[str, str], ForeignChannel] = {}
        for other in (other for part in parts for other in part.foreign):
            seen = foreign.get((other.name, other.reason))
            count = other.message_count + (seen.message_count if seen else 0)
            foreign[other.name, other.reason] = replace(other, message_count=count)
        return cls(files=tuple(file for part in parts for file in part.files),
                   topics=tuple(topics.values()), custom_data=parts[0].custom_data,
                   foreign=tuple(foreign.values()))


def _extent(start_ns: int, end_ns: int, message_count: int) -> dict[str, object]:
    """Return duration, start and count; a new object, else YAML would write an alias."""
    return {
        'duration': {'nanoseconds': end_ns - start_ns},
        'starting_time': {'nanoseconds_since_epoch': start_ns},
        'message_count': message_count,
    }


def check_custom_data(custom_data: Mapping[str, str]) -> Mapping[str, str]:
    """Return a read-only copy of custom data, which rosbag2 reads as strings only."""
    for key, value in custom_data.items():
        if not is_text(key) or not is_text(value):
            raise InvalidValueError(f'custom_data[{key!r}]', value,
                                    'a string with a string as its key')
    return MappingProxyType(dict(custom_data))


def is_text(value: object) -> bool:
    """Return whether a value is a string that UTF-8 can hold."""
    return isinstance(value, str) and value == value.encode(errors='ignore').decode()


@lru_cache(maxsize=64)
def _topic_text(topic: TopicSummary) -> str:
    """Return the entry of a topic, which is the same in many recordings, and most of the work."""
    return _dump([topic.to_dict()])


def _dump(content: object) -> str:
    """Return the YAML text of a mapping or list, in the order given."""
    text: str = yaml.dump(content, Dumper=_DUMPER, sort_keys=False, allow_unicode=True, width=1000)
    return text
