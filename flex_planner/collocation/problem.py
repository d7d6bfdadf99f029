"""What the collocation solver needs to know of a problem."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class BoundaryValueProblem(Protocol):
    """
    A first-order system of m equations with separated boundary conditions.

    Attributes
    ----------
    size : int
        m.
    scale : numpy.ndarray, shape (m,)
        Smallest magnitude of each unknown that matters, > 0: changes are measured against it
        or against the largest value of the unknown, whichever is larger.

    """

    @property
    def size(self) -> int:
        """Return the number of equations, m."""

    @property
    def scale(self) -> Array:
        """Return the smallest magnitudes that matter, shape (m,)."""

    def rate(self, t: Array, z: Array) -> Array:
        """Return F(t, z) for times (k,) and unknowns (k, m), shape (k, m)."""

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return F and dF/dz, shapes (k, m) and (k, m, m)."""

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return residual (l,) and Jacobian (l, m) of the conditions at the first node."""

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return residual (m - l,) and Jacobian (m - l, m) of those at the last node."""
