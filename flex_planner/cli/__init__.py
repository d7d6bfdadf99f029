"""Console script ``flex-planner``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import errno
import sys

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import StoppedError, StopReason
from flex_planner.base.sentences import say_os_error
from flex_planner.base.streams import lasting_streams, LastingStream
from flex_planner.cli.signals import CanceledError, SIGNALS

# not worth a word: the reader of the output has seen enough
_QUIET = (errno.EPIPE, errno.ESHUTDOWN)


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run the console script.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process, which ends afterwards.

    Returns
    -------
    int
        Exit code: 0; 1 after a message on standard error; 130 if Ctrl-C was pressed, 128 and the
        number of another signal that ended the work.

    """
    given = sys.argv[1:] if arguments is None else arguments

    def command() -> int:
        with SIGNALS.starting():
            # here, so that Ctrl-C while they are loaded finds somebody
            from flex_planner.cli.parser import parse
        options = parse(given)
        return int(options.run(options))

    return run_command(command, ends=arguments is None)


def run_command(command: Callable[[], int], *, ends: bool = True) -> int:
    """
    Run a command, and say why it fails.

    Parameters
    ----------
    command : callable
        Returns an exit code.
    ends : bool
        Whether the process ends afterwards.

    Returns
    -------
    int
        Exit code, see `main`.

    """
    with lasting_streams() as (output, _), SIGNALS:
        try:
            code = _told(output, _run(command))
        except SystemExit as end:  # after help, and what is wrong with a command line
            raise SystemExit(_told(output, end.code if isinstance(end.code, int) else 1)) from None
        if ends:
            SIGNALS.ending(code)
    return code


def _run(command: Callable[[], int]) -> int:
    """Return the exit code of a command, also of one that fails."""
    try:
        code = command()
        SIGNALS.check()
    except BaseException as error:
        return _failed(error)
    return code


def _failed(error: BaseException) -> int:
    """Say why a command ends; raise what is an error of the program."""
    if SIGNALS.number and not isinstance(error, CanceledError):
        return SIGNALS.tell()  # libraries make other exceptions of an interruption
    if isinstance(error, KeyboardInterrupt):
        return SIGNALS.tell()
    if not isinstance(error, (FlexPlannerError, OSError, StoppedError, CanceledError)):
        raise error
    sentence = say_os_error(error) if isinstance(error, OSError) else error
    print(f'flex-planner: {sentence}', file=sys.stderr)
    canceled = isinstance(error, CanceledError) or (
        isinstance(error, StoppedError) and error.reason is StopReason.CANCELED)
    return SIGNALS.exit_code if canceled else 1


def _told(output: LastingStream, code: int) -> int:
    """Return the exit code; it is 1 where the results could not be told to the end."""
    output.flush()
    failure = output.failure
    if failure is None or failure.errno in _QUIET:
        return code
    print(f'flex-planner: standard output failed: {failure.strerror or failure}', file=sys.stderr)
    return code or 1
