"""
The records of an MCAP file, read from its beginning to its end.

Indexes, statistics, and what a summary repeats are optional: nothing here needs them, and the
order of messages does not come from them. All checksums that a file has are verified.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
import heapq
from pathlib import Path
import stat
import struct
from typing import Any, BinaryIO, cast, Final
import zlib

from flex_planner.base.errors import RecordingError
from flex_planner.recording.channels import ChannelTable
from flex_planner.recording.metadata import is_text
from flex_planner.recording.topics import parse_yaml
from mcap.exceptions import InvalidMagic, McapError
from mcap.records import Chunk, Footer, McapRecord, Message, Metadata, Statistics
from mcap.stream_reader import breakup_chunk, StreamReader
from zstandard import ZstdError

# What the libraries raise at damaged content; the last two at a length of terabytes and more.
DAMAGE: Final = (
    McapError, ZstdError, struct.error, EOFError,
    KeyError, ValueError, RuntimeError, MemoryError, OverflowError,
)
COMPRESSIONS: Final = ('', 'lz4', 'zstd')
FOOTER: Final = 1 + 8 + 20  # bytes
CHECKSUM: Final = 4  # bytes at the end of the footer, which it leaves out itself
ENDLESS: Final = 2**64  # [ns], after every log time


@dataclass(slots=True, kw_only=True)
class FileContents:
    """
    The contents of a file, without its messages.

    Attributes
    ----------
    table : ChannelTable
        Its channels.
    counts : Counter
        Messages of each channel.
    end_ns : int
        Last log time, 0 without messages [ns].
    custom_data : dict of str to str
        From rosbag2's record.
    begins : list of int
        The first log time in each block of records, see `read_blocks` [ns].

    """

    table: ChannelTable = field(default_factory=ChannelTable)
    counts: Counter[int] = field(default_factory=Counter)
    end_ns: int = 0
    custom_data: dict[str, str] = field(default_factory=dict)
    begins: list[int] = field(default_factory=list)

    @property
    def start_ns(self) -> int:
        """Return the first log time, 0 without messages [ns]."""
        return min(self.begins) if self.counts else 0


def scan_file(file: Path) -> FileContents:
    """Read a whole file; RecordingError if anything of it is missing or damaged."""
    contents, expected = FileContents(), 0
    with open_file(file) as stream:
        for block in read_blocks(stream):
            contents.begins.append(_add_messages(contents, block))
            for record in block:
                contents.table.add(record)
                if isinstance(record, Metadata) and record.name == 'rosbag2':
                    contents.custom_data = _custom_data(record)
                elif isinstance(record, Statistics):
                    expected = record.message_count
                elif isinstance(record, Footer):
                    _verify_summary(stream, record)
        if contents.counts.total() < expected:
            raise McapError(f'it counts {expected} messages, but has {contents.counts.total()}')
    return contents


def read_messages(file: Path, contents: FileContents) -> Iterator[Message]:
    """
    Yield the messages of a file in the order of their log times.

    A message is held back only as long as an earlier one may follow.

    """
    waiting: list[tuple[int, int, Message]] = []
    later, number = _begins_later(contents.begins), 0
    with open_file(file) as stream:
        for block, following in zip(read_blocks(stream), later, strict=True):
            for record in block:
                if isinstance(record, Message):
                    heapq.heappush(waiting, (record.log_time, number, record))
                    number += 1
            while waiting and waiting[0][0] <= following:
                yield heapq.heappop(waiting)[2]


def read_blocks(stream: BinaryIO) -> Iterator[list[McapRecord]]:
    """Yield the records of a stream, those of a chunk together, and only if all of it is whole."""
    source = cast(BinaryIO, _WholeReads(stream))
    for record in StreamReader(source, emit_chunks=True, validate_crcs=True).records:
        if not isinstance(record, Chunk):
            yield [record]
            continue
        if record.compression not in COMPRESSIONS:
            raise McapError(f'the compression {record.compression!r} is unknown')
        yield breakup_chunk(record, validate_crc=True)


@contextmanager
def open_file(file: Path) -> Iterator[BinaryIO]:
    """Open a file, and turn what it raises that is missing or damaged into RecordingError."""
    try:
        mode, size = file.stat().st_mode, file.stat().st_size
        if not stat.S_ISREG(mode):  # a pipe would be waited for
            raise RecordingError(f'cannot read {file}: it is no file')
        if not size:
            raise RecordingError(f'{file} is damaged or not an MCAP file: it is empty')
        with file.open('rb') as stream:
            yield stream
    except OSError as error:
        raise RecordingError(f'cannot read {file}: {error.strerror or error}') from error
    except InvalidMagic as error:
        raise RecordingError(f'{file} is damaged or not an MCAP file: it does not begin and end '
                             'like one') from error
    except DAMAGE as error:
        reason = str(error) or type(error).__name__
        raise RecordingError(f'{file} is damaged or not an MCAP file: {reason}') from error


class _WholeReads:
    """A stream that returns all bytes asked for, as mcap takes for granted."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def read(self, size: int) -> bytes:
        data = self._stream.read(size) if size >= 0 else b''
        if len(data) != size:
            raise McapError('it ends within a record, as if its writer was stopped; try '
                            'flex-planner recover')
        return data


def _add_messages(contents: FileContents, block: list[McapRecord]) -> int:
    """Count the messages of a block, and return the first log time in it [ns]."""
    times = []
    for record in block:
        if isinstance(record, Message):
            contents.counts[record.channel_id] += 1
            times.append(record.log_time)
    if not times:
        return ENDLESS
    contents.end_ns = max(*times, contents.end_ns)
    return min(times)


def _begins_later(begins: list[int]) -> list[int]:
    """Return the first log time after each block [ns]."""
    later, earliest = [], ENDLESS
    for begin in reversed(begins):
        later.append(earliest)
        earliest = min(begin, earliest)
    return later[::-1]


def _verify_summary(stream: BinaryIO, footer: Footer) -> None:
    """Raise unless the checksum of the summary is right; mcap ignores it."""
    if not footer.summary_crc:
        return
    end = stream.tell()
    stream.seek(footer.summary_start or end - FOOTER)
    content = stream.read(end - CHECKSUM - stream.tell())
    stream.seek(end)
    if zlib.crc32(content) != footer.summary_crc:
        raise McapError('the checksum of the summary is wrong')


def _custom_data(record: Metadata) -> dict[str, str]:
    """Return the custom data of rosbag2's metadata record, as far as it is text."""
    content: Any = parse_yaml(record.metadata.get('serialized_metadata', ''))
    found = content.get('custom_data') if isinstance(content, dict) else None
    return {key: value for key, value in found.items()
            if is_text(key) and is_text(value)} if isinstance(found, dict) else {}
