"""
YAML files in physical quantities, read strictly.

A key that is given twice, or that nobody reads, is an error: a misspelt quantity is never silently
left out.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import math
from pathlib import Path
import re
from typing import Any

from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.text import shown_value
from flex_planner.base.validation import number
import yaml

_MAX_BYTES = 1_000_000


class YamlFileError(FlexPlannerError):
    """A file cannot be read or is no plain YAML; the message names it."""


def read_yaml(path: Path) -> tuple[str, object]:
    """
    Return the text of a file and what it says.

    Raises
    ------
    YamlFileError
        If it cannot be read, is too large, is no plain YAML, or has a key twice.

    """
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise YamlFileError(f'{path}: the file is larger than {_MAX_BYTES} bytes')
        text = path.read_text(encoding='utf-8')
        return text, yaml.load(text, _StrictLoader)
    except (OSError, ValueError, RecursionError, yaml.YAMLError) as error:
        reason = ' '.join(str(error).split())
        raise YamlFileError(f'{path}: cannot be read: {reason}') from None


class _StrictLoader(yaml.SafeLoader):
    """YAML in which a key may be given once only."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping; PyYAML itself would keep the last of equal keys silently."""
        seen: set[str] = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                continue  # a list or a mapping is no key, which PyYAML says
            if key.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f'field {shown_value(key.value)} is given twice', key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)


# YAML 1.1, which PyYAML reads, takes 7e10 and 7.0e10 for text
_StrictLoader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$'),
    list('-+.0123456789'))


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

    def name(self, key: str) -> str:
        """Return the path of a field."""
        return f'{self.path}.{key}' if self.path else key

    def has(self, key: str) -> bool:
        """Return whether a field is given and not read yet."""
        return key in self._left

    def left(self) -> list[Any]:
        """Return the keys that are not read yet, in their order."""
        return list(self._left)

    def take(self, key: str, default: Any = None) -> Any:
        """Return a field; without a default it must be there."""
        if key not in self._left and default is None:
            raise InvalidValueError(self.name(key), None, 'given')
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
                                    'left out: there is no such field')

    def build(self, kind: Any, **values: Any) -> Any:
        """Construct a part; its errors name the field by its path."""
        self.finish()
        try:
            return kind(**values)
        except InvalidValueError as error:
            raise type(error)(self.name(error.field), error.value, error.bound) from None
