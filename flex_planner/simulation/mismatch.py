"""Differences of a simulated arm from the one that a motion was planned for."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, MAX_MODES
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.validation import Array, integer, number, vector
import numpy as np

AS_GIVEN = -1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mismatch:
    """
    The differences; by default none.

    Parameters
    ----------
    modes : int
        Of every link that has any, in space in each plane that has any, 0 (rigid) to 8; -1 leaves
        them.
    rigidity_scale : float
        On E I of every link, and what else of a beam is stiff, 0.001 to 1000.
    added_friction : array_like, shape (n,)
        Viscous, of every joint, 0 to 1000 [N m s/rad]; empty for none.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    modes: int = AS_GIVEN
    rigidity_scale: float = 1.0
    added_friction: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        integer('modes', self.modes, at_least=AS_GIVEN, at_most=MAX_MODES)
        number('rigidity_scale', self.rigidity_scale, at_least=1e-3, at_most=1e3)
        given = np.atleast_1d(np.asarray(self.added_friction, dtype=float))
        object.__setattr__(self, 'added_friction', vector(
            'added_friction', given, given.size, at_least=0, at_most=1e3, unit='N m s/rad'))

    def apply(self, arm: Arm) -> Arm:
        """
        Return the arm that is simulated instead.

        Raises
        ------
        InvalidSizeError
            If the friction has neither one entry per joint nor none.

        """
        friction = vector('added_friction', self.added_friction, (0, arm.n_joints))
        added = friction if friction.size else np.zeros(arm.n_joints)
        links: Any = tuple(self._link(link) for link in arm.links)
        return replace(
            arm, links=links,
            joints=tuple(_with_friction(joint, float(more))
                         for joint, more in zip(arm.joints, added, strict=True)))

    def _link(self, link: Link | SpatialLink) -> Link | SpatialLink:
        """Return a link with its own stiffness and number of modes; a rigid one stays."""
        if not link.modes:
            return link
        changed = link if self.modes == AS_GIVEN else link.with_modes(self.modes)
        if isinstance(changed, SpatialLink):
            return changed.with_rigidity(self.rigidity_scale)
        return replace(changed, flexural_rigidity=link.flexural_rigidity * self.rigidity_scale)


def _with_friction(joint: Joint, more: float) -> Joint:
    """Return a joint with more friction."""
    return replace(joint, viscous_friction=joint.viscous_friction + more)
