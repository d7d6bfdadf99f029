"""Markdown pages: headings, links and blocks of code, and a reader who does what they say."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, ExitStack, redirect_stdout
from dataclasses import dataclass
import io
import os
from pathlib import Path
import re
import shlex
import signal
import subprocess
import textwrap
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / 'docs'
PAGES = [*ROOT.glob('*.md'), *DOCS.glob('*.md'), *DOCS.glob('tutorials/*.md'),
         ROOT / 'examples' / 'README.md']
NODES = ('tools/run planner', 'tools/run arm_simulator')
LIMIT = 240.0  # [s], of a command on a machine that is busy
_BLOCK = re.compile(r'^```(?P<language>[\w-]*)\n(?P<text>.*?)^```$', re.MULTILINE | re.DOTALL)
_SAID = re.compile(r'^print\(.*\)  # (.*)$', re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """
    A fenced block of code.

    Attributes
    ----------
    language : str
        After the fence.
    text : str
        With its line ends.

    """

    language: str
    text: str

    @property
    def file_name(self) -> str:
        """Return the name in a first line such as ``# ask.py``; empty if there is none."""
        match = re.match(r'# (\w+\.\w+)\n', self.text)
        return match[1] if match else ''


def read_blocks(page: Path) -> list[Block]:
    """Return the blocks of a page."""
    return [Block(language=match['language'], text=match['text'])
            for match in _BLOCK.finditer(page.read_text(encoding='utf-8'))]


def prose(page: Path) -> str:
    """Return a page without its blocks."""
    return _BLOCK.sub('', page.read_text(encoding='utf-8'))


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as hosts of Markdown and the site make them."""
    return set(_anchors(prose(page)))


def _anchors(text: str) -> Iterator[str]:
    """Return the anchors of headings; a repeated one is numbered."""
    known: dict[str, int] = {}
    for title in re.findall(r'^#+ (.*)$', text, re.MULTILINE):
        words = re.sub(r'\[([^\]]*)\]\([^)]*\)', r'\1', title).strip().lower()
        slug = re.sub(r'[^\w\- ]', '', words).replace(' ', '-')
        count = known.get(slug, 0)
        known[slug] = count + 1
        yield f'{slug}-{count}' if count else slug


class Follower(ExitStack):
    """
    Somebody who does what a page says, block by block; nodes run until the end.

    Parameters
    ----------
    folder : Path
        An empty one, to be the checkout.

    """

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        self._names: dict[str, Any] = {}
        for name in ('config', 'docs', 'examples', 'tools'):
            (folder / name).symlink_to(ROOT / name)

    def follow(self, block: Block) -> bool:
        """Do what a block says, and return whether it says anything."""
        if block.file_name:
            (self._folder / block.file_name).write_text(block.text, encoding='utf-8')
        elif block.language == 'python':
            self._execute(block.text)
        elif block.language == 'console':
            for command, *said in _commands(block.text):
                self._call(command, said)
        else:
            return False
        return True

    def _execute(self, code: str) -> None:
        """Execute code after that of earlier blocks, and compare what it prints."""
        output = io.StringIO()
        with _inside(self._folder), redirect_stdout(output):
            exec(compile(code, 'block', 'exec'), self._names)
        compare(_SAID.findall(code), output.getvalue())

    def _call(self, command: str, said: list[str]) -> None:
        """Run a command, or start a node, and compare what it prints."""
        if command.startswith(NODES):
            self._start(command)
            return
        run = subprocess.run(['bash', '-c', command], cwd=self._folder, text=True, timeout=LIMIT,
                             capture_output=True, check=False)
        assert run.returncode == 0, f'{command}: {run.stdout}{run.stderr}'
        compare(said, run.stdout)

    def _start(self, command: str) -> None:
        """Start a node that ends with this."""
        log = self._folder / f'{shlex.split(command)[1]}.txt'
        node = subprocess.Popen(shlex.split(command), cwd=self._folder, stderr=subprocess.STDOUT,
                                stdout=self.enter_context(log.open('w')), env=dict(os.environ))
        self.callback(_end, node, log)


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    """Work in a folder."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _end(node: subprocess.Popen[bytes], log: Path) -> None:
    """End a node, which must have been at work until then."""
    died = node.poll() is not None
    node.send_signal(signal.SIGINT)
    try:
        node.wait(60)
    finally:
        node.kill()
    assert not died, log.read_text()


def _commands(text: str) -> Iterator[list[str]]:
    """Return each command with the lines that it says."""
    lines: list[str] = []
    for line in text.splitlines():
        if line.startswith('$ ') and lines:
            yield lines
            lines = []
        lines.append(line.removeprefix('$ '))
    yield lines


def compare(expected: list[str], output: str) -> None:
    """Assert that expected lines occur, one after the other; ``...`` and blanks stand for any."""
    lines = iter([' '.join(line.split()) for line in output.splitlines()])
    for line in filter(str.strip, expected):
        words = ' '.join(textwrap.dedent(line).split())
        pattern = re.compile('.*'.join(map(re.escape, words.split('...'))))
        assert any(pattern.match(said) for said in lines), f'{line!r} is not said in: {output}'
