"""Links as data sheets describe them: uniform or stepped beams, and rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
import math

from flex_planner.arms.beam_eigenmodes import MAX_LOAD_RATIO, TipLoad
from flex_planner.arms.mode_shapes import FAMILIES, LinkModes, mode_shapes
from flex_planner.arms.quantities import check_quantity
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array, integer, number
import numpy as np

MAX_MODES = 8
MAX_SECTIONS = 16
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class BeamSection:
    """
    A piece of a link, relative to the whole of it.

    Parameters
    ----------
    share : float
        Of the link's length, > 0.
    density : float
        Mass per length over that of the whole link, >= 0.
    rigidity : float
        E I over the link's, > 0; infinite for a rigid piece.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    share: float
    density: float = 1.0
    rigidity: float = 1.0

    def __post_init__(self) -> None:
        number('share', self.share, above=0, at_most=1)
        number('density', self.density, at_least=0)
        number('rigidity', self.rigidity, above=0, infinite=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """
    An Euler-Bernoulli beam, or a rigid body, from its joint to the next one.

    Parameters
    ----------
    length : float
        > 0 [m].
    linear_density : float
        Mass over length, > 0 [kg/m].
    flexural_rigidity : float
        E I, > 0 [N m^2]; infinite only for a rigid link.
    modes : int
        Number of assumed modes, 0 (rigid) to 8.
    mode_family : str
        A name in :data:`flex_planner.arms.mode_shapes.FAMILIES`.
    shape_mass, shape_inertia : float
        What `clamped_mass` shapes expect at the tip: the mass [kg] and rotary inertia [kg m^2]
        of what the link carries, for example all further links stretched out, >= 0. They form
        the shapes only; the dynamics take masses from links, nodes and payload.
    damping_ratio : float or tuple of float
        Of each mode of the link by itself, 0 to 1 (excluded); one for all, or one per mode.
    sections : tuple of BeamSection
        Pieces from the joint outwards, of which there are at most 16; empty for a uniform link.
        See `stepped_link`.
    center_of_mass : tuple of float, optional
        Of a rigid link, along and across it from its joint [m]; by default that of the sections.
    inertia : float, optional
        Rotary inertia of a rigid link about its centre of mass, >= 0 [kg m^2]; by default that of
        the sections.
    family_assumed : bool
        Whether nobody said which family the modes are of.
    allowable_moment : float
        Largest bending moment of a link with modes on the way, > 0 [N m]; infinite for no limit.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    length: float
    linear_density: float
    flexural_rigidity: float = math.inf
    modes: int = 0
    mode_family: str = 'pinned_pinned'
    shape_mass: float = 0.0
    shape_inertia: float = 0.0
    damping_ratio: float | tuple[float, ...] = 0.0
    sections: tuple[BeamSection, ...] = ()
    center_of_mass: tuple[float, float] | None = None
    inertia: float | None = None
    family_assumed: bool = False
    allowable_moment: float = math.inf

    def __post_init__(self) -> None:
        check_quantity('length', self.length, 'length', above=0)
        check_quantity('linear_density', self.linear_density, 'linear_density', above=0)
        integer('modes', self.modes, at_least=0, at_most=MAX_MODES)
        check_quantity('flexural_rigidity', self.flexural_rigidity, 'flexural_rigidity', above=0,
                       infinite=self.modes == 0, note=' (needed for a link with modes)')
        if self.mode_family not in list(FAMILIES):
            raise InvalidValueError('mode_family', self.mode_family,
                                    one_of(self.mode_family, FAMILIES))
        number('allowable_moment', self.allowable_moment, above=0, infinite=True, unit='N m')
        if not self.modes and math.isfinite(self.allowable_moment):
            raise InvalidValueError('allowable_moment', self.allowable_moment, 'left out for a '
                                    'link without modes, whose bending nothing tells')
        self._check_load()
        self._check_damping()
        self._check_sections()
        self._check_body()

    def _check_load(self) -> None:
        """Refuse loads whose shapes cannot be computed."""
        check_quantity('shape_mass', self.shape_mass, 'mass', at_least=0)
        check_quantity('shape_inertia', self.shape_inertia, 'inertia', at_least=0)
        # the integrals of shapes with a still heavier load would be lost in rounding
        number('shape_mass', self.shape_mass, at_most=MAX_LOAD_RATIO * self.mass,
               unit=f'kg, {MAX_LOAD_RATIO:g} times the mass of the link')
        number('shape_inertia', self.shape_inertia,
               at_most=MAX_LOAD_RATIO * self.mass * self.length**2,
               unit=f'kg m^2, {MAX_LOAD_RATIO:g} times that of the link')

    def _check_damping(self) -> None:
        """Refuse ratios out of range, or not one per mode."""
        given = self.damping_ratio
        named: list[tuple[str, object]] = [('damping_ratio', given)]
        if isinstance(given, (list, tuple)):
            object.__setattr__(self, 'damping_ratio', tuple(given))
            if len(given) != self.modes:
                raise InvalidValueError('damping_ratio', list(given),
                                        f'one number, or {self.modes}, one per mode')
            named = [(f'damping_ratio[{i}]', entry) for i, entry in enumerate(given)]
        for name, ratio in named:
            if number(name, ratio, at_least=0) >= 1:
                raise InvalidValueError(name, ratio, 'a number < 1')

    def _check_sections(self) -> None:
        """Refuse sections that are not the whole link."""
        object.__setattr__(self, 'sections', tuple(self.sections))
        if not self.sections:
            return
        integer('number of sections', len(self.sections), at_least=1, at_most=MAX_SECTIONS)
        for what, whole in (
                ('shares', sum(one.share for one in self.sections)),
                ('masses', sum(one.share * one.density for one in self.sections))):
            if abs(whole - 1) > _ROUNDING:
                raise InvalidValueError('sections', f'{what} with the sum {whole:.12g}',
                                        f'{what} with the sum 1')
        if self.modes and all(math.isinf(one.rigidity) for one in self.sections):
            raise InvalidValueError('sections', 'rigid ones only',
                                    'at least one that bends in a link with modes')
        self.mode_shapes()  # refuses sections with too little mass for so many modes

    def _check_body(self) -> None:
        """Refuse a centre of mass or an inertia of a link that bends."""
        if self.center_of_mass is not None:
            if not isinstance(self.center_of_mass, Sequence) or len(self.center_of_mass) != 2:
                raise InvalidValueError('center_of_mass', self.center_of_mass,
                                        'two numbers, along and across the link [m]')
            x, y = (check_quantity(f'center_of_mass[{i}]', entry, 'length')
                    for i, entry in enumerate(self.center_of_mass))
            object.__setattr__(self, 'center_of_mass', (x, y))
        if self.inertia is not None:
            check_quantity('inertia', self.inertia, 'inertia', at_least=0)
        for name in ('center_of_mass', 'inertia'):
            if self.modes and getattr(self, name) is not None:
                raise InvalidValueError(name, getattr(self, name), 'left out for a link with '
                                        'modes, whose sections and nodes say where its mass is')

    @property
    def mass(self) -> float:
        """Return the mass of the link [kg]."""
        return self.linear_density * self.length

    @property
    def damping_ratios(self) -> Array:
        """Return the damping ratio of each mode, shape (modes,)."""
        return np.broadcast_to(np.array(self.damping_ratio, dtype=float), (self.modes,))

    @property
    def is_clamped(self) -> bool:
        """Return whether the link bends and is clamped to its joint."""
        return self.modes > 0 and self.mode_family != 'pinned_pinned'

    @property
    def first_moment(self) -> tuple[float, float]:
        """Return mass times centre of mass, along and across [kg m]."""
        if self.center_of_mass is not None:
            x, y = self.center_of_mass
            return self.mass * x, self.mass * y
        return self.linear_density * self._integrate(2) * self.length**2, 0.0

    @property
    def rotary_inertia(self) -> float:
        """Return the inertia about the joint, without bending [kg m^2]."""
        along, across = self.first_moment
        if self.inertia is not None:
            return self.inertia + (along**2 + across**2) / self.mass
        about_joint = (self.linear_density * self._integrate(3) * self.length**3 if self.sections
                       else self.linear_density * self.length**3 / 3)
        if self.center_of_mass is None:
            return about_joint
        # the inertia of the sections about their own centre, moved to the one that is given
        own = about_joint - self.mass * (self._integrate(2) * self.length)**2
        return own + (along**2 + across**2) / self.mass

    def _integrate(self, power: int) -> float:
        """Return the integral of ``power - 1`` powers of the place, and density, over [0, 1]."""
        if not self.sections:
            return 1 / power
        ends = np.cumsum([0.0, *(one.share for one in self.sections)])
        pieces = np.diff(ends**power) / power
        return float(pieces @ [one.density for one in self.sections])

    def mode_shapes(self) -> LinkModes:
        """Return the link's mode shapes and their integrals; they are computed once."""
        return _find_modes(self)

    def bend_shapes(self, shares: Array) -> Array:
        """Return how modes move points at shares (k,) of the length across, (k, 1, modes)."""
        return self.mode_shapes().shape(shares * self.length)[:, None]

    def moment_shapes(self, shares: Array) -> Array:
        """Return the bending moments of modes there for E I = 1, shape (k, 1, modes) [1/m^2]."""
        rigidity = np.array([self._rigidity_at(share) for share in shares])
        moments: Array = rigidity[:, None] * self.mode_shapes().curvature(shares * self.length)
        return moments[:, None]

    def _rigidity_at(self, share: float) -> float:
        """Return E I at a share of the length over that of the link."""
        end = 0.0
        for section in self.sections:
            end += section.share
            if share <= end:
                return section.rigidity
        return 1.0

    def with_modes(self, count: int) -> Link:
        """
        Return the same link with another number of modes.

        Further modes are damped as the last one that has a ratio.

        Raises
        ------
        InvalidValueError
            If there are not so many.

        """
        given = self.damping_ratio
        if isinstance(given, tuple):
            given = (given + given[-1:] * count)[:count] or 0.0
        allowed = self.allowable_moment if count else math.inf
        return replace(self, modes=count, damping_ratio=given, allowable_moment=allowed)

    def with_more_modes(self, more: int) -> Link:
        """Return the same link with so many modes more, or as many as there can be."""
        for count in range(min(self.modes + more, MAX_MODES), self.modes, -1):
            try:
                return self.with_modes(count)
            except InvalidValueError:  # too little of its mass bends
                pass
        return self

    def rigid(self) -> Link:
        """Return the same link without modes."""
        return Link(length=self.length, linear_density=self.linear_density,
                    sections=self.sections, center_of_mass=self.center_of_mass,
                    inertia=self.inertia)


@lru_cache(maxsize=256)
def _find_modes(link: Link) -> LinkModes:
    """Return what `Link.mode_shapes` keeps."""
    load = TipLoad(mass_ratio=link.shape_mass / link.mass,
                   inertia_ratio=link.shape_inertia / (link.mass * link.length**2))
    pieces = tuple((one.share, one.density, one.rigidity) for one in link.sections)
    return mode_shapes(link.mode_family, link.length, link.modes, load, pieces)
