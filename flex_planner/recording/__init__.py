"""
Recordings of plans that ROS 2 tools open, written and read without ROS.

A recording is a folder ``<name>/`` with ``<name>_0.mcap`` and ``metadata.yaml``, as ``ros2 bag
record -s mcap`` leaves one behind; a split one has ``<name>_1.mcap`` and so on. Identical inputs
give identical bytes: the messages are encoded here, not by a middleware, and nothing in the files
depends on the clock or the machine.

"""

from __future__ import annotations

from flex_planner.recording.decoding import check_encoding, Decoder
from flex_planner.recording.definition_files import definition_folder
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.folders import shown_path
from flex_planner.recording.metadata import (
    FileSummary,
    ForeignChannel,
    RecordingMetadata,
    TopicSummary,
)
from flex_planner.recording.playback import from_time
from flex_planner.recording.reader import (
    read_attachments,
    read_metadata,
    read_recording,
    read_serialized,
    RecordedMessage,
    SerializedMessage,
)
from flex_planner.recording.recovery import recover_recording
from flex_planner.recording.retention import find_recordings, remove_oldest
from flex_planner.recording.stand_ins import StandIns
from flex_planner.recording.topics import (
    DEFAULT,
    Definition,
    Durability,
    LATCHED,
    parse_yaml,
    QosProfile,
    Reliability,
    Topic,
)
from flex_planner.recording.writer import Recording

__all__ = [
    'DEFAULT',
    'LATCHED',
    'Decoder',
    'Definition',
    'Durability',
    'FileSummary',
    'ForeignChannel',
    'MessageTypes',
    'QosProfile',
    'RecordedMessage',
    'Recording',
    'RecordingMetadata',
    'Reliability',
    'SerializedMessage',
    'StandIns',
    'Topic',
    'TopicSummary',
    'check_encoding',
    'definition_folder',
    'find_recordings',
    'from_time',
    'parse_yaml',
    'read_attachments',
    'read_metadata',
    'read_recording',
    'read_serialized',
    'recover_recording',
    'remove_oldest',
    'shown_path',
]
