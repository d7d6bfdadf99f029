"""
Processes that compute for this one, in code that nothing else can stop.

A library that computes for long inside one call can neither be interrupted by Ctrl-C nor be held
to a time limit; a process can. It is a new interpreter that imports one module, not a copy: no
script needs a main guard, and the threads of the caller do not matter.

"""

from __future__ import annotations

import atexit
from collections.abc import Iterator
from contextlib import contextmanager, suppress
import fcntl
from importlib import import_module
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from multiprocessing.spawn import get_executable
import os
from pathlib import Path
import signal
import subprocess
import sys
from threading import Lock
from typing import Any
from weakref import WeakSet

from flex_planner.base.processes import ONE_THREAD

# Ctrl-C in a terminal goes to every process of the command; what it means is the caller's matter
_PROGRAM = """\
import signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.path[:] = {path!a}
from flex_planner.base.helper_process import serve
serve({module!a})
"""
_ALL: WeakSet[HelperProcess] = WeakSet()


class HelperLostError(Exception):
    """A helper process has ended by itself; the text says how."""


class HelperProcess:
    """
    An interpreter that runs ``serve(requests, replies)`` of a module, and ends with this process.

    Its messages are pickled objects. It sends one when it is ready for its first request.

    Parameters
    ----------
    module : str
        To be imported there.

    Attributes
    ----------
    ready : bool
        Whether it waits for a request; set by who talks to it.

    Raises
    ------
    OSError
        If it cannot be started.

    """

    def __init__(self, module: str) -> None:
        executable = get_executable()
        if not executable or 'py' not in Path(os.fsdecode(executable)).name.lower():
            raise OSError('this program is no Python interpreter')
        theirs_in, self._requests = Pipe(duplex=False)
        self._replies, theirs_out = Pipe(duplex=False)
        with theirs_in, theirs_out:
            self._process = subprocess.Popen(
                [executable, *_flags(), '-c', _program(module)], stdin=theirs_in.fileno(),
                stdout=theirs_out.fileno(), stderr=subprocess.DEVNULL,
                env={**os.environ, **ONE_THREAD})
        self.ready = False
        _ALL.add(self)

    @property
    def process_id(self) -> int:
        """Return its number."""
        return self._process.pid

    def send(self, request: object) -> None:
        """Send a request; HelperLostError if it has ended."""
        try:
            self._requests.send(request)
        except OSError as error:
            raise HelperLostError(self._describe_end()) from error

    def receive(self) -> Any:
        """Wait for the next message; HelperLostError if it has ended."""
        try:
            return self._replies.recv()
        except (EOFError, OSError) as error:
            raise HelperLostError(self._describe_end()) from error

    def interrupt(self) -> None:
        """Ask it to give up its request; it answers all the same."""
        self._process.send_signal(signal.SIGUSR1)

    def end(self) -> None:
        """End it at once, whatever it does."""
        self._process.kill()
        self._process.wait()
        self._requests.close()
        self._replies.close()

    def forget(self) -> None:
        """Leave it to the process that this one is a copy of."""
        self._process.returncode = 0  # so that nothing here ends it
        self._requests.close()
        self._replies.close()

    def _describe_end(self) -> str:
        """Return how it ended."""
        self._process.kill()
        code = self._process.wait()
        return f'ended by signal {-code}' if code < 0 else f'ended with exit code {code}'

    @staticmethod
    def wait(helpers: list[HelperProcess], seconds: float) -> list[HelperProcess]:
        """Return the helpers that have sent something, after a while at the latest."""
        ends = {helper._replies: helper for helper in helpers}
        return [ends[end] for end in wait(list(ends), seconds) if isinstance(end, Connection)]


class HelperPool:
    """
    Helper processes of one kind that are kept, ready for the next use.

    Parameters
    ----------
    module : str
        What they run, see `HelperProcess`.
    kept : int
        How many at most.

    """

    def __init__(self, module: str, kept: int) -> None:
        self._module, self._kept, self._lock = module, kept, Lock()
        self._idle: list[HelperProcess] = []
        os.register_at_fork(after_in_child=self._forget)

    def borrow(self, wanted: int, started: int) -> list[HelperProcess]:
        """
        Return so many kept helpers; new ones are started only up to another number.

        Raises
        ------
        OSError
            If not even one can be started.

        """
        with self._lock:
            found = self._idle[:wanted]
            self._idle = self._idle[wanted:]
        try:
            while len(found) < started:
                found.append(HelperProcess(self._module))
        except OSError:
            if not found:
                raise
        return found

    def give_back(self, helper: HelperProcess) -> None:
        """Keep a helper that does nothing for the next use."""
        with self._lock:
            if len(self._idle) < self._kept:
                self._idle.append(helper)
                return
        helper.end()

    def _forget(self) -> None:
        self._lock, self._idle = Lock(), []


@atexit.register
def _end_all() -> None:
    for helper in list(_ALL):
        helper.end()


def _forget_all() -> None:
    for helper in list(_ALL):
        helper.forget()


os.register_at_fork(after_in_child=_forget_all)


def _flags() -> list[str]:
    """Return the options of this interpreter that say what it imports and writes."""
    given = {'-I': sys.flags.isolated, '-E': sys.flags.ignore_environment,
             '-S': sys.flags.no_site, '-B': sys.flags.dont_write_bytecode}
    return [flag for flag, is_given in given.items() if is_given]


def _program(module: str) -> str:
    """Return what the interpreter runs; it imports from where this one does."""
    here = str(Path(__file__).resolve().parents[2])
    path = [here, *(entry for entry in sys.path if entry and isinstance(entry, str))]
    return _PROGRAM.format(path=path, module=module)


# In the helper process


def serve(module: str) -> None:
    """Run a module's ``serve`` until the process that wants it ends."""
    requests, replies = (Connection(os.dup(number)) for number in (0, 1))
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1):  # what libraries print goes nowhere
        os.dup2(nothing, number)
    with suppress(EOFError, OSError):
        import_module(module).serve(requests, replies)


@contextmanager
def ending_with_caller(requests: Connection) -> Iterator[None]:
    """
    End this process meanwhile as soon as nobody can send requests any more.

    The kernel does it, also while a library computes; the caller sends nothing meanwhile.

    """
    number = requests.fileno()
    flags = fcntl.fcntl(number, fcntl.F_GETFL)
    fcntl.fcntl(number, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(number, fcntl.F_SETFL, flags | os.O_ASYNC)
    try:
        if requests.poll():  # it was too late for the signal
            raise EOFError
        yield
    finally:
        fcntl.fcntl(number, fcntl.F_SETFL, flags)
