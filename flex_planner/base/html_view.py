"""Results as notebooks show them: a small table beside a picture, as HTML."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from flex_planner.base.text import printable

_CELL = 'text-align: left; padding: 2px 12px 2px 0; vertical-align: top'


def html_view(rows: Iterable[tuple[str, str]], picture: str = '') -> str:
    """
    Return names and values as a table, with a picture to the right of it.

    Parameters
    ----------
    rows : iterable of pairs of str
        Any text; it is escaped.
    picture : str
        SVG; empty for none.

    """
    lines = ''.join(f'<tr><th style="{_CELL}; font-weight: normal; opacity: 0.7">{_shown(name)}'
                    f'</th><td style="{_CELL}">{_shown(value)}</td></tr>' for name, value in rows)
    return ('<div style="display: flex; flex-wrap: wrap; gap: 16px; align-items: flex-start">'
            f'<table style="flex: 1 1 280px; max-width: 560px">{lines}</table>{picture}</div>')


def _shown(text: str) -> str:
    return escape(printable(text))
