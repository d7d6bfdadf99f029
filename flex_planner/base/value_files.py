"""
Values of known classes in one file: arrays as NumPy keeps them, all else as JSON beside them.

Reading runs no code from the file: only classes that the reader names are made, and arrays hold
numbers. Objects that several fields share are shared again after reading. A class with the methods
`reconstruction_arguments` and `reconstruct` is written by the former and made by the latter.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from enum import Enum
import json
import os
import threading
from typing import Any
import zipfile
import zlib

from flex_planner.base.errors import FlexPlannerError, ValueFileError
from flex_planner.base.paths import expand_path
from flex_planner.base.validation import Array
import numpy as np

_HEADER = 'values.json'
_FORMAT = 2


def save_value(path: str | os.PathLike[str], value: object) -> None:
    """
    Write a value to a file, whole or not at all.

    Parameters
    ----------
    path : path-like
        Of the file; it is replaced if it exists.
    value : object
        Numbers, strings, enums, tuples, arrays, and dataclasses or other objects of those.

    Raises
    ------
    TypeError
        If a value is of no such kind.
    OSError
        If the file cannot be written.

    """
    writer = _Writer()
    root = writer.encode(value)
    header = {'format': _FORMAT, 'objects': writer.objects, 'root': root}
    parts: dict[str, Any] = {_HEADER: np.array(json.dumps(header)), **writer.arrays}
    target = expand_path(path)
    partial = target.with_name(f'.{target.name}.{os.getpid()}.{threading.get_ident()}.partial')
    try:
        with partial.open('wb') as file:
            np.savez(file, **parts)
        os.replace(partial, target)
    finally:
        partial.unlink(missing_ok=True)


def load_value(path: str | os.PathLike[str], classes: Iterable[type]) -> object:
    """
    Return the value that a file holds.

    Parameters
    ----------
    path : path-like
        As `save_value` wrote it.
    classes : iterable of type
        Classes that may be made.

    Raises
    ------
    ValueFileError
        If the file is damaged, or holds something else.
    OSError
        If it cannot be read.

    """
    try:
        with expand_path(path).open('rb') as file, np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        header = json.loads(str(arrays.pop(_HEADER)))
        if header['format'] != _FORMAT:
            raise ValueFileError(f'{path} has format {header["format"]}, but must have {_FORMAT}')
        reader = _Reader({one.__name__: one for one in classes}, header['objects'], arrays)
        return reader.decode(header['root'])
    except ValueFileError:
        raise
    except (ArithmeticError, AttributeError, EOFError, FlexPlannerError, LookupError, MemoryError,
            NotImplementedError, RuntimeError, TypeError, ValueError, zipfile.BadZipFile,
            zlib.error) as error:
        raise ValueFileError(f'{path} is damaged or no file of saved values: {error}') from error


class _Writer:
    """Turns values into JSON and arrays."""

    def __init__(self) -> None:
        self.objects: list[Any] = []
        self.arrays: dict[str, Array] = {}
        self._known: dict[int, int] = {}
        self._kept: list[object] = []  # an id is good only while its object lives

    def encode(self, value: Any) -> Any:
        """Return a value as JSON."""
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, Enum):
            return {'enum': type(value).__name__, 'name': value.name}
        if isinstance(value, np.ndarray):
            if value.dtype.hasobject:
                raise TypeError('an array of objects cannot be saved: only numbers can')
            name = f'array_{len(self.arrays)}'
            self.arrays[name] = value
            return {'array': name}
        if isinstance(value, (tuple, list)):
            return {'tuple': [self.encode(entry) for entry in value]}
        if isinstance(value, dict):
            return {'dict': {key: self.encode(entry) for key, entry in value.items()}}
        if id(value) not in self._known:
            self._kept.append(value)
            entry = {'class': type(value).__name__, **self._state(value)}
            self._known[id(value)] = len(self.objects)
            self.objects.append(entry)
        return {'object': self._known[id(value)]}

    def _state(self, value: Any) -> dict[str, Any]:
        """Return the fields of a dataclass, or the state or arguments of another object."""
        arguments = getattr(value, 'reconstruction_arguments', None)
        if arguments is not None:
            return {'arguments': [self.encode(entry) for entry in arguments()]}
        if is_dataclass(value):
            return {'fields': {field.name: self.encode(getattr(value, field.name))
                               for field in fields(value)}}
        return {'state': self.encode(vars(value))}


class _Reader:
    """Makes values again."""

    def __init__(self, classes: dict[str, type], objects: list[Any],
                 arrays: dict[str, Array]) -> None:
        self._classes, self._objects, self._arrays = classes, objects, arrays
        self._made: dict[int, Any] = {}

    def decode(self, value: Any) -> Any:
        """Return the value that JSON stands for."""
        if not isinstance(value, dict):
            return value
        (kind, *_) = value
        if kind == 'enum':
            return self._classes[value['enum']][value['name']]  # type: ignore[index]
        if kind == 'array':
            return self._arrays[value['array']]
        if kind == 'tuple':
            return tuple(self.decode(entry) for entry in value['tuple'])
        if kind == 'dict':
            return {key: self.decode(entry) for key, entry in value['dict'].items()}
        index = value['object']
        if index not in self._made:
            self._made[index] = self._make(self._objects[index])
        return self._made[index]

    def _make(self, entry: dict[str, Any]) -> Any:
        """Return an object of one of the classes."""
        made: type[Any] = self._classes[entry['class']]
        if 'arguments' in entry:
            return made.reconstruct(*(self.decode(one) for one in entry['arguments']))
        if 'fields' in entry:
            return made(**{name: self.decode(one) for name, one in entry['fields'].items()})
        restored: Any = object.__new__(made)
        restored.__dict__.update(self.decode(entry['state']))
        return restored
