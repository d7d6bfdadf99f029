"""Links in space: a body, and a beam that bends from the joint to the end, if there is one."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import math

from flex_planner.arms.element_modes import ElementModes, turn_body
from flex_planner.arms.link import MAX_MODES
from flex_planner.arms.mechanism import FlexibleBody
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import clean, join_bodies, Point, point, SpatialBody
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
import numpy as np

# of a direction: sine of the angle between two
_PARALLEL = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialLink:
    """
    A link from its joint to the next one, or to the tip of the arm.

    Parameters
    ----------
    end : array_like, shape (3,)
        Where the next joint or the tip is, in the frame of the link, unbent [m].
    body : SpatialBody
        Fixed to the frame of the link: of a rigid link all of it, of a flexible one what is at its
        base.
    beam : SpatialBeam, optional
        From the origin to the end; none for a rigid link.
    elements : ElementModes, optional
        In place of a beam: modes of finite elements, in the frame of the link.
    tip_body : SpatialBody
        Fixed to the end, with the axes of the link as it is bent there.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound, a beam has no length, or there are beam and elements.

    """

    end: Point = (0.0, 0.0, 0.0)
    body: SpatialBody = field(default_factory=SpatialBody)
    beam: SpatialBeam | None = None
    tip_body: SpatialBody = field(default_factory=SpatialBody)
    elements: ElementModes | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, 'end', point('end', self.end))
        if self.elements is not None:
            self._check_elements()
        if self.beam is not None and not self.length:
            raise InvalidValueError('end', list(self.end),
                                    'apart from the joint where the link is a beam')
        if self.beam is not None:
            self.axes()
            self.beam.flexible_body(self.length)  # refuses shapes that cannot be computed

    def _check_elements(self) -> None:
        """Refuse elements beside a beam, or with another end."""
        if self.beam is not None:
            raise InvalidValueError('elements', 'given', 'left out where there is a beam')
        assert self.elements is not None
        if not np.array_equal(self.elements.body.tip, self.end):
            raise InvalidValueError('end', list(self.end), 'that of elements, '
                                    f'{self.elements.body.tip.tolist()}')

    @property
    def length(self) -> float:
        """Return the distance from the joint to the end, unbent [m]."""
        return math.hypot(*self.end)

    @property
    def modes(self) -> int:
        """Return the number of modes of bending and twisting."""
        if self.elements is not None:
            return self.elements.count
        return 0 if self.beam is None else self.beam.count

    @property
    def mass(self) -> float:
        """Return the mass of all that belongs to the link [kg]."""
        beam = 0.0 if self.beam is None else self.beam.linear_density * self.length
        elements = 0.0 if self.elements is None else self.elements.body.mass
        return self.body.mass + beam + elements + self.tip_body.mass

    @property
    def flexural_rigidity(self) -> float:
        """
        Return `SpatialBeam.reference_rigidity`; infinite for a rigid link [N m^2].

        Of elements the factor of their stiffness, which has no unit.

        """
        if self.elements is not None:
            return self.elements.factor
        return math.inf if self.beam is None else self.beam.reference_rigidity

    @property
    def damping_ratios(self) -> Array:
        """Return the damping ratio of each mode, shape (modes,)."""
        bends = self.elements or self.beam
        return np.full(self.modes, 0.0 if bends is None else bends.damping_ratio)

    @property
    def is_clamped(self) -> bool:
        """Return whether the link bends: beams in space are clamped to their joints."""
        return self.modes > 0

    @property
    def family_assumed(self) -> bool:
        """Return False: what bends in space is known to be clamped."""
        return False

    @property
    def allowable_moment(self) -> float:
        """Return infinity: the bending moment of a link in space has no limit."""
        return math.inf

    @property
    def mode_names(self) -> tuple[str, ...]:
        """Return a name of each mode: ``y1``, ``z1``, ``twist1``; of elements ``mode1``."""
        if self.elements is not None:
            return tuple(f'mode{j}' for j in range(1, self.elements.count + 1))
        if self.beam is None:
            return ()
        counts = zip(('y', 'z', 'twist'), (*self.beam.modes, self.beam.twist_modes), strict=True)
        return tuple(f'{kind}{j}' for kind, count in counts for j in range(1, count + 1))

    def axes(self) -> Array:
        """
        Return the axes of what bends in the frame of the link, columns of a rotation (3, 3).

        The first is along it; the other two are those across which a beam's planes are named. Of a
        link of elements they are those that a beam in its place has by default.

        Raises
        ------
        InvalidValueError
            If the beam's `across` is along it.

        """
        if self.elements is not None:
            return self._axes_of_line(None)
        return np.eye(3) if self.beam is None else self._axes_of_line(self.beam.across)

    def _axes_of_line(self, given: Point | None) -> Array:
        """Return axes whose first is along the link, the second nearest to a direction."""
        along = np.array(self.end) / self.length
        across = (np.eye(3)[(int(np.abs(along).argmax()) + 1) % 3]
                  if given is None else np.array(given))
        across = across - (across @ along) * along
        size = float(np.linalg.norm(across))
        if not size > _PARALLEL * max(1.0, float(np.linalg.norm(given or 1.0))):
            raise InvalidValueError('beam.across', given, 'a direction across the beam')
        across /= size
        return clean(np.column_stack([along, across, np.cross(along, across)]))

    def displace(self, modal: Array, stations: int) -> Array:
        """
        Return how far points along the link are moved by modal displacements.

        Parameters
        ----------
        modal : numpy.ndarray, shape (..., modes)
            [m, rad].
        stations : int
            Evenly spaced points, both ends included.

        Returns
        -------
        numpy.ndarray, shape (..., stations, 3)
            In the frame of the link, to first order [m].

        """
        if not self.modes:
            return np.zeros((*modal.shape[:-1], stations, 3))
        shapes = self.axes() @ self.shapes(np.linspace(0.0, 1.0, stations, dtype=np.float64))
        moved: Array = np.einsum('sam,...m->...sa', shapes, modal)
        return moved

    def flexible_body(self) -> FlexibleBody:
        """Return the integrals over what bends, in the axes `axes`."""
        if self.elements is not None:
            return turn_body(self.elements.flexible_body(), self.axes())
        if self.beam is None:
            raise InvalidValueError('beam', None, 'given: a rigid link does not bend')
        return self.beam.flexible_body(self.length)

    def shapes(self, shares: Array) -> Array:
        """Return how modes move points at shares (k,) of the link in `axes`, (k, 3, modes)."""
        if self.elements is not None:
            turned: Array = self.axes().T @ self.elements.displace(shares)
            return turned
        if self.beam is None:
            return np.zeros((shares.size, 3, 0))
        return self.beam.displace(self.length, shares * self.length)

    def bend_shapes(self, shares: Array) -> Array:
        """Return how modes move points at shares (k,) of the length across, (k, 2, modes)."""
        return self.shapes(shares)[:, 1:]

    def moment_shapes(self, shares: Array) -> Array:
        """
        Return the bending moments of modes there for E I = 1, see `SpatialBeam.moments`.

        Raises
        ------
        InvalidValueError
            If the link is one of elements, whose stresses are not kept.

        """
        if self.elements is not None:
            raise InvalidValueError('link', 'one of finite elements', 'a beam: bending moments of '
                                    'elements are not known')
        if self.beam is None:
            return np.zeros((shares.size, 2, 0))
        return self.beam.moments(self.length, shares * self.length)

    def rigid(self) -> SpatialLink:
        """Return the same link without modes."""
        if self.elements is not None:
            return replace(self, elements=None,
                           body=join_bodies(self.body, self.elements.rigid_body()))
        return self if self.beam is None else replace(self, beam=self.beam.rigid())

    def with_rigidity(self, factor: float) -> SpatialLink:
        """Return the same link with all its rigidities multiplied."""
        if self.elements is not None:
            return replace(self, elements=self.elements.with_rigidity(factor))
        return (self if self.beam is None
                else replace(self, beam=self.beam.with_rigidity(factor)))

    def with_modes(self, count: int) -> SpatialLink:
        """
        Return the same link with so many modes in each plane that has any; 0: rigid.

        Of elements the first ones, as many as there are.

        """
        if self.elements is not None and count:
            return replace(self, elements=self.elements.first(count))
        if self.beam is None or not count:
            return self.rigid()
        first, second = (count if given else 0 for given in self.beam.modes)
        return replace(self, beam=replace(self.beam, modes=(first, second)))

    def with_more_modes(self, more: int) -> SpatialLink:
        """
        Return the same link with so many modes more in each plane that has any.

        Elements have no more than they are given with.

        """
        if self.beam is None:
            return self
        first, second = (min(count + more, MAX_MODES) if count else 0
                         for count in self.beam.modes)
        return replace(self, beam=replace(self.beam, modes=(first, second)))
