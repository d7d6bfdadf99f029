"""
Recovery of the complete part of a recording that is damaged, or whose writer was killed.

A reader refuses such a recording as a whole: a plan moves an arm. Here its complete part becomes
a new recording, on request only. Messages are copied as they lie in it, also those of types that
are not known here; what cannot be copied is named.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
import fcntl
import os
from pathlib import Path
import re
from typing import Final

from flex_planner.base.errors import InvalidValueError, RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.recording.channels import ChannelTable
from flex_planner.recording.decoding import check_encoding, Decoder
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.folders import recording_files, shown_path
from flex_planner.recording.mcap_records import DAMAGE, read_blocks
from flex_planner.recording.metadata import ForeignChannel
from flex_planner.recording.reader import LOG, SerializedMessage, UnreadMessages
from flex_planner.recording.topics import Definition, Topic
from flex_planner.recording.writer import may_be_named, Recording
from mcap.records import Attachment, McapRecord, Message

STAGE: Final = re.compile(r'\.(.+)\.[0-9a-f]{16}')  # see `staging`
UNPRINTABLE: Final = re.compile(r'^[-.\s]+|[^\w .,+=()@%#-]|\s+$')


def recover_recording(path: Path | str, types: MessageTypes,
                      left_out: Callable[[ForeignChannel], None] | None = None) -> Path:
    """
    Write the complete part of a recording as a recording of its own beside it.

    Parameters
    ----------
    path : path
        The recording, its file, or the hidden folder ``.<name>.<number>`` that a killed writer
        left behind. It stays as it is.
    types : MessageTypes
        Definitions of its messages; those of other types are copied unseen.
    left_out : callable, optional
        Called with each channel of which messages were left out, and why; default: that is
        logged.

    Returns
    -------
    Path
        The new recording: ``<name>`` for a hidden folder, else ``<name>_recovered``.

    Raises
    ------
    RecordingError
        If nothing is complete, its writer is still at work, or the new recording exists or
        cannot be written.

    """
    path = expand_path(path)
    files, target = recording_files(path, complete=False), _target(path)
    _refuse_unfinished_work(files[-1])
    found = _Complete(types)
    for file in files:
        found.add_file(file)
    if not found.messages and not found.attachments:
        others = ''.join(f'; {channel}' for channel in found.unread.channels())
        raise RecordingError(f'{path} holds no complete message or attachment{others}')
    with Recording.create(target.parent, target.name, types,
                          custom_data={'recovered_from': shown_path(path.name)}) as recording:
        for record in found.attachments:
            found.attach(recording, record)
        for message in sorted(found.messages, key=lambda message: message.log_time_ns):
            found.copy(recording, message)
    for channel in found.unread.channels():
        (left_out or _log)(channel)
    return target


@dataclass(slots=True)
class _Complete:
    """What is complete in the files of a recording, and what of it is left out."""

    types: MessageTypes
    messages: list[SerializedMessage] = field(default_factory=list)
    attachments: list[Attachment] = field(default_factory=list)
    unread: UnreadMessages = field(default_factory=UnreadMessages)
    written: dict[str, tuple[Topic, Definition]] = field(default_factory=dict)

    def add_file(self, file: Path) -> None:
        """Take attachments and messages up to the first damage, chunk by chunk."""
        table, decoder = ChannelTable(), Decoder(self.types)
        for record in _undamaged_records(file):
            table.add(record)
            if isinstance(record, Attachment):
                self.attachments.append(record)
            elif isinstance(record, Message):
                self._add_message(table, decoder, record)

    def _add_message(self, table: ChannelTable, decoder: Decoder, record: Message) -> None:
        """Take a message; one of a type that is known here must be what it is said to be."""
        channel = table.find(record.channel_id)
        if channel.topic is None:
            self.leave_out(channel.name, channel.reason)
            return
        definition = channel.definition
        try:
            check_encoding(record.data)
            if definition.type_name in self.types:
                decoder.decode(definition, record.data)
        except RecordingError as error:
            self.leave_out(channel.topic.name, str(error))
            return
        self.messages.append(SerializedMessage(channel.topic, definition, record.log_time,
                                               record.data))

    def copy(self, recording: Recording, message: SerializedMessage) -> None:
        """Write a message; a topic keeps the quality of service that it had first."""
        topic, definition = self.written.setdefault(
            message.topic.name, (message.topic, message.definition))
        if definition != message.definition:
            self.leave_out(topic.name, 'the topic has another type or definition before')
            return
        try:
            recording.copy(topic, definition, message.data, message.log_time_ns)
        except InvalidValueError as error:  # a time that rosbag2 cannot hold
            self.leave_out(topic.name, str(error))

    def attach(self, recording: Recording, record: Attachment) -> None:
        """Write an attachment."""
        try:
            recording.attach(record.name, record.data, media_type=record.media_type,
                             time_ns=record.create_time)
        except InvalidValueError as error:
            self.leave_out(f'attachment {record.name!r}', str(error))

    def leave_out(self, name: str, reason: str) -> None:
        """Remember a message that is left out."""
        self.unread.add(ForeignChannel(name=name, reason=reason, message_count=1))


def _target(path: Path) -> Path:
    """Return the folder of the new recording."""
    path = Path(os.path.abspath(path))
    folder = path.parent if STAGE.fullmatch(path.parent.name) and path.is_file() else path
    stage = STAGE.fullmatch(folder.name)
    name = stage[1] if stage else f'{folder.name.removesuffix(".mcap")}_recovered'
    return folder.with_name(name if may_be_named(name) else _printable(name))


def _printable(name: str) -> str:
    """Return a name with what a recording's cannot have replaced."""
    return UNPRINTABLE.sub('_', shown_path(name))


def _undamaged_records(file: Path) -> Iterator[McapRecord]:
    """Yield the records up to the first damage; the parts of a chunk only if all of it is."""
    try:
        with file.open('rb') as stream, suppress(*DAMAGE):
            for block in read_blocks(stream):
                yield from block
    except OSError as error:
        raise RecordingError(f'cannot read {file}: {error.strerror or error}') from error


def _refuse_unfinished_work(file: Path) -> None:
    """Raise if the writer of a file is alive, see `staging.output_file`."""
    try:
        if not file.is_file() and file.exists():  # a pipe would be waited for
            raise RecordingError(f'cannot read {file}: it is no file')
        with file.open('rb') as stream:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RecordingError(f'{file} is still being written') from None
    except OSError as error:
        raise RecordingError(f'cannot read {file}: {error.strerror or error}') from error


def _log(channel: ForeignChannel) -> None:
    LOG.warning('not recovered: %s', channel)
