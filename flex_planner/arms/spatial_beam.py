"""
Straight uniform beams in space: they bend across in two planes and twist.

Where a beam lies along x, its first plane is that of y and its second that of z. Both bend in the
assumed modes of a family, as links of planar arms do; the shapes of twisting are those of a
clamped rod with an inertia at its tip.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

from flex_planner.arms.link import Link, MAX_MODES
from flex_planner.arms.mechanism import FlexibleBody, X, Y, Z
from flex_planner.arms.mode_shapes import LinkModes
from flex_planner.arms.quantities import check_quantity
from flex_planner.arms.spatial_body import as_point, Point
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array, integer, number, vector
import numpy as np

CLAMPED = ('clamped_free', 'clamped_mass')
_POINTS = 64
# of the largest entry of an integral
_ROUNDING = 1e-13


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialBeam:
    """
    A straight uniform beam that is clamped to its joint.

    Parameters
    ----------
    linear_density : float
        > 0 [kg/m].
    flexural_rigidity : tuple of float
        E I for bending in the first and in the second plane, > 0 [N m^2].
    torsional_rigidity : float
        G J_t, > 0 [N m^2]; needed for modes of twisting.
    polar_inertia : float
        Rotary inertia about its axis over its length, >= 0 [kg m]; > 0 with modes of twisting.
    modes : tuple of int
        Of bending in the first and the second plane, 0 to 8 each.
    twist_modes : int
        Of twisting, 0 to 8.
    across : tuple of float, optional
        Direction of the first plane, across the beam, in the frame of the link. By default the
        axis of that frame which follows (x, y, z, x) the one that the beam is nearest to.
    mode_family : str
        ``clamped_free`` or ``clamped_mass``, see `flex_planner.arms.mode_shapes`.
    shape_mass, shape_inertia, shape_twist_inertia : float
        What ``clamped_mass`` shapes expect at the tip, >= 0: mass [kg], rotary inertia across and
        about the axis [kg m^2].
    damping_ratio : float
        Of each mode of the beam by itself, 0 to 1 (excluded).
    foreshortening : bool
        Whether bending draws the tip nearer, to second order: then gravity and rotation stiffen
        or soften the beam.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    linear_density: float
    flexural_rigidity: tuple[float, float] = (math.inf, math.inf)
    torsional_rigidity: float = math.inf
    polar_inertia: float = 0.0
    modes: tuple[int, int] = (0, 0)
    twist_modes: int = 0
    across: Point | None = None
    mode_family: str = 'clamped_free'
    shape_mass: float = 0.0
    shape_inertia: float = 0.0
    shape_twist_inertia: float = 0.0
    damping_ratio: float = 0.0
    foreshortening: bool = False

    def __post_init__(self) -> None:
        check_quantity('linear_density', self.linear_density, 'linear_density', above=0)
        self._check_modes()
        for i, (rigidity, count) in enumerate(zip(self.flexural_rigidity, self.modes,
                                                  strict=True)):
            check_quantity(f'flexural_rigidity[{i}]', rigidity, 'flexural_rigidity', above=0,
                           infinite=count == 0, note=' (needed for modes in this plane)')
        twists = self.twist_modes > 0
        check_quantity('torsional_rigidity', self.torsional_rigidity, 'flexural_rigidity',
                       above=0, infinite=not twists, note=' (needed for modes of twisting)')
        check_quantity('polar_inertia', self.polar_inertia, 'inertia', at_least=0)
        if twists and not self.polar_inertia:
            raise InvalidValueError('polar_inertia', 0.0, '> 0 kg m with modes of twisting')
        if self.mode_family not in CLAMPED:
            raise InvalidValueError('mode_family', self.mode_family, ' or '.join(CLAMPED))
        check_quantity('shape_twist_inertia', self.shape_twist_inertia, 'inertia', at_least=0)
        if number('damping_ratio', self.damping_ratio, at_least=0) >= 1:
            raise InvalidValueError('damping_ratio', self.damping_ratio, 'a number < 1')
        if self.across is not None:
            object.__setattr__(self, 'across', as_point(vector('across', self.across, 3)))
        if not isinstance(self.foreshortening, bool):
            raise InvalidValueError('foreshortening', self.foreshortening, 'true or false')

    def _check_modes(self) -> None:
        """Refuse other numbers of modes or rigidities than one per plane."""
        for name in ('modes', 'flexural_rigidity'):
            given = getattr(self, name)
            if not isinstance(given, (list, tuple)) or len(given) != 2:
                raise InvalidValueError(name, given, 'two numbers, one per plane')
            object.__setattr__(self, name, tuple(given))
        for i, count in enumerate(self.modes):
            integer(f'modes[{i}]', count, at_least=0, at_most=MAX_MODES)
        integer('twist_modes', self.twist_modes, at_least=0, at_most=MAX_MODES)

    @property
    def count(self) -> int:
        """Return the number of modes, m: first plane, second plane, twisting."""
        return sum(self.modes) + self.twist_modes

    @property
    def reference_rigidity(self) -> float:
        """
        Return the rigidity [N m^2] that stands for all of the beam's, which keep their ratio.

        That of the first plane with modes; of twisting where there is none.

        """
        pairs = [*zip(self.modes, self.flexural_rigidity, strict=True),
                 (self.twist_modes, self.torsional_rigidity)]
        return next((rigidity for count, rigidity in pairs if count), math.inf)

    def rigid(self) -> SpatialBeam:
        """Return the same beam without modes."""
        return replace(self, modes=(0, 0), twist_modes=0, flexural_rigidity=(math.inf, math.inf),
                       torsional_rigidity=math.inf, damping_ratio=0.0)

    def with_rigidity(self, factor: float) -> SpatialBeam:
        """Return the same beam with all rigidities multiplied."""
        first, second = self.flexural_rigidity
        return replace(self, flexural_rigidity=(factor * first, factor * second),
                       torsional_rigidity=factor * self.torsional_rigidity)

    def bend(self, length: float, plane: int) -> LinkModes:
        """Return the shapes of bending in a plane, 0 or 1, of a beam of a length [m]."""
        return Link(length=length, linear_density=self.linear_density,
                    flexural_rigidity=self.flexural_rigidity[plane], modes=self.modes[plane],
                    mode_family=self.mode_family, shape_mass=self.shape_mass,
                    shape_inertia=self.shape_inertia).mode_shapes()

    def twist(self, length: float) -> TwistModes:
        """Return the shapes of twisting of a beam of a length [m]."""
        load = (self.shape_twist_inertia / (self.polar_inertia * length)
                if self.twist_modes and self.mode_family == 'clamped_mass' else 0.0)
        return TwistModes.of(length, self.twist_modes, load)

    def displace(self, length: float, stations: Array) -> Array:
        """Return how modes displace points at stations (k,) of the beam, shape (k, 3, m) [m]."""
        moved = np.zeros((stations.size, 3, self.count))
        first = self.modes[0]
        moved[:, Y, :first] = self.bend(length, 0).shape(stations)
        moved[:, Z, first:sum(self.modes)] = self.bend(length, 1).shape(stations)
        return moved

    def moments(self, length: float, stations: Array) -> Array:
        """
        Return the bending moments of modes at stations (k,), shape (k, 2, m) [N].

        In the first and the second plane, for a `reference_rigidity` of 1 N m^2.

        """
        found = np.zeros((stations.size, 2, self.count))
        parts = slice(0, self.modes[0]), slice(self.modes[0], sum(self.modes))
        for plane, part in enumerate(parts):
            if self.modes[plane]:
                share = self.flexural_rigidity[plane] / self.reference_rigidity
                found[:, plane, part] = share * self.bend(length, plane).curvature(stations)
        return found

    def flexible_body(self, length: float) -> FlexibleBody:
        """
        Return the integrals over a beam of a length [m] that lies along x.

        Its stiffness is that for a `reference_rigidity` of 1 N m^2.

        """
        return _Integrals(self, length).body()


