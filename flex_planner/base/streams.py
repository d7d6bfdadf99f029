"""
Standard streams that last, whatever a process is started with and whatever becomes of them.

A process may be started without them, or in a language whose alphabet lacks letters; a reader such
as ``head`` goes away early. Work is worth more than what is said about it: it goes on.

"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import io
import os
import sys
from typing import TextIO

from flex_planner.base.text import printable

_LAYOUT = '\n\t'


class LastingStream(io.TextIOBase):
    """
    A text stream that takes everything.

    What the alphabet of the stream lacks, and what would steer a terminal, is written as escapes.
    Once the stream fails, nothing more is written.

    Parameters
    ----------
    stream : text file or None
        Where to; None where there is none.

    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream
        self.failure: OSError | None = None

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Return the encoding of the stream."""
        return getattr(self._stream, 'encoding', None) or 'utf-8'

    def writable(self) -> bool:
        """Return True."""
        return True

    def isatty(self) -> bool:
        """Return whether somebody looks at a terminal."""
        return self._stream is not None and not self.failure and self._stream.isatty()

    def fileno(self) -> int:
        """Return the descriptor."""
        if self._stream is None:
            raise io.UnsupportedOperation('there is no stream')
        return self._stream.fileno()

    def write(self, text: str) -> int:
        """Write a text."""
        return self.write_raw(printable(text, sys.maxsize, keep=_LAYOUT))

    def write_raw(self, text: str) -> int:
        """Write a text that may steer the terminal."""
        if self._stream is not None and self.failure is None:
            shown = text.encode(self.encoding, 'backslashreplace').decode(self.encoding)
            try:
                self._stream.write(shown)
            except OSError as error:
                self._give_up(error)
        return len(text)

    def flush(self) -> None:
        """Pass on what was written."""
        if self._stream is not None and self.failure is None:
            try:
                self._stream.flush()
            except OSError as error:
                self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        """Write nothing more; what the buffers hold must not fail again when Python ends."""
        self.failure = error
        with suppress(OSError, ValueError):
            number = self.fileno()
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, number)
            os.close(nowhere)


def open_descriptors() -> None:
    """
    Have all three standard descriptors open.

    The next file that is opened would be taken for one that is not, and what libraries write on
    it would end up there.

    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)  # the lowest that is free, which is this
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)


@contextmanager
def lasting_streams() -> Iterator[tuple[LastingStream, LastingStream]]:
    """Let standard output and standard error be streams that last, for a block."""
    open_descriptors()
    before = sys.stdout, sys.stderr
    output, errors = (LastingStream(stream) for stream in before)
    sys.stdout, sys.stderr = output, errors
    try:
        yield output, errors
    finally:
        output.flush()
        errors.flush()
        sys.stdout, sys.stderr = before
