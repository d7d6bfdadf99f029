"""
Recovery of the complete part of a recording that is damaged, or whose writer was killed.

A reader refuses such a recording as a whole: a plan moves an arm. Here its complete part becomes
a new recording, on request only.

"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
import fcntl
from pathlib import Path
import re
from typing import Final

from flex_planner.base.errors import RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.reader import (
    check_definition,
    DAMAGE,
    recording_files,
    SerializedMessage,
    topic_of,
)
from flex_planner.recording.topics import Topic
from flex_planner.recording.writer import Recording
from mcap.records import Attachment, Channel, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader

STAGE: Final = re.compile(r'\.(.+)\.[0-9a-f]{16}')  # see `staging`


def recover_recording(path: Path | str, types: MessageTypes) -> Path:
    """
    Write the complete part of a recording as a recording of its own beside it.

    Parameters
    ----------
    path : path
        The recording, its file, or the hidden folder ``.<name>.<number>`` that a killed writer
        left behind. It stays as it is.
    types : MessageTypes
        Definitions of its messages.

    Returns
    -------
    Path
        The new recording: ``<name>`` for a hidden folder, else ``<name>_recovered``.

    Raises
    ------
    RecordingError
        If nothing is complete, its writer is still at work, a type is unknown, or the new
        recording exists or cannot be written.

    """
    path = expand_path(path)
    files, target = recording_files(path), _target(path.absolute())
    _refuse_unfinished_work(files[-1])
    records = [record for file in files for record in _complete_records(file)]
    messages = [record for record in records if isinstance(record, SerializedMessage)]
    if not records:
        raise RecordingError(f'{path} holds no complete message or attachment')
    for topic, type_hash in {(message.topic, message.type_hash) for message in messages}:
        check_definition(path, topic, type_hash, types)
    with Recording.create(target.parent, target.name, types,
                          custom_data={'recovered_from': path.name}) as recording:
        for record in records:
            if isinstance(record, Attachment):
                recording.attach(record.name, record.data, media_type=record.media_type,
                                 time_ns=record.create_time)
        for message in sorted(messages, key=lambda message: message.log_time_ns):
            content = types.decode(message.topic.type_name, message.data)
            recording.write(message.topic, content, message.log_time_ns)
    return target


def _target(path: Path) -> Path:
    """Return the folder of the new recording."""
    folder = path.parent if STAGE.fullmatch(path.parent.name) and path.is_file() else path
    stage = STAGE.fullmatch(folder.name)
    name = stage[1] if stage else f'{folder.name.removesuffix(".mcap")}_recovered'
    return folder.with_name(name)


def _complete_records(file: Path) -> Iterator[Attachment | SerializedMessage]:
    """Yield attachments and messages up to the first damage, chunk by chunk."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, tuple[Topic, str]] = {}
    for record in _undamaged_records(file):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.id not in channels:
            topic = topic_of(schemas.get(record.schema_id), record)
            channels[record.id] = topic, record.metadata.get('topic_type_hash', '')
        elif isinstance(record, Attachment):
            yield record
        elif isinstance(record, Message):
            if record.channel_id not in channels:
                return
            yield SerializedMessage(*channels[record.channel_id], record.log_time, record.data)


def _undamaged_records(file: Path) -> Iterator[McapRecord]:
    """Yield the records up to the first damage; the parts of a chunk only if all of it is."""
    try:
        with file.open('rb') as stream, suppress(*DAMAGE):
            yield from StreamReader(stream, validate_crcs=True).records
    except OSError as error:
        raise RecordingError(f'cannot read {file}: {error.strerror or error}') from error


def _refuse_unfinished_work(file: Path) -> None:
    """Raise if the writer of a file is alive, see `staging.output_file`."""
    try:
        with file.open('rb') as stream:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RecordingError(f'{file} is still being written') from None
    except OSError as error:
        raise RecordingError(f'cannot read {file}: {error.strerror or error}') from error