@dataclass(frozen=True, slots=True, eq=False)
class TwistModes:
    """
    Turns ``sqrt(2) sin(b_j x / L)`` of a clamped rod, b of shape (m,).

    Parameters
    ----------
    length : float
        L [m].
    waves : numpy.ndarray, shape (m,)
        b_j.

    """

    length: float
    waves: Array

    @classmethod
    def of(cls, length: float, count: int, load: float) -> TwistModes:
        """Return the lowest ones of a rod with an inertia at its tip, in units of its own."""
        return cls(length, np.array([_twist_wave(j, load) for j in range(count)]))

    def turn(self, stations: Array) -> Array:
        """Return the turns at stations (k,), shape (k, m) [rad]."""
        turns: Array = math.sqrt(2) * np.sin(np.multiply.outer(stations / self.length, self.waves))
        return turns

    def slope(self, stations: Array) -> Array:
        """Return their derivatives along the rod, shape (k, m) [rad/m]."""
        rates: Array = math.sqrt(2) * np.cos(np.multiply.outer(
            stations / self.length, self.waves)) * self.waves / self.length
        return rates


def _twist_wave(index: int, load: float) -> float:
    """Return the root of ``cos b = load b sin b`` in the quarter turn after ``index`` halves."""
    low, high = index * math.pi, (index + 0.5) * math.pi
    if not load:
        return high
    from scipy.optimize import brentq  # a tenth of a second, and few arms need it

    return float(brentq(lambda b: math.cos(b) - load * b * math.sin(b), low, high, xtol=1e-14))


