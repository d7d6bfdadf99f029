"""Checks that turn a bad value into one sentence: field, value and bound."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import math
from typing import Any

from flex_planner.base.errors import InvalidSizeError, InvalidValueError, NotFiniteError
from flex_planner.base.sentences import count_of
from flex_planner.base.text import printable
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_MOST_ENTRIES, _DEEPEST = 100_000, 8


def number(
    field: str,
    value: object,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    at_most: float = math.inf,
    infinite: bool = False,
    unit: str = '',
) -> float:
    """
    Return ``value`` as a float within its bounds.

    Parameters
    ----------
    field, unit : str
        For the message.
    value : object
        Any real number but a bool.
    above, at_least, at_most : float
        Open lower, closed lower and closed upper bound.
    infinite : bool
        Whether infinity is a value.

    Raises
    ------
    NotFiniteError
        If it is NaN, or infinite where that is no value.
    InvalidValueError
        If it is no number or out of bounds.

    """
    bound = _bound(above, at_least, at_most, unit)
    if isinstance(value, bool) or not isinstance(value, (int, float, np.floating, np.integer)):
        raise InvalidValueError(field, value, f'a number {bound}'.rstrip())
    try:
        result = float(value)
    except OverflowError:  # an integer beyond every float
        result = math.inf
    if math.isnan(result) or (math.isinf(result) and not infinite):
        raise NotFiniteError(field, result, f'a finite number {bound}'.rstrip())
    if result <= above > -math.inf or not at_least <= result <= at_most:
        raise InvalidValueError(field, result, f'a number {bound}'.rstrip())
    return result


def _bound(above: float, at_least: float, at_most: float, unit: str) -> str:
    """Say a range in words."""
    parts = []
    if above > -math.inf:
        parts.append(f'> {above:g}')
    if at_least > -math.inf:
        parts.append(f'>= {at_least:g}')
    if at_most < math.inf:
        parts.append(f'<= {at_most:g}')
    if unit and not parts:
        return f'in {unit}'
    return ' '.join([' and '.join(parts), unit]).strip()


def integer(field: str, value: object, *, at_least: int, at_most: int) -> int:
    """Return ``value`` as an int within ``[at_least, at_most]``, or raise InvalidValueError."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise InvalidValueError(field, value, f'an integer from {at_least} to {at_most}')
    if not at_least <= value <= at_most:
        raise InvalidValueError(field, int(value), f'an integer from {at_least} to {at_most}')
    return int(value)


def _entries(values: object, depth: int = 0) -> int:
    """Return how many entries and lists a list has, or more than the most there may be."""
    if not isinstance(values, (list, tuple)):
        return 1
    # NumPy would visit every entry, of which a file of one kilobyte can have billions
    count = 1 if depth < _DEEPEST else _MOST_ENTRIES + 1
    for entry in values:
        if count > _MOST_ENTRIES:
            break
        count += _entries(entry, depth + 1)
    return count


def plain_names(field: str, names: Sequence[str]) -> None:
    """Raise InvalidValueError unless all names can be shown as they are."""
    for index, name in enumerate(names):
        if printable(name) != name:
            raise InvalidValueError(f'{field}[{index}]', name,
                                    'a short text without control characters')


def vector(
    field: str,
    values: ArrayLike,
    size: int | Sequence[int],
    *,
    at_least: float = -math.inf,
    above: float = -math.inf,
    at_most: float = math.inf,
    unit: str = '',
) -> Array:
    """
    Return ``values`` as a read-only float array of a given size, every entry within bounds.

    Parameters
    ----------
    field, unit : str
        For the message.
    values : array_like
        One-dimensional.
    size : int or sequence of int
        Allowed number of entries.
    above, at_least, at_most : float
        Open lower, closed lower and closed upper bound of each entry.

    Returns
    -------
    numpy.ndarray, shape (size,)
        A copy.

    Raises
    ------
    InvalidSizeError
        If the number of entries is wrong.
    NotFiniteError, InvalidValueError
        Naming the entry that is wrong.

    """
    sizes = (size,) if isinstance(size, int) else tuple(size)
    wanted = ' or '.join(str(entry) for entry in sizes)
    numbers = 'number' if sizes == (1,) else 'numbers'
    if _entries(values) > _MOST_ENTRIES:
        raise InvalidValueError(field, values, f'a list of {wanted} {numbers}')
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(field, values, f'a list of {wanted} {numbers}') from None
    if array.ndim != 1:
        raise InvalidSizeError(field, f'shape {array.shape}', f'a list of {wanted} {numbers}')
    if array.size not in sizes:
        raise InvalidSizeError(field, count_of(array.size, 'number'),
                               f'a list of {wanted} {numbers}')
    for index, entry in enumerate(array):
        number(f'{field}[{index}]', entry, above=above, at_least=at_least, at_most=at_most,
               unit=unit)
    array.setflags(write=False)
    return array


def listed(field: str, value: Iterable[Any], of: str) -> tuple[Any, ...]:
    """Return what a list has; InvalidValueError for what is none, such as one entry alone."""
    try:
        return tuple(value)
    except TypeError:
        raise InvalidValueError(field, value, f'a list {of}') from None
