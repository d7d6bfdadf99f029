"""The C compiler of the system."""

from __future__ import annotations

import os
from pathlib import Path
import shlex
import shutil
import subprocess

from flex_planner.base.errors import FlexPlannerError

FLAGS = ('-march=native', '-fPIC', '-shared')
_SHOWN = 300  # characters of what a compiler says


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
                    options: tuple[str, ...] = ()) -> Path:
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

    Raises
    ------
    CompilerError
        If it fails, with what it says.
    OSError
        If the source cannot be written.

    """
    code, library = folder / 'functions.c', folder / 'functions.so'
    code.write_text(source)
    try:
        done = subprocess.run([*compiler, *FLAGS, *options, str(code), '-o', str(library), '-lm'],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              errors='replace')
    except OSError as error:
        raise CompilerError(f'{compiler[0]} cannot be run: {error.strerror or error}') from None
    if done.returncode or not library.is_file():
        # without the folder, which has another name each time
        said = ' '.join(done.stderr.replace(f'{folder}/', '').split())[:_SHOWN]
        said = said or f'exit code {done.returncode}'
        raise CompilerError(f'{compiler[0]} failed: {said}')
    return library


def _words(command: str) -> list[str]:
    """Return the words of a command such as ``ccache gcc``."""
    try:
        return shlex.split(command)
    except ValueError:  # a quote without its partner
        return []
