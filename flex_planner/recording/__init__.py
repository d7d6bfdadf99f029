"""
Recordings of plans that ROS 2 tools open, written and read without ROS.

A recording is a folder ``<name>/`` with ``<name>_0.mcap`` and ``metadata.yaml``, as ``ros2 bag
record -s mcap`` leaves one behind. Identical inputs give identical bytes: the messages are
encoded here, not by a middleware, and nothing in the files depends on the clock or the machine.

"""

from __future__ import annotations

from flex_planner.recording.definitions import definition_folder, MessageTypes
from flex_planner.recording.metadata import RecordingMetadata, TopicSummary
from flex_planner.recording.reader import (
    read_attachments,
    read_metadata,
    read_recording,
    RecordedMessage,
)
from flex_planner.recording.topics import (
    DEFAULT,
    Durability,
    LATCHED,
    QosProfile,
    Reliability,
    Topic,
)
from flex_planner.recording.writer import Recording

__all__ = [
    'DEFAULT',
    'LATCHED',
    'Durability',
    'MessageTypes',
    'QosProfile',
    'RecordedMessage',
    'Recording',
    'RecordingMetadata',
    'Reliability',
    'Topic',
    'TopicSummary',
    'definition_folder',
    'read_attachments',
    'read_metadata',
    'read_recording',
]
