"""
Links in space whose modes are those of finite elements: what equations of motion need of them.

Of a model of elements only integrals are kept, as of a beam, see `flex_planner.arms.elements`.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from flex_planner.arms.link import MAX_MODES
from flex_planner.arms.mechanism import FlexibleBody
from flex_planner.arms.quantities import check_quantity
from flex_planner.arms.spatial_body import as_matrix, as_point, clean, SpatialBody, spread
from flex_planner.base.errors import InvalidSizeError, InvalidValueError
from flex_planner.base.validation import Array, integer, number
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElementModes:
    """
    The modes of a link of finite elements, in the frame of the link.

    Parameters
    ----------
    body : FlexibleBody
        Integrals over it, with the stiffness for a factor of 1 and without damping.
    shares : array_like, shape (k,)
        Stations of the line from the joint to the end, 0 to 1 of its length, ascending.
    line : array_like, shape (k, 3, m)
        What modes displace them by; between stations linearly.
    damping_ratio : float
        Of each mode by itself, 0 to 1 (excluded).
    factor : float
        By which the stiffness is multiplied, > 0.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    body: FlexibleBody
    shares: Array
    line: Array
    damping_ratio: float = 0.0
    factor: float = 1.0

    def __post_init__(self) -> None:
        integer('modes', self.body.count, at_least=1, at_most=MAX_MODES)
        for name in ('shares', 'line'):
            kept = np.array(getattr(self, name), dtype=float)
            kept.setflags(write=False)
            object.__setattr__(self, name, kept)
        if self.line.shape != (self.shares.size, 3, self.body.count):
            raise InvalidSizeError('line', f'shape {self.line.shape}',
                                   f'shape {(self.shares.size, 3, self.body.count)}')
        if number('damping_ratio', self.damping_ratio, at_least=0) >= 1:
            raise InvalidValueError('damping_ratio', self.damping_ratio, 'a number < 1')
        check_quantity('factor', self.factor, 'flexural_rigidity', above=0)

    @property
    def count(self) -> int:
        """Return the number of modes, m."""
        return self.body.count

    def flexible_body(self) -> FlexibleBody:
        """Return the integrals, with damping; the stiffness is that for a factor of 1."""
        body = self.body
        return replace(body, damping=2 * self.damping_ratio * np.sqrt(
            np.diag(body.stiffness) * np.diag(body.gram)))

    def displace(self, shares: Array) -> Array:
        """Return how modes displace points at shares (k,) of the line, shape (k, 3, m) [m]."""
        flat = self.line.reshape(self.shares.size, -1)
        moved = np.stack([np.interp(shares, self.shares, column) for column in flat.T], axis=-1)
        return moved.reshape(shares.size, 3, self.count)

    def rigid_body(self) -> SpatialBody:
        """Return the link unbent."""
        body = self.body
        center = body.first_moment / body.mass
        own = body.inertia - body.mass * spread(center)
        return SpatialBody(mass=body.mass, center_of_mass=as_point(center),
                           inertia=as_matrix((own + own.T) / 2))

    def first(self, count: int) -> ElementModes:
        """Return the same link with its first modes alone, 1 at least."""
        kept, body = slice(0, count), self.body
        return replace(self, line=self.line[:, :, kept], body=replace(
            body, **{name: getattr(body, name)[:, kept] for name in (
                'displacement', 'moment', 'spin', 'tip_displacement', 'tip_turn')},
            **{name: getattr(body, name)[kept, kept] for name in (
                'inertia_bend', 'cross_moment', 'gram', 'stiffness')},
            inertia_slope=body.inertia_slope[kept], damping=body.damping[kept],
            shortening=body.shortening[:, kept, kept],
            tip_shortening=body.tip_shortening[:, kept, kept]))

    def with_rigidity(self, factor: float) -> ElementModes:
        """Return the same link with its stiffness multiplied."""
        return replace(self, factor=factor * self.factor)


def turn_body(body: FlexibleBody, axes: Array) -> FlexibleBody:
    """Return integrals in other axes, the columns of a rotation (3, 3) in those that they have."""
    if np.array_equal(axes, np.eye(3)):
        return body
    vectors: dict[str, Any] = {name: clean(axes.T @ getattr(body, name)) for name in (
        'first_moment', 'displacement', 'moment', 'tip', 'tip_displacement', 'tip_turn', 'spin')}
    matrices: dict[str, Any] = {name: clean(axes.T @ getattr(body, name) @ axes) for name in (
        'inertia', 'inertia_slope', 'inertia_bend')}
    bent: dict[str, Any] = {name: np.einsum('ab,ajk->bjk', axes, getattr(body, name)) for name in (
        'shortening', 'tip_shortening')}
    return replace(body, cross_moment=clean(body.cross_moment @ axes), **vectors, **matrices,
                   **bent)
