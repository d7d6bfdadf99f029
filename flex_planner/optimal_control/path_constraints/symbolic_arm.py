"""The posture of an arm as CasADi expressions: where points of its bent links are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.optimal_control.path_constraints.spatial_points import express_point
import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class SymbolicArm:
    """
    An arm in a posture of symbols.

    Attributes
    ----------
    arm : Arm
        n joints, n_t coordinates.
    coordinates, rates : casadi.SX, shape (n_t, 1)
        q and q'.

    """

    arm: Arm
    coordinates: Any
    rates: Any

    @classmethod
    def of(cls, arm: Arm) -> SymbolicArm:
        """Create the symbols."""
        return cls(arm, ca.SX.sym('q', arm.n_coordinates), ca.SX.sym('dq', arm.n_coordinates))

    def bend(self, link: int, values: Any) -> Any:
        """Return a sum of a link's modes, weighted with values (modes,)."""
        modes = self.coordinates[self.arm.modal_slices[link]]
        return sum((float(value) * modes[j] for j, value in enumerate(np.ravel(values)) if value),
                   ca.SX(0))

    def deflection(self, link: int, share: float) -> Any:
        """Return how far a link of a planar arm bends at a share of its length [m]."""
        body = self.arm.links[link]
        if not body.modes:
            return ca.SX(0)
        return self.bend(link, body.mode_shapes().shape(np.array([share * body.length])))

    def point(self, link: int, share: float) -> Any:
        """Return the position of a point at a share of a link's length, (2 or 3, 1) [m]."""
        if isinstance(self.arm, SpatialArm):
            return express_point(self.arm, self.coordinates, link, share)
        angle, base = ca.SX(0), ca.SX.zeros(2)
        elastic = list(self.arm.elastic_joints)
        for i, body in enumerate(self.arm.links[:link + 1]):
            angle += self.coordinates[i]
            if i in elastic:
                angle += self.coordinates[self.arm.n_joints + elastic.index(i)]
            if i == link:
                break
            shapes = body.mode_shapes()
            base += _turn(angle, body.length, self.bend(i, shapes.tip_deflection))
            angle += self.bend(i, shapes.tip_slope)
        return base + _turn(angle, share * self.arm.links[link].length,
                            self.deflection(link, share))


def _turn(angle: Any, along: Any, across: Any) -> Any:
    """Return a vector of a frame in the axes of the base."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(c * along - s * across, s * along + c * across)
