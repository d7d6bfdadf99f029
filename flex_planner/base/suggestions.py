"""What somebody meant who wrote a name that does not exist."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from flex_planner.base.text import printable

_SIMILAR = 0.7  # of names, for one to be meant by another
_LONGEST = 100  # of a name that could be meant: comparing takes its length times that of others


def nearest_name(name: object, known: Iterable[str], similar: float = _SIMILAR) -> str:
    """Return the known name that is most like a name, or an empty text if none is like it."""
    if not isinstance(name, str) or len(name) > _LONGEST:
        return ''
    names = {_plain(one): one for one in known}
    found = get_close_matches(_plain(name), names, 1, similar)
    return names[found[0]] if found else ''


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Return a question to end a message with, such as ``; did you mean length?``, or nothing."""
    nearest = nearest_name(name, known)
    return f'; did you mean {nearest}?' if nearest else ''


def one_of(name: object, known: Iterable[str]) -> str:
    """Return what a name must be, in words: one of those that are known, and which is meant."""
    names = list(known)
    return f'one of {", ".join(map(printable, names))}{did_you_mean(name, names)}'


def _plain(name: str) -> str:
    """Return a name without what people mix up: capitals, and - for _."""
    return name.lower().replace('-', '_').strip(' _')
