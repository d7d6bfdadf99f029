"""
Assumed mode shapes of one link and the integrals that the dynamics need of them.

Korayem et al. 2009, eqs. (1), (19), (20) and (23). A mode family is a function that takes a
length and a number of modes and returns :class:`LinkModes`; `FAMILIES` lists them by name.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkModes:
    """
    Mode shapes phi_j of a link of length L, with their integrals over ``[0, L]``.

    Attributes
    ----------
    shape : callable
        Stations ``(k,)`` [m] to deflections ``(k, n_modes)`` [m/m].
    curvature : callable
        Stations ``(k,)`` [m] to second derivatives ``(k, n_modes)`` [1/m^2].
    area : numpy.ndarray, shape (n_modes,)
        Integral of phi [m].
    moment : numpy.ndarray, shape (n_modes,)
        Integral of x phi [m^2].
    gram : numpy.ndarray, shape (n_modes, n_modes)
        Integral of phi phi^T [m].
    stiffness : numpy.ndarray, shape (n_modes, n_modes)
        Integral of phi'' phi''^T [1/m^3]; the flexural rigidity multiplies it.
    tip_deflection, tip_slope : numpy.ndarray, shape (n_modes,)
        What a unit of each mode displaces and turns the frame of the next link by,
        [m/m] and [rad/m].

    """

    shape: Callable[[Array], Array]
    curvature: Callable[[Array], Array]
    area: Array
    moment: Array
    gram: Array
    stiffness: Array
    tip_deflection: Array
    tip_slope: Array

    @property
    def count(self) -> int:
        """Return the number of modes."""
        return int(self.area.size)


def pinned_pinned(length: float, count: int) -> LinkModes:
    """
    Return the sine modes of a simply supported link, eq. (20).

    The frame of the link is its chord: both ends stay on it, and the next joint angle is
    measured from it, so neither tip deflection nor tip slope is carried to the next link.

    Parameters
    ----------
    length : float
        [m].
    count : int
        Number of modes, 0 for a rigid link.

    """
    order = np.arange(1, count + 1)
    wave = order * np.pi / length  # (count,) [1/m]
    sign = np.where(order % 2, -1.0, 1.0)  # cos(j pi)
    return LinkModes(
        shape=lambda x: np.sin(np.multiply.outer(x, wave)),
        curvature=lambda x: -np.sin(np.multiply.outer(x, wave)) * wave**2,
        area=(1 - sign) / wave,
        moment=-sign * length / wave,
        gram=np.diag(np.full(count, length / 2)),
        stiffness=np.diag(wave**4 * length / 2),
        tip_deflection=np.zeros(count),
        tip_slope=np.zeros(count),
    )


FAMILIES: dict[str, Callable[[float, int], LinkModes]] = {'pinned_pinned': pinned_pinned}
