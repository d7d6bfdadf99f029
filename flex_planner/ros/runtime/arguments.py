"""
The command line of a node: what ROS would not read, or would leave out without a word.

The parser of rcl refuses lists such as ``[1, 2.5]``, and passes over files whose keys name other
nodes or other namespaces.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
import re
from tempfile import TemporaryDirectory

import yaml

_PARAMETERS = 'ros__parameters'
_INTEGER = re.compile(r'[-+]?(0|[1-9][0-9]*)')
_FLOAT = re.compile(r'[-+]?(\d+\.\d*([eE][-+]?\d+)?|\d+[eE][-+]?\d+|\.\d+([eE][-+]?\d+)?|\.inf)',
                    re.IGNORECASE)
_NAME = re.compile(r'(?:[^:]+:)?__(node|name|ns):=(.*)')


@contextmanager
def readable_arguments(arguments: Sequence[str]) -> Iterator[list[str]]:
    """
    Return a command line whose numbers rcl reads, for as long as its files are needed.

    Parameters
    ----------
    arguments : sequence of str
        Of the process; those after ``--ros-args`` count.

    """
    with TemporaryDirectory(prefix='flex_planner_') as folder:
        found = list(arguments)
        for index, kind in _values(found):
            if kind == 'file':
                found[index] = _readable_file(Path(found[index]), Path(folder, f'{index}.yaml'))
            elif kind == 'parameter':
                name, rule, value = found[index].partition(':=')
                found[index] = name + rule + with_floats(value)
        yield found


def with_floats(text: str) -> str:
    """Return YAML text whose lists of whole and other numbers have decimal points everywhere."""
    root = _compose(text)
    points = sorted(_missing_points(root), reverse=True) if root else ()
    for place in points:
        text = f'{text[:place]}.0{text[place:]}'
    return text


def unused_files(arguments: Sequence[str], node: str) -> list[str]:
    """
    Return a sentence for each file of parameters that has none for a node.

    Parameters
    ----------
    arguments : sequence of str
        Of the process.
    node : str
        Name of the node, unless the arguments give another.

    """
    full, sentences = _full_name(arguments, node), []
    for index, kind in _values(arguments):
        keys = _node_keys(Path(arguments[index])) if kind == 'file' else []
        if keys and not any(_matches(key, full) for key in keys):
            sentences.append(
                f'{arguments[index]} has no parameters for {full}, only for {", ".join(keys)}: '
                f'nothing of it is used here. A key /**/{full.rpartition("/")[2]}: counts in '
                'every namespace')
    return sentences


def _values(arguments: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Yield the places of files, parameters and rules among the arguments."""
    kinds = {'--params-file': 'file', '-p': 'parameter', '--param': 'parameter', '-r': 'rule',
             '--remap': 'rule'}
    ours = False
    for index, argument in enumerate(arguments):
        if argument in ('--ros-args', '--'):
            ours = argument == '--ros-args'
        elif ours and index and arguments[index - 1] in kinds:
            yield index, kinds[arguments[index - 1]]


def _full_name(arguments: Sequence[str], node: str) -> str:
    """Return the full name of a node that is started with some arguments."""
    name, space = node, ''
    for index, kind in _values(arguments):
        match = _NAME.fullmatch(arguments[index]) if kind == 'rule' else None
        if match and match[1] == 'ns':
            space = match[2].strip('/')
        elif match:
            name = match[2]
    return f'/{space}/{name}' if space else f'/{name}'


def _readable_file(path: Path, copy: Path) -> str:
    """Return the path of a file that rcl reads: the file itself, or a changed copy."""
    text = _text(path)
    changed = with_floats(text)
    if changed == text:
        return str(path)
    copy.write_text(changed, encoding='utf-8')
    return str(copy)


def _text(path: Path) -> str:
    """Return the text of a file, empty where rcl has to say what is wrong with it."""
    try:
        return path.read_text(encoding='utf-8')
    except (OSError, ValueError):
        return ''


def _compose(text: str) -> yaml.Node | None:
    """Return the nodes of YAML text, none where rcl has to say what is wrong with it."""
    try:
        root: yaml.Node | None = yaml.compose(text, yaml.SafeLoader)
    except (yaml.YAMLError, RecursionError, ValueError):
        return None
    return root


def _missing_points(node: yaml.Node) -> Iterator[int]:
    """Yield the places where whole numbers among others end."""
    if isinstance(node, yaml.MappingNode):
        for _, value in node.value:
            yield from _missing_points(value)
    elif isinstance(node, yaml.SequenceNode):
        plain = [entry for entry in node.value
                 if isinstance(entry, yaml.ScalarNode) and entry.style is None]
        whole = [entry for entry in plain if _INTEGER.fullmatch(entry.value)]
        others = [entry for entry in plain if _FLOAT.fullmatch(entry.value)]
        if whole and others and len(whole) + len(others) == len(node.value):
            yield from (entry.end_mark.index for entry in whole)


def _node_keys(path: Path) -> list[str]:
    """Return the names of nodes that a file has parameters for."""
    root = _compose(_text(path))
    return list(_keys(root, '')) if root else []


def _keys(node: yaml.Node, path: str) -> Iterator[str]:
    if not isinstance(node, yaml.MappingNode):
        return
    for key, value in node.value:
        if key.value == _PARAMETERS:
            yield path
        else:
            yield from _keys(value, f'{path}/{str(key.value).strip("/")}')


def _matches(key: str, name: str) -> bool:
    """Return whether a key, which may have wildcards, stands for a node's full name."""
    pattern = re.escape(key).replace(r'/\*\*', r'(/\w+)*').replace(r'\*', r'\w+')
    return re.fullmatch(pattern, name) is not None
