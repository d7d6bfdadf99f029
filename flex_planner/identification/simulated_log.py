"""The law of a drive as numbers, and what a model makes of a log under it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from flex_planner.base.validation import Array
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveLaw:
    """
    How torques follow from samples, as numbers.

    Attributes
    ----------
    period : float
        Of the samples [s].
    stiffness, damping : numpy.ndarray, shape (n,)
        Of the drive's PD, whose torque is late by the delay [N m/rad], [N m s/rad].
    guide_stiffness, guide_damping : numpy.ndarray, shape (n,)
        Of a PD that is not there: it keeps the model near the log, at once.
    keeps : float
        Share of the last filtered speed that the next one keeps.
    measured : bool
        Whether speeds are measured; else they are filtered differences of angles.

    """

    period: float
    stiffness: Array
    damping: Array
    guide_stiffness: Array
    guide_damping: Array
    keeps: float = 0.0
    measured: bool = False

    @property
    def vector(self) -> Array:
        """Return them as the compiled functions take them."""
        return np.concatenate([self.stiffness, self.damping, self.guide_stiffness,
                               self.guide_damping, [self.keeps, self.measured, self.period]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatedLog:
    """
    A simulated log at the samples of the drive.

    Attributes
    ----------
    angles, guide : numpy.ndarray, shape (k, n)
        As encoders say them [rad], and the torque of the guide [N m].
    angle_slopes, guide_slopes : numpy.ndarray, shape (k, n, m)
        Derivatives by the parameters, as `list_parameters` has them, and the start angles, then by
        what differs from rest at the start, if that is given.

    """

    angles: Array
    guide: Array
    angle_slopes: Array
    guide_slopes: Array

    def minus(self, other: SimulatedLog, columns: int) -> tuple[Array, Array]:
        """Return the first columns of its derivatives less those of another one."""
        return ((self.angle_slopes - other.angle_slopes)[..., :columns],
                (self.guide_slopes - other.guide_slopes)[..., :columns])

    def beside(self, added: Sequence[tuple[Array, Array]]) -> SimulatedLog:
        """Return it with more columns of derivatives, of angles and of the guide."""
        angles, guides = zip(*added, strict=True)
        return replace(self, angle_slopes=np.concatenate([self.angle_slopes, *angles], axis=2),
                       guide_slopes=np.concatenate([self.guide_slopes, *guides], axis=2))
