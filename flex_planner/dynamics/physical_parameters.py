"""What an arm's dynamics leave free when they are compiled: payload and stiffness."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PhysicalParameters:
    """
    Parameters of the equations of motion that may change without compiling an arm again.

    Attributes
    ----------
    payload_mass, payload_inertia : float
        m_p [kg] and its rotary inertia [kg m^2].
    rigidity : numpy.ndarray, shape (n,)
        E I of each link [N m^2].

    """

    payload_mass: float
    payload_inertia: float
    rigidity: Array

    @classmethod
    def of_arm(cls, arm: Arm, *, payload_mass: float = 0.0,
               payload_inertia: float = 0.0) -> PhysicalParameters:
        """Return the parameters of an arm with a payload."""
        return PhysicalParameters(payload_mass=payload_mass, payload_inertia=payload_inertia,
                                  rigidity=arm.flexural_rigidities())

    @property
    def physical(self) -> Array:
        """Return them as the vector that compiled dynamics take, in the order of `Chain`."""
        return np.concatenate([[self.payload_mass, self.payload_inertia], self.rigidity])
