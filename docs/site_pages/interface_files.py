"""Files of messages, services and actions, read with their comments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
import re

_ENTRY = re.compile(r'(?P<type>[\w/]+(?:\[\d*\])?)\s+(?P<name>\w+)\s*(?:=\s*(?P<value>[^\s#]+))?'
                    r'\s*(?:#\s*(?P<comment>.*))?')
KINDS = ('msg', 'srv', 'action')
PARTS = {'msg': ('',), 'srv': ('Request', 'Response'), 'action': ('Goal', 'Result', 'Feedback')}


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """
    A field, or a constant.

    Attributes
    ----------
    type_name, name : str
        As the file has them.
    value : str
        Of a constant; empty for a field.
    comment : str
        Of its line.

    """

    type_name: str
    name: str
    value: str
    comment: str


@dataclass(slots=True, kw_only=True)
class Group:
    """
    Entries that one comment is about.

    Attributes
    ----------
    comment : list of str
        Its lines.
    entries : list of Entry
        None where a comment stands alone.

    """

    comment: list[str] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class Interface:
    """
    A message, service or action.

    Attributes
    ----------
    kind, name : str
        `kind` is one of KINDS.
    parts : dict
        Groups by the title of their part.

    """

    kind: str
    name: str
    parts: dict[str, list[Group]]


def read_interfaces(folder: Path) -> list[Interface]:
    """Return all interfaces of a package in the order of KINDS and names."""
    files = [path for kind in KINDS for path in sorted(folder.glob(f'{kind}/*.{kind}'))]
    return [read_interface(path) for path in files]


def read_interface(path: Path) -> Interface:
    """Return what a file defines."""
    kind = path.suffix[1:]
    texts = re.split(r'^---$', path.read_text(encoding='utf-8'), flags=re.MULTILINE)
    parts = dict(zip(PARTS[kind], map(_groups, texts), strict=True))
    return Interface(kind=kind, name=path.stem, parts=parts)


def _groups(text: str) -> list[Group]:
    """Return the groups of a part: a blank line, or a comment after entries, begins another."""
    groups = [Group()]
    for line in map(str.rstrip, text.splitlines()):
        comment, last = line.startswith('#'), groups[-1]
        if (not line and (last.comment or last.entries)) or (comment and last.entries):
            groups.append(Group())
        if comment:
            groups[-1].comment.append(line[1:].removeprefix(' '))
        elif line:
            groups[-1].entries.append(_entry(line))
    return [group for group in groups if group.comment or group.entries]


def _entry(line: str) -> Entry:
    """Return what a line defines."""
    match = _ENTRY.fullmatch(line)
    if match is None:
        raise ValueError(f'{line!r} defines nothing')
    found = match.groupdict(default='')
    return Entry(type_name=found['type'], name=found['name'], value=found['value'],
                 comment=found['comment'])


def paragraphs(comment: list[str]) -> Iterator[tuple[bool, str]]:
    """Return the paragraphs of a comment, and whether they are indented and keep their lines."""
    block: list[str] = []
    indented = False
    for line in [*comment, '']:
        inside = line.startswith('  ')
        if block and (not line or inside != indented):
            yield indented, '\n'.join(block) if indented else ' '.join(block)
            block = []
        if line:
            indented = inside
            block.append(line if inside else line.strip())
