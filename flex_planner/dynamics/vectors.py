"""
Vectors in space whose entries are numbers or symbols; zeros fold away.

A product with a number that is 0 is 0, so that what a planar arm leaves out costs nothing.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

Vector = tuple[Any, Any, Any]
ZERO: Vector = (0.0, 0.0, 0.0)


def is_zero(vector: Iterable[Any]) -> bool:
    """Return whether all entries are known to be 0."""
    return all(isinstance(entry, float) and entry == 0 for entry in vector)


def add(*vectors: Vector) -> Vector:
    """Return a sum."""
    x, y, z = (total(entries) for entries in zip(*vectors, strict=True))
    return x, y, z


def scale(factor: Any, vector: Vector) -> Vector:
    """Return a multiple."""
    x, y, z = (product(factor, entry) for entry in vector)
    return x, y, z


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    x, y, z = (total([product(a[i - 2], b[i - 1]), -product(a[i - 1], b[i - 2])])
               for i in range(3))
    return x, y, z


def dot(a: Iterable[Any], b: Iterable[Any]) -> Any:
    """Return the scalar product of two sequences."""
    return total(product(p, q) for p, q in zip(a, b, strict=True))


def apply(matrix: Iterable[Iterable[Any]], vector: Iterable[Any]) -> Vector:
    """Return the product of a matrix of three rows and a sequence."""
    entries = list(vector)
    x, y, z = (dot(row, entries) for row in matrix)
    return x, y, z


def total(terms: Iterable[Any]) -> Any:
    """Return a sum from which zeros are left out."""
    result: Any = 0.0
    for term in terms:
        if not (isinstance(term, float) and term == 0):
            result = term if isinstance(result, float) and result == 0 else result + term
    return result


def product(a: Any, b: Any) -> Any:
    """Return a product; 0 if a factor is known to be."""
    for factor in (a, b):
        if isinstance(factor, (int, float, np.floating)) and factor == 0:
            return 0.0
    if isinstance(a, (int, float)) and a == 1:
        return b
    return float(a) * b if isinstance(a, np.floating) else a * b


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """
    A quantity that moves: its value, rate and second rate, and its rate in a virtual motion.

    Parameters
    ----------
    value, rate, acceleration, virtual : object
        Scalars, vectors or lists of coordinates.

    """

    value: Any
    rate: Any
    acceleration: Any
    virtual: Any

    def apply(self, function: Callable[[Any], Any]) -> Motion:
        """Return a linear function of it."""
        return Motion(*map(function, (self.value, self.rate, self.acceleration, self.virtual)))

    def take(self, part: int | slice) -> Motion:
        """Return one of a list of coordinates, or some."""
        return Motion(self.value[part], self.rate[part], self.acceleration[part],
                      self.virtual[part])

    def weigh(self, weights: Iterable[Any]) -> Motion:
        """Return a weighted sum of a list of coordinates."""
        known = list(weights)
        return Motion(*(dot(known, z) for z in (self.value, self.rate, self.acceleration,
                                                self.virtual)))

    def __add__(self, other: Motion) -> Motion:
        """Return the sum of two scalars that move."""
        return Motion(*(total([one, more]) for one, more in zip(
            (self.value, self.rate, self.acceleration, self.virtual),
            (other.value, other.rate, other.acceleration, other.virtual), strict=True)))

    @property
    def rests(self) -> bool:
        """Return whether a scalar is known to stay 0."""
        return is_zero((self.value, self.rate, self.acceleration, self.virtual))
