"""
Convert any message object to the classes of a rosbags typestore.

A message is anything with the attributes that its definition names: an rclpy message, a rosbags
message, a namespace. Every value is checked here, because the encoders below and those of ROS
either wrap, truncate or crash on a value that does not fit.

"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Sized
from functools import lru_cache, partial
from typing import Any, cast, Final, TypeVar

from flex_planner.base.errors import InvalidValueError
import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.store import Typestore

# C++ forbids an empty struct, so ROS puts a byte of this name into an empty message.
PLACEHOLDER: Final = 'structure_needs_at_least_one_member'
DTYPES: Final = {
    'bool': np.dtype(np.bool_),
    'byte': np.dtype(np.int8),  # rosbags encodes a byte as signed
    **{name: np.dtype(name) for name in ('float32', 'float64')},
    **{f'int{bits}': np.dtype(f'int{bits}') for bits in (8, 16, 32, 64)},
    **{f'uint{bits}': np.dtype(f'uint{bits}') for bits in (8, 16, 32, 64)},
}
ACCEPTED_KINDS: Final = {'b': 'b', 'i': 'iu', 'u': 'iu', 'f': 'fiu'}
LONGEST_SHOWN: Final = 80  # characters
_SizedT = TypeVar('_SizedT', bound=Sized)
_Converter = Callable[[Any], Any]


def convert_message(store: Typestore, type_name: str, message: object, path: str) -> object:
    """
    Return the message as an instance of the typestore's class.

    Parameters
    ----------
    store : Typestore
        Definitions and classes.
    type_name : str
        Type of the message, known to the store.
    message : object
        The message, of any class with the right attributes.
    path : str
        Name of the message in errors, e.g. ``'JointTrajectory.points[0]'``.

    Raises
    ------
    InvalidValueError
        If a field is missing or its value does not fit its type.

    """
    try:
        return _convert_plain(store, type_name, message)
    except (_NotPlainError, AttributeError):
        values = [
            _field(store, description, _attribute(message, name, path), f'{path}.{name}')
            for name, description in store.fielddefs[type_name][1]
        ]
        return store.types[type_name](*values)


class _NotPlainError(Exception):
    """A value is none of those that most fields have, which are taken as they are."""


def _convert_plain(store: Typestore, type_name: str, message: object) -> object:
    """Return a message whose values all are plain, in half of the time."""
    values = [convert(getattr(message, name))
              for name, convert in _plain_converters(store, type_name)]
    return store.types[type_name](*values)


@lru_cache(maxsize=256)
def _plain_converters(store: Typestore, type_name: str) -> list[tuple[str, _Converter]]:
    """Return the fields of a type with what takes their plain values."""
    return [(name, _plain_converter(store, description))
            for name, description in store.fielddefs[type_name][1]]


def _plain_converter(store: Typestore, description: FieldDesc) -> _Converter:
    """Return what takes the plain values of a field."""
    if description[0] == Nodetype.NAME:
        return partial(_convert_plain, store, description[1])
    if description[0] == Nodetype.BASE:
        return _PLAIN.get(description[1], _refuse)
    item, size = cast(tuple[FieldDesc, int], description[1])
    if description[0] == Nodetype.ARRAY or size:
        return _refuse
    if item[0] == Nodetype.NAME:
        return partial(_plain_list, partial(_convert_plain, store, item[1]))
    if item == (Nodetype.BASE, ('string', 0)):
        return partial(_plain_list, _plain_text)
    return _plain_numbers if item == (Nodetype.BASE, ('float64', 0)) else _refuse


def _refuse(value: object) -> Any:
    raise _NotPlainError


def _plain_float(value: object) -> Any:
    if type(value) is not float:
        raise _NotPlainError
    return value


def _plain_integer(value: object) -> Any:
    if type(value) is not int or not 0 <= value < 2**31:
        raise _NotPlainError
    return value


def _plain_text(value: object) -> Any:
    if type(value) is not str or not value.isascii():
        raise _NotPlainError
    return value


def _plain_numbers(value: object) -> Any:
    if type(value) is not array or value.typecode != 'd':
        raise _NotPlainError
    return np.array(value)


def _plain_list(convert: _Converter, value: object) -> Any:
    if type(value) is not list:
        raise _NotPlainError
    return [convert(entry) for entry in value]


_PLAIN: Final[dict[object, _Converter]] = {
    ('float64', 0): _plain_float, ('int32', 0): _plain_integer, ('uint32', 0): _plain_integer,
    ('string', 0): _plain_text}


def _attribute(message: object, name: str, path: str) -> object:
    """Return a field's value."""
    if name == PLACEHOLDER:
        return 0
    if not hasattr(message, name):
        raise InvalidValueError(path, _excerpt(message), f'a message with the field {name!r}')
    return getattr(message, name)


