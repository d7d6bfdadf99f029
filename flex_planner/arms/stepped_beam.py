"""
Natural modes of Euler-Bernoulli beams in pieces, each uniform or rigid.

The curvature of each piece is a series of Legendre polynomials, and what it deflects follows by
integration, so that slope and deflection are continuous, and the bending moment may jump as it
does at a step, without any condition. In coefficients that make the strain energy a sum of squares
the kinetic energy is ``|B c|^2 / 2``: singular values of B are the inverses of the frequencies,
the lowest first. Lengths are in units of the beam's; densities and rigidities in those of a
uniform beam with its mass, and of its rigidity.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.beam_eigenmodes import TipLoad
from flex_planner.base.validation import Array
import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Counts = NDArray[np.intp]

# terms of a series at first and at most; a series ends where they no longer count
_FEWEST_TERMS, _MOST_TERMS = 10, 60
_NEGLIGIBLE = 1e-13
# singular values that are only rounding, as a share of the largest
_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """
    A beam in k pieces.

    Parameters
    ----------
    shares, densities, rigidities : numpy.ndarray, shape (k,)
        Lengths, mass per length and E I; some of these are 0 and infinite.

    """

    shares: Array
    densities: Array
    rigidities: Array

    @property
    def bend(self) -> Mask:
        """Return which pieces are not rigid."""
        return np.isfinite(self.rigidities)

    @property
    def starts(self) -> Array:
        """Return where the pieces begin."""
        return np.concatenate([[0.0], np.cumsum(self.shares)[:-1]])


@dataclass(frozen=True, slots=True, eq=False)
class SteppedModes:
    """
    Deflections of a stepped beam: a Legendre series of each mode on each piece.

    Attributes
    ----------
    pieces : Pieces
        k of them.
    curvatures, deflections : numpy.ndarray, shapes (k, p, m) and (k, p + 2, m)
        Coefficients of m shapes.

    """

    pieces: Pieces
    curvatures: Array
    deflections: Array

    def __call__(self, x: Array, derivative: int = 0) -> Array:
        """Return a derivative, 0 to 2, at stations x (...) from 0 to 1, shape (..., m)."""
        x = np.asarray(x)
        starts, shares = self.pieces.starts, self.pieces.shares
        piece = np.clip(np.searchsorted(starts, x.real, side='right') - 1, 0, starts.size - 1)
        series = self.curvatures if derivative == 2 else self.deflections
        values: Array = np.zeros((*x.shape, series.shape[-1]), dtype=np.result_type(x, float))
        for k in range(starts.size):
            here = piece == k
            local = 2 * (x[here] - starts[k]) / shares[k] - 1
            terms = series[k]
            if derivative == 1:
                terms = legendre.legder(terms, scl=2 / shares[k])
            values[here] = legendre.legval(local, terms).T
        return values

    def scale(self, factors: Array) -> SteppedModes:
        """Return the shapes multiplied by factors (m,)."""
        return SteppedModes(self.pieces, self.curvatures * factors, self.deflections * factors)


@dataclass(frozen=True, slots=True, eq=False)
class ModalIntegrals:
    """
    Integrals over a stepped beam of its m modes, whose strain energy is that of unit curvature.

    Attributes
    ----------
    modes : SteppedModes
        The shapes.
    frequencies : numpy.ndarray, shape (m,)
        Angular, in units of ``sqrt(EI / (rho L^4))``.
    area, moment, square : numpy.ndarray, shape (m,)
        Of the shape and of its product with the place, weighted with the density; of its square,
        which is not weighted.
    gram : numpy.ndarray, shape (m, m)
        Of products of shapes, weighted with the density. That of curvatures, weighted with the
        rigidity, is the unit matrix.

    """

    modes: SteppedModes
    frequencies: Array
    area: Array
    moment: Array
    square: Array
    gram: Array


def stepped_modes(pieces: Pieces, count: int, load: TipLoad, *,
                  pinned: bool = False) -> ModalIntegrals | None:
    """
    Return the lowest modes of a beam that is clamped at its base, or pinned at both ends.

    Parameters
    ----------
    pieces : Pieces
        Of the beam; at least one bends.
    count : int
        Number of modes.
    load : TipLoad
        At the free end of a clamped beam.
    pinned : bool
        Whether both ends are held where they are, free to turn.

    Returns
    -------
    ModalIntegrals or None
        None where so few pieces have mass that there are not so many modes.

    """
    terms: Counts = np.where(pieces.bend, _FEWEST_TERMS, 0)
    while True:
        series = _Series.of(pieces, terms, pinned)
        inertia, modal = _vibrate(series, load, pinned)
        if inertia.size < count or not inertia[count - 1] > _ROUNDING * inertia[0]:
            return None
        short = series.unfinished(modal[:count]) & (terms < _MOST_TERMS)
        if not short.any():
            return _integrate(series, modal[:count], inertia[:count])
        terms = np.where(short, np.minimum(terms * 3 // 2, _MOST_TERMS), terms)


@dataclass(frozen=True, slots=True, eq=False)
class _Series:
    """
    Shapes whose curvature is one Legendre polynomial on one piece, d of them, of unit energy.

    Attributes
    ----------
    pieces : Pieces
        k of them.
    owner : numpy.ndarray of int, shape (d,)
        The piece of each shape.
    curvatures, deflections : numpy.ndarray, shapes (k, p, d) and (k, p + 2, d)
        Coefficients of all shapes.

    """

    pieces: Pieces
    owner: Counts
    curvatures: Array
    deflections: Array

    @classmethod
    def of(cls, pieces: Pieces, terms: Counts, pinned: bool) -> _Series:
        """Return as many shapes for each piece as there are terms."""
        k, p, d = pieces.shares.size, int(terms.max()), int(terms.sum())
        owner = np.repeat(np.arange(k), terms)
        curvatures, deflections = np.zeros((k, p, d)), np.zeros((k, p + 2, d))
        slope, height = np.zeros(d), np.zeros(d)
        for i, share in enumerate(pieces.shares):
            own = np.flatnonzero(owner == i)
            order = np.arange(own.size)
            curvatures[i, order, own] = np.sqrt((2 * order + 1) / (pieces.rigidities[i] * share))
            local = legendre.legint(curvatures[i], m=2, lbnd=-1, scl=share / 2)
            local[0] += height + slope * share / 2
            local[1] += slope * share / 2
            deflections[i] = local
            height = local.sum(axis=0)
            slope = slope + share * curvatures[i, 0]
        if pinned:  # turned until the end is where the chord has it
            for i, (start, share) in enumerate(zip(pieces.starts, pieces.shares, strict=True)):
                deflections[i, 0] -= (start + share / 2) * height
                deflections[i, 1] -= share / 2 * height
        return cls(pieces, owner, curvatures, deflections)

    def unfinished(self, modal: Array) -> Mask:
        """Return for which pieces the last terms of modes (m, d) still count, (k,)."""
        rest = np.zeros(self.pieces.shares.size)
        for i in np.flatnonzero(self.pieces.bend):
            rest[i] = np.abs(modal[:, self.owner == i][:, -2:]).max()
        still: Mask = rest > _NEGLIGIBLE
        return still

    def shapes(self, modal: Array) -> SteppedModes:
        """Return the shapes with coefficients (m, d)."""
        return SteppedModes(self.pieces, self.curvatures @ modal.T, self.deflections @ modal.T)


def _vibrate(series: _Series, load: TipLoad, pinned: bool) -> tuple[Array, Array]:
    """Return roots of inertias per stiffness, the largest first, and coefficients (d, d)."""
    points, weights = _gauss(series)
    rows = [_rows(series.deflections[i], points, weights * density * share)
            for i, (density, share) in enumerate(zip(
                series.pieces.densities, series.pieces.shares, strict=True)) if density]
    if not pinned:
        tip, share = series.deflections[-1], series.pieces.shares[-1]
        slope = legendre.legder(tip, scl=2 / share).sum(axis=0)
        rows = [np.sqrt(load.mass_ratio) * tip.sum(axis=0)[None],
                np.sqrt(load.inertia_ratio) * slope[None], *rows]
    _, values, modal = np.linalg.svd(np.vstack(rows), full_matrices=False)
    return values, modal


def _rows(deflection: Array, points: Array, weights: Array) -> Array:
    """Return a quadrature of a piece as rows whose squares are summed."""
    values: Array = np.sqrt(weights)[:, None] * legendre.legval(points, deflection).T
    return values


def _gauss(series: _Series) -> tuple[Array, Array]:
    """Return nodes on [-1, 1], and weights of sum 1, that integrate squares exactly."""
    points, weights = legendre.leggauss(series.deflections.shape[1])
    return points, weights / 2


def _integrate(series: _Series, modal: Array, inertia: Array) -> ModalIntegrals:
    """Return modes with their integrals; each begins with a positive deflection."""
    pieces = series.pieces
    first = int(np.flatnonzero(pieces.bend)[0])
    shapes = series.shapes(modal)
    station = np.array([pieces.starts[first] + pieces.shares[first] * 1e-3])
    shapes = shapes.scale(np.where(shapes(station)[0] < 0, -1.0, 1.0))
    m, (points, weights) = len(modal), _gauss(series)
    area, moment, square, gram = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros((m, m))
    for i, (start, share, density) in enumerate(zip(
            pieces.starts, pieces.shares, pieces.densities, strict=True)):
        values, rule = legendre.legval(points, shapes.deflections[i]).T, weights * share
        heavy, place = density * rule, start + share * (points + 1) / 2
        area += heavy @ values
        moment += (heavy * place) @ values
        square += rule @ values**2
        gram += (values.T * heavy) @ values
    return ModalIntegrals(shapes, 1 / inertia, area, moment, square, gram)
