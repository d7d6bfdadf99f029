"""Links that cross one another, or fold over one another, on a motion."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
import math

from flex_planner.base.validation import Array
import numpy as np
from numpy.typing import NDArray

# [rad], of a joint from where its link is folded back onto the one before: links of a tenth of
# their length in width touch there
_FOLDED = math.radians(10)


@dataclass(frozen=True, slots=True, kw_only=True)
class Overlap:
    """
    Two links that are in the same place.

    Attributes
    ----------
    moment : int
        Index of the posture: the first in which links cross, or the one that is folded most.
    links : tuple of int
        Indices, from 0.
    angle : float or None
        Left between links that are neighbours [rad]; None where links cross.

    """

    moment: int
    links: tuple[int, int]
    angle: float | None = None

    def __str__(self) -> str:
        """Return the overlap in words."""
        names = f'links {self.links[0] + 1} and {self.links[1] + 1}'
        if self.angle is None:
            return f'{names} cross'
        return f'{names} lie within {math.degrees(self.angle):.2g} deg over one another'


def find_overlap(points: Array, angles: Array) -> Overlap | None:
    """
    Return the first pair of links that overlap, those that cross before those that fold.

    Parameters
    ----------
    points : numpy.ndarray, shape (k, n, 2, 2)
        Both ends of each link, as of `link_points` [m].
    angles : numpy.ndarray, shape (k, n)
        Joint angles [rad].

    """
    starts, ends = points[:, :, 0], points[:, :, 1]
    for i, j in combinations(range(angles.shape[1]), 2):
        if j > i + 1:  # neighbours always meet
            met = np.flatnonzero(_cross(starts[:, i], ends[:, i], starts[:, j], ends[:, j]))
            if met.size:
                return Overlap(moment=int(met[0]), links=(i, j))
    left = np.abs(np.remainder(angles[:, 1:], 2 * np.pi) - np.pi)  # (k, n - 1)
    if not left.size or left.min() >= _FOLDED:
        return None
    moment, i = divmod(int(left.argmin()), left.shape[1])
    return Overlap(moment=moment, links=(i, i + 1), angle=float(left[moment, i]))


def _cross(a: Array, b: Array, c: Array, d: Array) -> NDArray[np.bool_]:
    """Return whether segments a-b and c-d cross, points (k, 2)."""
    crossing: NDArray[np.bool_] = ((_side(a, b, c) * _side(a, b, d) < 0)
                                   & (_side(c, d, a) * _side(c, d, b) < 0))
    return crossing


def _side(p: Array, q: Array, r: Array) -> Array:
    """Return on which side of the line p-q a point r is, by its sign."""
    s, t = q - p, r - p
    side: Array = s[:, 0] * t[:, 1] - s[:, 1] * t[:, 0]
    return side
