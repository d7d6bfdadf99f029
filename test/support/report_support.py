"""Recordings to report on, and what a page holds."""

from __future__ import annotations

from html.parser import HTMLParser
import json
from pathlib import Path
from typing import Any

from flex_planner.cli import main

TASK = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1', '--effort-weights', '0.125,0.125',
        '--no-plot']


def recorded(folder: Path, *arguments: str) -> Path:
    main([*arguments, *TASK, '--output', str(folder)])
    (path,) = (folder / 'recordings').iterdir()
    return path


class Page(HTMLParser):
    """Tags, and the text of scripts, of a page that opens and closes every element."""

    EMPTY = {'meta', 'br', 'link', 'img'}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert not self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.EMPTY:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == 'script':
            self.scripts.append(data)

    @property
    def data(self) -> dict[str, Any]:
        return dict(json.loads(self.scripts[0]))
