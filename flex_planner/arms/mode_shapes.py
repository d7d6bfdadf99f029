"""
Assumed mode shapes of one link and the integrals that the dynamics need of them.

Korayem et al. 2009, eqs. (1), (19), (20) and (23). A mode family is a function of a length, a
number of modes and a tip load that returns :class:`LinkModes`; `FAMILIES` lists them by name.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from flex_planner.arms.beam_eigenmodes import ClampedMode, TipLoad
from flex_planner.arms.stepped_beam import Pieces, stepped_modes
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
import numpy as np

_QUADRATURE_POINTS = 64
_ROUNDING = 1e-13


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkModes:
    """
    Mode shapes phi_j of a link of length L, with their integrals over ``[0, L]``.

    Of a link in sections, `area`, `moment` and `gram` are weighted with the density over the mean
    one, and `stiffness` with the rigidity over that of the link.

    Attributes
    ----------
    shape : callable
        Stations ``(k,)`` [m] to deflections ``(k, n_modes)`` [m/m].
    slope, curvature : callable
        Stations ``(k,)`` [m] to first and second derivatives ``(k, n_modes)``, [1/m], [1/m^2].
    area : numpy.ndarray, shape (n_modes,)
        Integral of phi [m].
    moment : numpy.ndarray, shape (n_modes,)
        Integral of x phi [m^2].
    gram : numpy.ndarray, shape (n_modes, n_modes)
        Integral of phi phi^T [m].
    stiffness : numpy.ndarray, shape (n_modes, n_modes)
        Integral of phi'' phi''^T [1/m^3]; the flexural rigidity multiplies it.
    tip_deflection, tip_slope : numpy.ndarray, shape (n_modes,)
        Displacement and turn of the frame of the next link per unit of each mode,
        [m/m] and [rad/m].

    """

    shape: Callable[[Array], Array]
    slope: Callable[[Array], Array]
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


def pinned_pinned(length: float, count: int, load: TipLoad | None = None) -> LinkModes:
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
    load : TipLoad, optional
        Has no effect: a supported tip does not move.

    """
    order = np.arange(1, count + 1)
    wave = order * np.pi / length  # (count,) [1/m]
    sign = np.where(order % 2, -1.0, 1.0)  # cos(j pi)
    return LinkModes(
        shape=lambda x: np.sin(np.multiply.outer(x, wave)),
        slope=lambda x: np.cos(np.multiply.outer(x, wave)) * wave,
        curvature=lambda x: -np.sin(np.multiply.outer(x, wave)) * wave**2,
        area=(1 - sign) / wave,
        moment=-sign * length / wave,
        gram=np.diag(np.full(count, length / 2)),
        stiffness=np.diag(wave**4 * length / 2),
        tip_deflection=np.zeros(count),
        tip_slope=np.zeros(count),
    )


def clamped_free(length: float, count: int, load: TipLoad | None = None) -> LinkModes:
    """
    Return the modes of a cantilever.

    The frame of the link is tangent to it at its base; deflection and slope of the tip carry
    the next link along.

    Parameters
    ----------
    length : float
        [m].
    count : int
        Number of modes, 0 for a rigid link.
    load : TipLoad, optional
        Has no effect: see :func:`clamped_mass`.

    """
    return clamped_mass(length, count, TipLoad())


