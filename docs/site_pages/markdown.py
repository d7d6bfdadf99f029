"""Text as Markdown that shows it letter by letter."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import re

_SPECIAL = re.compile(r'([\\`*_{}\[\]<>$|#~^])')


def escape(text: str) -> str:
    """Return a text whose letters mean nothing to Markdown."""
    return _SPECIAL.sub(r'\\\1', text)


def code(text: str) -> str:
    """Return a text as inline code, also inside of a table."""
    return f'`{text}`'.replace('|', r'\|')


def definition(term: str, paragraphs: Sequence[str]) -> list[str]:
    """Return the lines of an entry of a definition list."""
    first, *others = paragraphs or ['\u00a0']
    lines = [term, f': {first}']
    for paragraph in others:
        lines += ['', *(f'  {line}' if line else '' for line in paragraph.splitlines())]
    return [*lines, '']


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table."""
    lines = [list(head), ['---'] * len(head), *map(list, rows)]
    return [f'| {" | ".join(line)} |' for line in lines] + ['']
