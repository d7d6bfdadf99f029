"""How sure the parameters of a least-squares fit are."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.validation import Array
import numpy as np

_NORMAL_95, _SINGULAR = 1.96, 1e-14


def half_widths(errors: Array, jacobian: Array, variance: float,
                blocks: Sequence[int] = ()) -> Array:
    """
    Return half of the intervals of 95 %, infinite where the errors say nothing.

    They are those of errors that have nothing to do with one another or, if that is more, of
    errors that are alike within blocks (a sandwich estimate).

    Parameters
    ----------
    errors : numpy.ndarray, shape (k,)
        That are left.
    jacobian : numpy.ndarray, shape (k, m)
        Their derivatives by the parameters.
    variance : float
        Of an error.
    blocks : sequence of int
        Where blocks begin, the first one at 0; none for errors that are not alike.

    """
    scale = np.linalg.norm(jacobian, axis=0)
    seen = scale > 0
    scaled = jacobian[:, seen] / scale[seen]
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=_SINGULAR)
    squares = np.diag(inverse) * variance
    if len(blocks):
        sums = np.add.reduceat(scaled * errors[:, None], np.asarray(blocks), axis=0)
        squares = np.maximum(squares, np.sum((sums @ inverse)**2, axis=0))
    widths = np.full(scale.size, np.inf)
    widths[seen] = _NORMAL_95 * np.sqrt(squares) / scale[seen]
    return widths
