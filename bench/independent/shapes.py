"""Mode shapes from their boundary conditions, of any size: nothing that is compared sees it."""

from __future__ import annotations

from typing import TypeAlias

from flex_planner.arms.arm import Link
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Array: TypeAlias = NDArray[np.float64]

# of the search for eigenvalues; those of the families are further apart
_GRID = 0.01


def shapes(link: Link, stations: Array, derivative: int = 0) -> Array:
    """
    Return a derivative of the shapes of a link at stations (k,) [m], shape (k, modes).

    Parameters
    ----------
    link : Link
        Of the family `pinned_pinned`, `clamped_free` or `clamped_mass`.
    stations : numpy.ndarray, shape (k,)
        From its base [m].
    derivative : int
        0 to 2.

    """
    if not link.modes:
        return np.zeros((stations.size, 0))
    if link.mode_family == 'pinned_pinned':
        waves = np.arange(1, link.modes + 1) * np.pi / link.length
        quarter = derivative * np.pi / 2  # each derivative of a sine leads by a quarter
        sines: Array = np.sin(np.multiply.outer(stations, waves) + quarter)
        return sines * waves**derivative
    mass, inertia = 0.0, 0.0
    if link.mode_family == 'clamped_mass':
        mass, inertia = link.shape_mass / link.mass, link.shape_inertia / (
            link.mass * link.length**2)
    columns = [_cantilever(b, inertia, stations / link.length, derivative)
               for b in _eigenvalues(link.modes, mass, inertia)]
    return np.stack(columns, axis=1) / link.length**derivative


def _pair(b: float, x: Array | float, derivative: int) -> tuple[Array, Array]:
    """Return derivatives of cosh bx - cos bx and of sinh bx - sin bx, which are 0 at the clamp."""
    even, odd = np.cosh(b * np.asarray(x)), np.sinh(b * np.asarray(x))
    if derivative % 2:
        even, odd = odd, even
    turn = b * np.asarray(x) + derivative * np.pi / 2
    return b**derivative * (even - np.cos(turn)), b**derivative * (odd - np.sin(turn))


def _tip_conditions(b: float, mass: float, inertia: float) -> tuple[Array, Array]:
    """
    Return what moment and shear at the tip lack, for both functions of `_pair`.

    The body at the tip swings with the frequency of the mode, b^2 in units of the beam: the
    moment v'' is what turns it, b^4 J v', and the shear v''' what moves it, -b^4 M v.

    """
    v, slope, moment, shear = (np.array(_pair(b, 1.0, order)) for order in range(4))
    return moment - inertia * b**4 * slope, shear + mass * b**4 * v


def _eigenvalues(count: int, mass: float, inertia: float) -> list[float]:
    """Return the first eigenvalues b, where both conditions hold for one combination."""
    def determinant(b: float) -> float:
        moment, shear = _tip_conditions(b, mass, inertia)
        return float((moment[0] * shear[1] - moment[1] * shear[0]) * np.exp(-2 * b) / b**5)

    trials = np.arange(_GRID, (count + 1) * np.pi, _GRID).tolist()
    values = np.array([determinant(b) for b in trials])
    changes = np.flatnonzero(values[:-1] * values[1:] < 0)[:count]
    return [float(brentq(determinant, trials[k], trials[k + 1], xtol=1e-15))
            for k in changes.tolist()]


def _cantilever(b: float, inertia: float, x: Array, derivative: int) -> Array:
    """Return a derivative of the shape of an eigenvalue at x from 0 to 1."""
    moment, _ = _tip_conditions(b, 0.0, inertia)
    even, odd = _pair(b, x, derivative)
    shape: Array = even - moment[0] / moment[1] * odd
    return shape
