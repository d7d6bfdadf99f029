"""What the collocation solver needs to know of a problem."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from flex_planner.base.validation import Array
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]

SINGULAR_STAGES = 'the stage equations of an interval are singular'
RATE_NOT_FINITE = 'the right-hand side is not finite at the current point'


class SingularSystemError(ArithmeticError):
    """The linearised problem has no unique solution."""


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
    explicit : numpy.ndarray of int
        Unknowns E that need no factorisation: dF_E/dz_E, taken at any two points, multiplies to
        zero. Positions are such, whose rates are velocities. May be empty; a wrong claim slows
        Newton's method down but falsifies nothing.

    """

    @property
    def size(self) -> int:
        """Return the number of equations, m."""

    @property
    def scale(self) -> Array:
        """Return the smallest magnitudes that matter, shape (m,)."""

    @property
    def explicit(self) -> Indices:
        """Return the unknowns that need no factorisation."""

    def rate(self, t: Array, z: Array) -> Array:
        """Return F(t, z) for times (k,) and unknowns (k, m), shape (k, m)."""

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return F and dF/dz, shapes (k, m) and (k, m, m)."""

    def switches(self, t: Array, z: Array) -> Array:
        """Return functions (k, e) at whose changes of sign F is not smooth; e may be 0."""

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return residual (l,) and Jacobian (l, m) of the conditions at the first node."""

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return residual (m - l,) and Jacobian (m - l, m) of those at the last node."""


@dataclass(frozen=True, slots=True, eq=False)
class CompiledRate:
    """
    F of a problem that does not depend on time, as machine code.

    Both functions have the signature ``int f(long long n, int chain, const double *const *in,
    double *const *out)``: ``in[0]`` are unknowns (n, m), the other inputs are shared by all
    points; ``out[0]`` is F (n, m), ``out[1]`` dF/dz (n, m, m). They return 0, or 1 without memory.

    Attributes
    ----------
    rate, rate_jacobian : int
        Addresses of F alone, and of F with dF/dz.
    shared : tuple of numpy.ndarray
        The inputs after the first, contiguous.
    kept : object
        What must live as long as the addresses are used.

    """

    rate: int
    rate_jacobian: int
    shared: tuple[Array, ...]
    kept: object


class CompiledProblem(BoundaryValueProblem, Protocol):
    """A problem that can be solved without a call of Python for every point."""

    def compiled_rate(self) -> CompiledRate | None:
        """Return F as machine code, None without a compiler."""


def compiled_rate_of(problem: BoundaryValueProblem) -> CompiledRate | None:
    """
    Return F of a problem as machine code if there is any.

    A subclass or an instance that has an F of its own, but no machine code, has none.

    """
    find = getattr(problem, 'compiled_rate', None)
    compiled = _depth(problem, 'compiled_rate')
    if find is None or min(_depth(problem, 'rate'), _depth(problem, 'rate_jacobian')) < compiled:
        return None
    found: CompiledRate | None = find()
    return found


def _depth(problem: object, name: str) -> int:
    """Return where an attribute is defined: -1 for the object, 0 for its class, 1 for the next."""
    if name in getattr(problem, '__dict__', {}):
        return -1
    classes = type(problem).__mro__
    return next((i for i, each in enumerate(classes) if name in vars(each)), len(classes))
