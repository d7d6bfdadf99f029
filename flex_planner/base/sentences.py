"""Sentences put together from parts."""

from __future__ import annotations

from collections.abc import Sequence


def say_reason(status: str, reason: str) -> str:
    """
    Return a status with its reason, saying nothing twice.

    Parameters
    ----------
    status : str
        In words, such as ``'canceled'``.
    reason : str
        Sentences separated by ``'; '``, some of which may repeat the status or each other.

    """
    parts = [part for part in dict.fromkeys(reason.split('; ')) if part not in ('', status)]
    if parts and parts[0].startswith(status):
        return '; '.join(parts)
    return ': '.join(part for part in (status, '; '.join(parts)) if part)


def say_os_error(error: OSError) -> str:
    """Return what the system says, and of which file, without numbers."""
    files = [str(name) for name in (error.filename, error.filename2) if name is not None]
    return ': '.join([*files, error.strerror or str(error)])


def join_words(words: Sequence[str], last: str) -> str:
    """Return words in a row, with a word such as ``or`` before the last."""
    if len(words) < 2:
        return ''.join(words)
    return f'{", ".join(words[:-1])} {last} {words[-1]}'


def count_of(count: int, singular: str) -> str:
    """Return a number of things, such as ``1 number`` and ``2 numbers``."""
    return f'{count} {singular}' if count == 1 else f'{count} {singular}s'
