"""
Numbers as people write them, in files and on command lines.

Programs differ in what they read where a decimal number has leading zeros, colons or underscores:
YAML 1.1 takes 010 for 8 and 1:30 for 90. What is ambiguous is refused instead of guessed.

"""

from __future__ import annotations

import math
import re

from flex_planner.base.errors import FlexPlannerError

INTEGER = re.compile(r'[-+]?[0-9]+')
DECIMAL = re.compile(r'[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?')
SPECIAL = re.compile(r'[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)')
# leading zeros; other bases; sexagesimal; digits in groups
AMBIGUOUS = re.compile(r'[-+]?(0[0-9]+|0[xXoObB][0-9a-fA-F_]+|[0-9][0-9_]*(:[0-9]+)+(\.[0-9_]*)?|'
                       r'[0-9](?=[0-9]*_)[0-9_]*(\.[0-9_]*)?([eE][-+]?[0-9_]+)?|'
                       r'[0-9]+\.[0-9]*_[0-9_]*([eE][-+]?[0-9_]+)?)')
_MOST_DIGITS = 15  # of an integer that a float holds exactly


class NumberTextError(FlexPlannerError):
    """A text is no number, or one that could be read in two ways; the message is what to write."""


def read_number(text: str) -> int | float:
    """
    Return the number that a text says in decimal notation.

    Parameters
    ----------
    text : str
        Such as 10, -0.5, 7e10, .inf or inf.

    Raises
    ------
    NumberTextError
        If it is no number, is ambiguous, or too large or small for a float.

    """
    if AMBIGUOUS.fullmatch(text):
        raise NumberTextError(f'a plain decimal number{_plain(text)}')
    if INTEGER.fullmatch(text) and len(text) <= _MOST_DIGITS:
        return int(text)
    if DECIMAL.fullmatch(text):
        return _finite(text)
    word = text.lower().replace('.', '', 1)
    if SPECIAL.fullmatch(text) or word.lstrip('+-') in ('inf', 'infinity', 'nan'):
        return float(word)
    raise NumberTextError('a number')


def _finite(text: str) -> float:
    """Return a float, unless it is one only by overflow or underflow."""
    value = float(text)
    if math.isinf(value):
        raise NumberTextError('a number below 1e308; .inf is infinity')
    if value == 0 and re.search('[1-9]', re.split('[eE]', text)[0]):
        raise NumberTextError('0 or a number above 1e-308')
    return value


def _plain(text: str) -> str:
    """Return how to write what was probably meant, empty where that is not clear."""
    digits = text.replace('_', '')
    if not DECIMAL.fullmatch(digits):
        return ', without colons' if ':' in text else ''
    return f', such as {float(digits):g}'