class _Integrals:
    """Integrals over a beam along x with modes first of y, then of z, then of twisting."""

    def __init__(self, beam: SpatialBeam, length: float) -> None:
        self.beam, self.length, self.m = beam, length, beam.count
        points, weights = np.polynomial.legendre.leggauss(_POINTS)
        self.x, self.w = (points + 1) / 2 * length, weights / 2 * length
        first, bending = beam.modes[0], sum(beam.modes)
        self.parts = slice(0, first), slice(first, bending), slice(bending, self.m)
        self.planes = beam.bend(length, 0), beam.bend(length, 1)
        self.twist = beam.twist(length)
        self.phi = beam.displace(length, self.x)
        self.psi = np.zeros((self.x.size, self.m))
        self.psi[:, self.parts[2]] = self.twist.turn(self.x)

    def body(self) -> FlexibleBody:
        """Return them."""
        beam, rho, L, w = self.beam, self.beam.linear_density, self.length, self.w
        gram, stiffness = self._own_matrices()
        spin = np.zeros((3, self.m))
        spin[X] = beam.polar_inertia * (w @ self.psi)
        moment = np.zeros((3, self.m))
        moment[Z], moment[Y] = w * self.x @ self.phi[:, Y], -(w * self.x @ self.phi[:, Z])
        slope = np.zeros((self.m, 3, 3))
        slope[:, Y, X] = -(w * self.x @ self.phi[:, Y])
        slope[:, Z, X] = -(w * self.x @ self.phi[:, Z])
        shortened, weighted, tip_shortened = self._shortening()
        bend = self._bend() - np.einsum('jk,ab->jkab', weighted, np.diag([0.0, 1.0, 1.0]))
        tip_displacement, tip_turn = self._tip()
        about = rho * L**3 / 3
        return FlexibleBody(
            mass=rho * L, first_moment=np.array([rho * L**2 / 2, 0.0, 0.0]),
            inertia=np.diag([beam.polar_inertia * L, about, about]),
            displacement=_clean(rho * np.einsum('s,sam->am', w, self.phi)),
            inertia_slope=_clean(rho * slope), inertia_bend=_clean(rho * bend),
            moment=_clean(rho * moment + spin), cross_moment=_clean(rho * self._cross_moment()),
            gram=gram, stiffness=stiffness, spin=_clean(spin),
            damping=2 * beam.damping_ratio * np.sqrt(np.diag(stiffness) * np.diag(gram)),
            tip=np.array([L, 0.0, 0.0]), tip_displacement=tip_displacement, tip_turn=tip_turn,
            shortening=_along_x(-rho * shortened), tip_shortening=_along_x(-tip_shortened))

    def _own_matrices(self) -> tuple[Array, Array]:
        """Return mass and stiffness matrices of the modes."""
        beam, gram, stiffness = self.beam, np.zeros((self.m, self.m)), np.zeros((self.m, self.m))
        unit = beam.reference_rigidity
        for part, modes, rigidity in zip(self.parts[:2], self.planes, beam.flexural_rigidity,
                                         strict=True):
            gram[part, part] = beam.linear_density * modes.gram
            if modes.count:
                stiffness[part, part] = rigidity / unit * modes.stiffness
        part = self.parts[2]
        if beam.twist_modes:
            psi, rates = self.psi[:, part], self.twist.slope(self.x)
            gram[part, part] = _clean(beam.polar_inertia * (psi.T * self.w) @ psi)
            stiffness[part, part] = _clean(
                beam.torsional_rigidity / unit * (rates.T * self.w) @ rates)
        return gram, stiffness

    def _bend(self) -> Array:
        """Return the integrals of ``(Phi_k . Phi_j) 1 - Phi_j Phi_k^T``, j first."""
        mixed = np.einsum('s,saj,sbk->jkab', self.w, self.phi, self.phi)
        spread: Array = np.einsum('jkaa,bc->jkbc', mixed, np.eye(3)) - mixed
        return spread

    def _cross_moment(self) -> Array:
        """Return the integrals of ``Phi_k x Phi_j``, k first."""
        crossed = np.zeros((self.m, self.m, 3))
        across, other = self.phi[:, Y], self.phi[:, Z]
        both = np.einsum('s,sk,sj->kj', self.w, across, other)
        crossed[:, :, X] = both - both.T
        return crossed

    def _shortening(self) -> tuple[Array, Array, Array]:
        """
        Return how much bending draws points towards the base, shape (m, m) each.

        With Gamma(x), the integral of ``phi' phi'^T`` up to x: its integral, that of x Gamma, and
        Gamma at the tip.

        """
        if not self.beam.foreshortening or not self.m:
            none = np.zeros((self.m, self.m))
            return none, none, none
        slopes = np.zeros((2, self.x.size, self.m))
        for plane, (part, modes) in enumerate(zip(self.parts[:2], self.planes, strict=True)):
            slopes[plane][:, part] = modes.slope(self.x)
        squares = np.einsum('asj,ask->sjk', slopes, slopes)
        L, x, w = self.length, self.x, self.w
        weights = np.stack([w * (L - x), w * (L**2 - x**2) / 2, w])
        whole, weighted, tip = np.einsum('is,sjk->ijk', weights, squares)
        return whole, weighted, tip

    def _tip(self) -> tuple[Array, Array]:
        """Return how modes displace and turn the tip."""
        moved, turned = np.zeros((3, self.m)), np.zeros((3, self.m))
        first, second, twisting = self.parts
        moved[Y, first], turned[Z, first] = (self.planes[0].tip_deflection,
                                             self.planes[0].tip_slope)
        moved[Z, second], turned[Y, second] = (self.planes[1].tip_deflection,
                                               -self.planes[1].tip_slope)
        turned[X, twisting] = self.twist.turn(np.array([self.length]))[0]
        return moved, turned


def _along_x(matrix: Array) -> Array:
    """Return (3, m, m) with a matrix as its x part."""
    whole = np.zeros((3, *matrix.shape))
    whole[X] = matrix
    return whole


def _clean(values: Array) -> Array:
    """Return an array in which entries that are only rounding are 0."""
    cleaned: Array = np.where(np.abs(values) < _ROUNDING * np.abs(values).max(initial=0.0), 0.0,
                              values)
    return cleaned
