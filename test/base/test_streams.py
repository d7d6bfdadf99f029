"""Standard streams whose other end lacks letters, goes away, or never was."""

from __future__ import annotations

from collections.abc import Iterator
import errno
import io
import os
from pathlib import Path
import subprocess
import sys
from typing import TextIO

from flex_planner.base.streams import lasting_streams, LastingStream
import pytest


@pytest.fixture
def pipe() -> Iterator[tuple[int, TextIO]]:
    """Return the end of a pipe that is read, and a stream of the other."""
    reader, writer = os.pipe()
    with open(writer, 'w', encoding='utf-8') as stream:
        yield reader, stream


@pytest.mark.parametrize(('encoding', 'shown'), [
    ('ascii', rb'Gr\xf6\xdfe \u9577 \udcff'), ('latin-1', b'Gr\xf6\xdfe \\u9577 \\udcff'),
    ('utf-8', 'Größe 長 '.encode() + rb'\udcff'), ('cp1252', b'Gr\xf6\xdfe \\u9577 \\udcff')])
def test_letters_that_an_alphabet_lacks_are_escaped(encoding: str, shown: bytes) -> None:
    raw = io.BytesIO()
    stream = LastingStream(io.TextIOWrapper(raw, encoding))
    print('Größe 長 \udcff', file=stream, flush=True)
    assert raw.getvalue() == shown + b'\n'


def test_names_steer_no_terminal() -> None:
    text = io.StringIO()
    stream = LastingStream(text)
    print('\x1b[2J\a', file=stream)
    stream.write_raw('\r\x1b[K')
    assert text.getvalue() == '\\x1b[2J\\x07\n\r\x1b[K'


def test_reader_that_goes_away_ends_what_is_written(pipe: tuple[int, TextIO]) -> None:
    reader, writer = pipe
    stream = LastingStream(writer)
    os.close(reader)
    for _ in range(3):
        print('x' * 100_000, file=stream, flush=True)
    assert stream.failure is not None
    assert stream.failure.errno == errno.EPIPE
    assert not stream.isatty()
    writer.flush()  # as Python does when it ends


def test_full_disk_is_kept_in_mind() -> None:
    with open('/dev/full', 'w') as full:
        stream = LastingStream(full)
        print('lost', file=stream)
        stream.flush()
        assert stream.failure is not None
        assert stream.failure.errno == errno.ENOSPC


def test_stream_that_is_not_there_takes_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'stderr', None)
    with lasting_streams() as (_, errors):
        print('nobody', file=sys.stderr, flush=True)
        assert (errors.failure, errors.isatty()) == (None, False)
        with pytest.raises(io.UnsupportedOperation):
            errors.fileno()
    assert sys.stderr is None


def test_next_file_is_not_taken_for_a_closed_stream(tmp_path: Path) -> None:
    path = tmp_path / 'data'
    code = ('import os\nfrom flex_planner.base.streams import lasting_streams\n'
            'with lasting_streams():\n'
            f'    with open({str(path)!r}, "wb") as file:\n'
            '        os.write(2, b"an error of a library")\n        print("text")\n'
            '        assert file.fileno() > 2\n')
    command = ['sh', '-c', 'exec "$@" <&- >&- 2>&-', 'sh', sys.executable, '-c', code]
    ended = subprocess.run(command, check=False)
    assert ended.returncode == 0
    assert path.read_bytes() == b''
