"""
YAML files in physical quantities, read strictly.

A key that is given twice, or that nobody reads, is an error: a misspelt quantity is never silently
left out.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import math
from pathlib import Path
from typing import Any

from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.suggestions import did_you_mean, nearest_name
from flex_planner.base.text import printable
from flex_planner.base.text_files import read_text, say_file, TextFileError
from flex_planner.base.validation import number
from flex_planner.base.yaml_text import parse_yaml, YamlTextError

# of names, for one in a file to be meant by one that is missing: other fields are alike, too
_ALIKE = 0.8


class YamlFileError(FlexPlannerError):
    """A file cannot be read or is no plain YAML; the message names it."""


def read_yaml(path: Path) -> tuple[str, object]:
    """
    Return the text of a file, pipe or the standard input (``-``), and what it says.

    Raises
    ------
    YamlFileError
        If it cannot be read, is empty or too large, is no plain YAML, or has a key twice.

    """
    try:
        text = read_text(path)
        return text, parse_yaml(text)
    except TextFileError as error:
        raise YamlFileError(str(error)) from None
    except YamlTextError as error:
        raise YamlFileError(f'{say_file(path)}: cannot be read: {error}') from None


class YamlSection:
    """
    A mapping of a file that knows its path and which keys were read.

    Parameters
    ----------
    path : str
        Of the mapping in the file, e.g. ``links[1]``; empty for the file itself.
    content : object
        What the file says there.

    Raises
    ------
    InvalidValueError
        If it is no mapping.

    """

    def __init__(self, path: str, content: object) -> None:
        if not isinstance(content, Mapping):
            raise InvalidValueError(path or 'the file', content, 'a mapping of fields')
        self.path = path
        self._left: dict[Any, Any] = dict(content)
        self._fields: set[str] = set()  # that somebody asked for

    def name(self, key: str) -> str:
        """Return the path of a field."""
        return f'{self.path}.{key}' if self.path else key

    def has(self, key: str) -> bool:
        """Return whether a field is given and not read yet."""
        self._fields.add(key)
        return key in self._left

    def left(self) -> list[Any]:
        """Return the keys that are not read yet, in their order."""
        return list(self._left)

    def take(self, key: str, default: Any = None) -> Any:
        """Return a field; without a default it must be there."""
        self._fields.add(key)
        if key not in self._left and default is None:
            raise InvalidValueError(self.name(key), None, f'given{self.misspelt(key)}')
        return self._left.pop(key, default)

    def number(self, key: str, default: float | None = None, *, above: float = -math.inf,
               at_least: float = -math.inf, at_most: float = math.inf, unit: str = '') -> float:
        """Return a number, checked here because others are computed from it."""
        return number(self.name(key), self.take(key, default), above=above, at_least=at_least,
                      at_most=at_most, unit=unit)

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text field."""
        value = self.take(key, default)
        if not isinstance(value, str):
            raise InvalidValueError(self.name(key), value, 'text')
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Return a field that is true or false."""
        self._fields.add(key)
        value = self._left.pop(key, default)
        if not isinstance(value, bool):
            raise InvalidValueError(self.name(key), value, 'true or false')
        return value

    def section(self, key: str, default: object = None) -> YamlSection:
        """Return a mapping inside this one."""
        return YamlSection(self.name(key), self.take(key, default))

    def sections(self, key: str, optional: bool = False) -> Iterator[YamlSection]:
        """Return the entries of a list of mappings."""
        entries = self.take(key, () if optional else None)
        if not isinstance(entries, Sequence) or isinstance(entries, str):
            raise InvalidValueError(self.name(key), entries, 'a list')
        return (YamlSection(f'{self.name(key)}[{i}]', entry) for i, entry in enumerate(entries))

    def finish(self) -> None:
        """Refuse fields that nobody read."""
        for key in self._left:
            raise InvalidValueError(self.name(str(key)), self._left[key],
                                    'left out: there is no such field'
                                    f'{did_you_mean(key, self._fields)}')

    def misspelt(self, *keys: str) -> str:
        """Return, in words, the unread key that a missing field may stand under, or nothing."""
        left = [one for one in self._left if isinstance(one, str)]
        found = [near for key in keys if (near := nearest_name(key, left, _ALIKE))]
        return f'; or is that what {printable(found[0])} is meant to be?' if found else ''

    def build(self, kind: Any, **values: Any) -> Any:
        """Construct a part; its errors name the field by its path."""
        self.finish()
        try:
            return kind(**values)
        except InvalidValueError as error:
            raise type(error)(self.name(error.field), error.value, error.bound) from None
