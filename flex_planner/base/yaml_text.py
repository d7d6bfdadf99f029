"""
YAML as people mean it: decimal numbers, true and false, plain mappings and lists.

PyYAML follows YAML 1.1, which reads 010 as 8, 1:30 as 90, `no` as false and 7e10 as text. Here
scalars are those of YAML 1.2, and numbers that the two versions read differently are refused. So
are keys given twice, documents after the first, tags, and aliases that multiply without end.

"""

from __future__ import annotations

from collections.abc import Iterator
import re
from typing import Any, ClassVar

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.number_texts import (
    AMBIGUOUS,
    DECIMAL,
    INTEGER,
    NumberTextError,
    read_number,
    SPECIAL,
)
import yaml

_MAX_ENTRIES, _MAX_DEPTH, _SHOWN = 100_000, 50, 60
_TAG = 'tag:yaml.org,2002:'
_AMBIGUOUS = '!ambiguous'
_SIGNS = list('-+.0123456789')


class YamlTextError(FlexPlannerError):
    """A text is no plain YAML; the message names the line."""


def parse_yaml(text: str) -> Any:
    """
    Return what a YAML text says.

    Raises
    ------
    YamlTextError
        If it is no plain YAML, see above.

    """
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _count_entries(node, {})
        return loader.construct_document(node)
    except yaml.YAMLError as error:
        raise YamlTextError(_sentence(error)) from None
    except RecursionError:
        raise YamlTextError(f'it is nested deeper than {_MAX_DEPTH} levels') from None


def format_yaml(content: object) -> str:
    """Return plain values as YAML that versions 1.1 and 1.2 read alike."""
    text: str = yaml.dump(content, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    return text


class _Loader(yaml.SafeLoader):
    """Constructs what is plain."""

    yaml_implicit_resolvers: dict[Any, Any] = {}
    yaml_constructors: ClassVar[dict[Any, Any]] = {}

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping of text; PyYAML itself would keep the last of equal keys silently."""
        given = set[str]()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _error(key, 'a list or a mapping is no name of a field')
            if key.value in given:
                raise _error(key, f'field {_cut(key.value)!r} is given twice')
            given.add(key.value)
        self.flatten_mapping(node)
        return {key.value: self.construct_object(value, deep=deep) for key, value in node.value}

    def construct_number(self, node: yaml.ScalarNode) -> int | float:
        """Return a number; a ScalarNode that is tagged as one may hold anything."""
        try:
            return read_number(node.value)
        except NumberTextError as error:
            quotes = '; put text in quotes' if node.tag == _AMBIGUOUS else ''
            raise _error(node, f'{_cut(node.value)} must be {error}{quotes}') from None

    def construct_flag(self, node: yaml.ScalarNode) -> bool:
        """Return true or false."""
        if node.value.lower() not in ('true', 'false'):
            raise _error(node, f'{_cut(node.value)} must be true or false')
        return bool(node.value.lower() == 'true')

    def construct_text(self, node: yaml.ScalarNode) -> str:
        """Return text; half of a character, which YAML can write, is none."""
        text = str(self.construct_scalar(node))
        if any('\ud800' <= character <= '\udfff' for character in text):
            raise _error(node, 'the text has halves of characters, such as "\\ud800"')
        return text

    def refuse(self, node: yaml.Node) -> None:
        """Refuse a tag."""
        tag = node.tag.replace(_TAG, '!!')
        raise _error(node, f'the tag {_cut(tag)} has no meaning here')


for _tag, _pattern, _first in (
        # the first that matches counts
        (_AMBIGUOUS, AMBIGUOUS, _SIGNS),
        (_TAG + 'int', INTEGER, _SIGNS),
        (_TAG + 'float', DECIMAL, _SIGNS),
        (_TAG + 'float', SPECIAL, _SIGNS),
        (_TAG + 'bool', re.compile('true|True|TRUE|false|False|FALSE'), list('tTfF')),
        (_TAG + 'null', re.compile('~|null|Null|NULL|'), ['~', 'n', 'N', '']),
        (_TAG + 'merge', re.compile('<<'), ['<'])):
    _Loader.add_implicit_resolver(_tag, re.compile(f'(?:{_pattern.pattern})$'), _first)
for _tag in ('null', 'seq', 'map'):
    _Loader.add_constructor(_TAG + _tag, yaml.SafeLoader.yaml_constructors[_TAG + _tag])
for _tag in (_TAG + 'int', _TAG + 'float', _AMBIGUOUS):
    _Loader.add_constructor(_tag, _Loader.construct_number)
_Loader.add_constructor(_TAG + 'bool', _Loader.construct_flag)
_Loader.add_constructor(_TAG + 'str', _Loader.construct_text)
_Loader.add_constructor(None, _Loader.refuse)


class _Dumper(yaml.SafeDumper):
    """Puts text in quotes that either version of YAML would take for something else."""

    def ignore_aliases(self, data: object) -> bool:
        """Write what two fields share twice."""
        return True

    def represent_text(self, text: str) -> yaml.Node:
        """Write halves of characters, which names of files may hold, as escapes."""
        return self.represent_str(text.encode('utf-8', 'backslashreplace').decode())


_Dumper.add_representer(str, _Dumper.represent_text)

for _pattern in (AMBIGUOUS, DECIMAL):
    _Dumper.add_implicit_resolver(_AMBIGUOUS if _pattern is AMBIGUOUS else _TAG + 'float',
                                  re.compile(f'(?:{_pattern.pattern})$'), _SIGNS)


def _cut(text: str) -> str:
    """Return a text for a message, shortened if it is long."""
    return text if len(text) <= _SHOWN else f'{text[:_SHOWN]}...'


def _error(node: yaml.Node, problem: str) -> yaml.MarkedYAMLError:
    """Return an error at a place."""
    return yaml.constructor.ConstructorError(None, None, problem, node.start_mark)


def _count_entries(node: yaml.Node, known: dict[int, int], depth: int = 0) -> int:
    """Return how many entries there are once aliases are followed, unless that is too many."""
    if depth > _MAX_DEPTH:
        raise _error(node, f'nested deeper than {_MAX_DEPTH} levels')
    if id(node) not in known:
        count = 1 + sum(_count_entries(part, known, depth + 1) for part in _parts(node))
        if count > _MAX_ENTRIES:
            raise _error(node, f'more than {_MAX_ENTRIES} entries')
        known[id(node)] = count
    return known[id(node)]


def _parts(node: yaml.Node) -> Iterator[yaml.Node]:
    """Yield the entries of a list, or the keys and values of a mapping."""
    if isinstance(node, yaml.SequenceNode):
        yield from node.value
    elif isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield from (key, value)


def _sentence(error: yaml.YAMLError) -> str:
    """Return an error of PyYAML, which fills several lines, as a sentence."""
    if isinstance(error, yaml.reader.ReaderError):
        return (f'the character U+{error.character:04X} at position {error.position + 1} is not '
                'allowed in YAML')
    problem = ' '.join(str(getattr(error, 'problem', None) or error).split())
    problem = problem.replace("'<stream end>'", 'the end of the file').replace(
        'end of stream', 'end of the file').replace("'\\x00'", 'nothing')
    if isinstance(error, yaml.composer.ComposerError) and 'document' in problem:
        problem = 'a second document begins, but a file holds one'
    if "'\\t'" in problem:
        problem = 'a tab stands where YAML wants spaces'
    mark = getattr(error, 'problem_mark', None)
    return f'line {mark.line + 1}, column {mark.column + 1}: {problem}' if mark else problem
