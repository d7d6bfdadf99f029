"""The C compiler of the system."""

from __future__ import annotations

from contextlib import suppress
import os
from pathlib import Path
import shlex
import shutil
import signal
import subprocess

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor

FLAGS = ('-march=native', '-fPIC', '-shared')
_SHOWN = 300  # characters of what a compiler says
_OFTEN = 0.01  # [s], between two looks at who watches it


class CompilerError(FlexPlannerError):
    """There is no compiler, or it failed."""


def find_compiler() -> list[str]:
    """
    Return the command of the C compiler: ``$CC``, else the usual names.

    Raises
    ------
    CompilerError
        If there is none.

    """
    for command in (_words(os.environ.get('CC', '')), ['cc'], ['gcc'], ['clang']):
        if command and (path := shutil.which(command[0])):
            return [path, *command[1:]]
    raise CompilerError('no C compiler (cc, gcc or clang) found')


def compile_library(compiler: list[str], source: str, folder: Path,
                    options: tuple[str, ...] = (), monitor: Monitor | None = None) -> Path:
    """
    Return the shared library that a compiler makes of C source in a folder.

    Parameters
    ----------
    compiler : list of str
        From `find_compiler`.
    source : str
        The C code.
    folder : Path
        Where it and the library are written.
    options : tuple of str
        Of the compiler, besides `FLAGS`.
    monitor : Monitor, optional
        Asked meanwhile; it may end the compiler.

    Raises
    ------
    StoppedError
        If the monitor stopped it.
    CompilerError
        If it fails, with what it says.
    OSError
        If the source cannot be written.

    """
    code, library = folder / 'functions.c', folder / 'functions.so'
    code.write_text(source)
    try:
        failed, errors = _run([*compiler, *FLAGS, *options, str(code), '-o', str(library), '-lm'],
                              monitor or Monitor())
    except OSError as error:
        raise CompilerError(f'{compiler[0]} cannot be run: {error.strerror or error}') from None
    if failed or not library.is_file():
        # without the folder, which has another name each time
        said = ' '.join(errors.replace(f'{folder}/', '').split())[:_SHOWN]
        said = said or f'exit code {failed}'
        raise CompilerError(f'{compiler[0]} failed: {said}')
    return library


def _run(command: list[str], monitor: Monitor) -> tuple[int, str]:
    """Return the exit code of a compiler and what it says; it ends early with all its parts."""
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True, errors='replace',
                               start_new_session=True)
    with process:
        try:
            while True:
                with suppress(subprocess.TimeoutExpired):
                    errors = process.communicate(timeout=_OFTEN)[1]
                    return process.returncode, errors
                monitor.check()
        except BaseException:
            # asked to, it removes its files; there is nobody to ask once it has ended
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
            raise


def _words(command: str) -> list[str]:
    """Return the words of a command such as ``ccache gcc``."""
    try:
        return shlex.split(command)
    except ValueError:  # a quote without its partner
        return []
