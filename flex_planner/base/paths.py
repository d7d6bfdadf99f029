"""Paths as people write them: ``~`` is their home folder, and ``-`` the standard input."""

from __future__ import annotations

import os
from pathlib import Path

from flex_planner.base.errors import FlexPlannerError

STANDARD_INPUT = '-'


class PathError(FlexPlannerError):
    """A path names no place; the message says why."""


def expand_path(path: str | os.PathLike[str]) -> Path:
    """
    Return a path with ``~`` and ``~user`` replaced by the home folder.

    Shells do so where ``~`` begins a word, but not in ``--output=~/maps``, in parameters of nodes,
    in files, or between quotes.

    Raises
    ------
    PathError
        If that user has no home folder, or the path cannot be that of a file.

    """
    text = os.fspath(path)
    if '\0' in text:
        raise PathError(f'{text!r} is no path: it holds a null character')
    expanded = os.path.expanduser(text)
    home = Path(text).parts[0] if text.startswith('~') else ''
    # users of services may have a home folder that nobody made, where nothing is to be written
    if expanded.startswith('~') or (home[1:] and not os.path.isdir(os.path.expanduser(home))):
        whose = f'no home folder of a user {home[1:]!r}' if home[1:] else 'no home folder'
        raise PathError(f'{text!r} is no path, because there is {whose}; '
                        f'write {"./" + text!r} for a file of that name')
    return Path(expanded)


def folder_from_environment(variable: str, default: str) -> Path:
    """
    Return the folder that an environment variable names, or the default one.

    Parameters
    ----------
    variable : str
        Its value counts if it is an absolute path or begins with ``~``.
    default : str
        Likewise.

    Raises
    ------
    PathError
        See `expand_path`.

    """
    given = os.environ.get(variable, '')
    # of a relative one the meaning would change with the working folder
    return expand_path(given if given.startswith(('/', '~')) else default)


def file_stem(path: str | os.PathLike[str]) -> str:
    """Return what names of files made from a file begin with, also if it has no name itself."""
    if os.fspath(path) == STANDARD_INPUT:
        return 'stdin'
    there = expand_path(path)
    # the name of a pipe, such as /dev/fd/63, says nothing
    if there.parent == Path('/dev') or there.parent.name == 'fd':
        return 'stdin' if there.name in ('stdin', '0') else 'pipe'
    return there.stem
