"""Where things are in the arrays of the compiled functions of an arm under a drive."""

from __future__ import annotations

from dataclasses import dataclass

LAGS = 4
"""Most periods of the drive by which its torque may be late."""


@dataclass(frozen=True, slots=True)
class LoopSizes:
    """
    Where things are in the arrays of the compiled functions, for n joints and n_t coordinates.

    The state is z = (q, q', filtered speeds, angles sampled last, torque of the guide, torques
    commanded last, newest first). Columns of its derivatives are those of the physical
    parameters, the offsets of the encoders, the delay, and the start angles.

    """

    joints: int
    coordinates: int

    @property
    def physical(self) -> int:
        """Return the number of physical parameters."""
        return 1 + 5 * self.joints

    @property
    def columns(self) -> int:
        """Return the number of columns of derivatives."""
        return self.physical + 2 * self.joints + 1

    @property
    def state(self) -> int:
        """Return the size of z."""
        return 2 * self.coordinates + (4 + LAGS) * self.joints

    @property
    def row(self) -> int:
        """Return the size of what differs from step to step."""
        return 3 * self.joints + 5 + LAGS

    @property
    def angles(self) -> slice:
        """Return where the sampled angles are in z."""
        first = 2 * self.coordinates + self.joints
        return slice(first, first + self.joints)

    @property
    def guide(self) -> slice:
        """Return where the torque of the guide is in z."""
        return slice(self.angles.stop, self.angles.stop + self.joints)