def clamped_mass(length: float, count: int, load: TipLoad | None = None) -> LinkModes:
    """
    Return the modes of a cantilever that carries a mass and an inertia at its tip.

    Shapes that know what the link carries need fewer modes; frame and coupling to the next link
    are those of :func:`clamped_free`. The shapes are scaled to a mean square of 1.

    Parameters
    ----------
    length : float
        [m].
    count : int
        Number of modes, 0 for a rigid link.
    load : TipLoad, optional
        At the tip; none makes it a plain cantilever.

    """
    modes = [ClampedMode.of(order, load or TipLoad()) for order in range(1, count + 1)]
    points, weights = _gauss_legendre()

    def stack_modes(x: Array, derivative: int = 0) -> Array:
        columns = [mode(np.asarray(x) / length, derivative) for mode in modes]
        return np.stack(columns, axis=-1) if modes else np.zeros((*np.shape(x), 0))

    sizes = np.sqrt(weights @ stack_modes(points * length) ** 2)

    def evaluate(x: Array, derivative: int) -> Array:
        values: Array = stack_modes(x, derivative) / sizes / length**derivative
        return values

    stations = points * length
    phi, bend, rule = evaluate(stations, 0), evaluate(stations, 2), weights * length
    tip = np.array([length])
    return LinkModes(
        shape=lambda x: evaluate(x, 0), slope=lambda x: evaluate(x, 1),
        curvature=lambda x: evaluate(x, 2),
        area=rule @ phi, moment=rule @ (stations[:, None] * phi),
        gram=_clean((phi.T * rule) @ phi), stiffness=_clean((bend.T * rule) @ bend),
        tip_deflection=evaluate(tip, 0)[0], tip_slope=evaluate(tip, 1)[0])


@cache
def _gauss_legendre() -> tuple[Array, Array]:
    """Return nodes and weights on [0, 1] that integrate products of 8 modes to rounding."""
    points, weights = np.polynomial.legendre.leggauss(_QUADRATURE_POINTS)
    return (points + 1) / 2, weights / 2


def _clean(matrix: Array) -> Array:
    """Return a symmetric matrix with entries that are only rounding set to 0."""
    symmetric = (matrix + matrix.T) / 2
    size = np.sqrt(np.outer(np.diag(symmetric), np.diag(symmetric)))
    cleaned: Array = np.where(np.abs(symmetric) < _ROUNDING * size, 0.0, symmetric)
    return cleaned


Family = Callable[[float, int, TipLoad | None], LinkModes]

FAMILIES: dict[str, Family] = {
    'pinned_pinned': pinned_pinned,
    'clamped_free': clamped_free,
    'clamped_mass': clamped_mass,
}


# share, density and rigidity of each piece, relative to the link
Sections = tuple[tuple[float, float, float], ...]


@cache
def mode_shapes(family: str, length: float, count: int, load: TipLoad,
                sections: Sections = ()) -> LinkModes:
    """
    Return the modes of a family; they are computed once.

    Raises
    ------
    InvalidValueError
        If the sections have so little mass where they bend that there are fewer modes.

    """
    if sections and count:
        return _stepped(family, length, count, load, sections)
    return FAMILIES[family](length, count, load)


def _stepped(family: str, length: float, count: int, load: TipLoad,
             sections: Sections) -> LinkModes:
    """Return the modes of a link in sections, scaled as those of a uniform one."""
    pinned = family == 'pinned_pinned'
    carried = load if family == 'clamped_mass' else TipLoad()
    found = stepped_modes(Pieces(*np.array(sections, dtype=float).T), count, carried,
                          pinned=pinned)
    if found is None:
        raise InvalidValueError('modes', count, 'fewer: what bends of the link has too little '
                                'mass for so many')
    factors = 1 / np.sqrt(found.square * (2 if pinned else 1))
    modes, pairs = found.modes.scale(factors), np.outer(factors, factors)
    # without a load the shapes are orthogonal: what is beside the diagonal is rounding
    gram = found.gram if carried != TipLoad() else np.diag(np.diag(found.gram))
    tip = np.zeros(count) if pinned else modes(np.ones(1))[0]
    slope = np.zeros(count) if pinned else modes(np.ones(1), 1)[0] / length
    return LinkModes(
        shape=lambda x: modes(np.asarray(x) / length),
        slope=lambda x: modes(np.asarray(x) / length, 1) / length,
        curvature=lambda x: modes(np.asarray(x) / length, 2) / length**2,
        area=length * found.area * factors, moment=length**2 * found.moment * factors,
        gram=length * _clean(gram * pairs), stiffness=np.diag(factors**2) / length**3,
        tip_deflection=tip, tip_slope=slope)
