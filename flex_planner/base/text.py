"""
Texts and values from outside, made fit to be shown.

Nothing that is shown steers a terminal, breaks a line that it stands in, or goes on without end:
names come from files, and a file of one kilobyte can describe a value of a billion entries.

"""

from __future__ import annotations

from itertools import islice
from reprlib import Repr
import unicodedata

LONGEST_NAME = 200
LONGEST_VALUE = 200
LONGEST_MESSAGE = 2000

# control characters, formatting such as a change of the direction of writing, halves of characters
# (from names of files that are not UTF-8), and separators of lines
_STEERING = frozenset({'Cc', 'Cf', 'Cs', 'Zl', 'Zp'})
_JOINERS = '\u200c\u200d'  # belong to the spelling of words and emoji
_CUT = '...'


def printable(text: str, longest: int = LONGEST_MESSAGE, *, keep: str = '') -> str:
    """
    Return a text with what steers a terminal written as Python's escapes.

    Parameters
    ----------
    text : str
        From outside.
    longest : int
        Number of characters from which on the middle is left out.
    keep : str
        Characters that stay as they are, such as those that end lines.

    """
    shown = text if len(text) <= longest else _cut(text, longest)
    shown = ''.join(_escape(one, keep) for one in shown)
    return shown if len(shown) <= longest else _cut(shown, longest)


def shown_value(value: object, longest: int = LONGEST_VALUE) -> str:
    """Return a value as Python writes it, in one line, cut where it is long or deep."""
    if isinstance(value, str):  # reprlib would look at the quotes only
        return printable(repr(_cut(value, longest)), longest + len(_CUT))
    return printable(' '.join(_BRIEF.repr(value).split()), longest)


def _escape(character: str, keep: str) -> str:
    if (character in keep or character in _JOINERS
            or unicodedata.category(character) not in _STEERING):
        return character
    return character.encode('unicode_escape').decode('ascii')


def _cut(text: str, longest: int) -> str:
    """Return a text without its middle if it is too long."""
    if len(text) <= longest:
        return text
    end = (longest - len(_CUT)) // 2
    return f'{text[:longest - len(_CUT) - end]}{_CUT}{text[len(text) - end:]}'


class _Brief(Repr):
    """Python's notation of values, with less of those that are long, deep or endless."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = 3
        self.maxtuple = self.maxlist = self.maxset = self.maxfrozenset = self.maxdeque = 8
        self.maxdict = 4
        self.maxstring = self.maxother = LONGEST_VALUE

    def repr_int(self, x: int, level: int) -> str:
        """Return an integer; Python refuses to write out the digits of a huge one."""
        bits = x.bit_length()
        return repr(x) if bits <= 4 * self.maxlong else f'an integer of {bits} bits'

    def repr_dict(self, x: dict[object, object], level: int) -> str:
        """Return a mapping in its order; reprlib would sort it."""
        if level <= 0:
            return '{...}'
        pairs = [f'{self.repr1(key, level - 1)}: {self.repr1(entry, level - 1)}'
                 for key, entry in islice(x.items(), self.maxdict)]
        return f'{{{", ".join(pairs + [_CUT] * (len(x) > self.maxdict))}}}'


_BRIEF = _Brief()