def _field(store: Typestore, description: FieldDesc, value: object, path: str) -> Any:
    """Convert one field by the kind of its definition."""
    if description[0] == Nodetype.NAME:
        return convert_message(store, description[1], value, path)
    if description[0] == Nodetype.BASE:
        return _scalar(*cast(tuple[str, int], description[1]), value, path)
    item, size = cast(tuple[FieldDesc, int], description[1])
    exact = description[0] == Nodetype.ARRAY
    if item[0] == Nodetype.BASE and item[1][0] != 'string':
        return _check_size(_numbers(item[1][0], value, path), size, exact, path)
    items = _check_size(_items(value, path), size, exact, path)
    return [_field(store, item, entry, f'{path}[{i}]') for i, entry in enumerate(items)]


def _items(value: object, path: str) -> list[object]:
    """Return the entries of a sequence; a string is not one."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InvalidValueError(path, _excerpt(value), 'a sequence')
    return list(value)


def _check_size(values: _SizedT, size: int, exact: bool, path: str) -> _SizedT:
    """Return a sequence that keeps the bound of its definition; size 0 is none."""
    if exact and len(values) != size:
        raise InvalidValueError(f'length of {path}', len(values), f'{size}')
    if size and len(values) > size:
        raise InvalidValueError(f'length of {path}', len(values), f'at most {size}')
    return values


def _scalar(base: str, limit: int, value: object, path: str) -> object:
    """Return a string, or a number as Python's own type."""
    if base == 'string':
        return _string(value, limit, path)
    if base == 'byte' and isinstance(value, bytes):  # rclpy's way to hold one byte
        return int(_check_size(_numbers('byte', [value], path), 1, True, path)[0])
    # most of a recording are these two; the way through numpy takes ten times as long
    if type(value) is float and base == 'float64':
        return value
    if type(value) is int and base in ('int32', 'uint32') and 0 <= value < 2**31:
        return value
    return _numbers(base, [value], path)[0].item()


def _string(value: object, limit: int, path: str) -> str:
    """Return a string that can be encoded and keeps the bound of its definition."""
    if not isinstance(value, str):
        raise InvalidValueError(path, _excerpt(value), 'a string')
    try:
        size = len(value.encode())
    except UnicodeEncodeError:
        raise InvalidValueError(path, value, 'text that UTF-8 can hold') from None
    if limit and size > limit:
        raise InvalidValueError(f'length of {path}', size, f'at most {limit} bytes')
    return value


def _numbers(base: str, value: object, path: str) -> NDArray[Any]:
    """Return a vector of the type that a definition names, without rounding or wrapping."""
    if base == 'float64' and isinstance(value, array) and value.typecode == 'd':
        return np.array(value)
    dtype = DTYPES[base]
    numbers = _vector(value, path)
    if numbers.size and numbers.dtype.kind not in ACCEPTED_KINDS[dtype.kind]:
        raise InvalidValueError(path, _excerpt(value), f'of type {base}')
    if numbers.size and dtype.kind in 'iu':
        bounds = np.iinfo(dtype)
        low, high = int(numbers.min()), int(numbers.max())
        if low < bounds.min or high > bounds.max:
            wrong = low if low < bounds.min else high
            raise InvalidValueError(path, wrong, f'in [{bounds.min}, {bounds.max}] ({base})')
    try:
        with np.errstate(over='raise'):
            return np.ascontiguousarray(numbers, dtype)
    except FloatingPointError:
        raise InvalidValueError(path, _excerpt(value), f'within the range of {base}') from None


def _vector(value: object, path: str) -> NDArray[Any]:
    """Return numbers as a vector; bytes count as numbers."""
    try:
        if isinstance(value, list) and value and isinstance(value[0], bytes):
            value = np.frombuffer(b''.join(value), np.int8)
        elif isinstance(value, bytes | bytearray):
            value = np.frombuffer(value, np.uint8)
        numbers = np.asarray(value)
    except (TypeError, ValueError):
        raise InvalidValueError(path, _excerpt(value), 'a sequence of numbers') from None
    if numbers.ndim != 1:
        raise InvalidValueError(path, _excerpt(value), 'a sequence of numbers')
    return numbers


def _excerpt(value: object) -> object:
    """Return a short value itself, of a long one its type, for errors."""
    if isinstance(value, list) and len(value) == 1:
        return value[0]
    return value if len(repr(value)) < LONGEST_SHOWN else type(value)
