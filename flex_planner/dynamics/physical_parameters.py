"""What an arm's dynamics leave free when they are compiled: payload, stiffness, friction."""

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
    coulomb_friction, coulomb_speed : numpy.ndarray, shape (n,)
        Of each joint [N m], and the speed below which it fades [rad/s]; joints that the arm has
        without stay without.

    """

    payload_mass: float
    payload_inertia: float
    rigidity: Array
    coulomb_friction: Array
    coulomb_speed: Array

    @classmethod
    def of_arm(cls, arm: Arm, *, payload_mass: float = 0.0,
               payload_inertia: float = 0.0) -> PhysicalParameters:
        """Return the parameters of an arm with a payload."""
        return PhysicalParameters(
            payload_mass=payload_mass, payload_inertia=payload_inertia,
            rigidity=arm.flexural_rigidities(), **coulomb_frictions(arm))

    @property
    def physical(self) -> Array:
        """Return them as the vector that compiled dynamics take, in the order of `Chain`."""
        return np.concatenate([[self.payload_mass, self.payload_inertia], self.rigidity,
                               self.coulomb_friction, self.coulomb_speed])


def coulomb_frictions(arm: Arm) -> dict[str, Array]:
    """Return the fields of an arm's Coulomb friction."""
    return {'coulomb_friction': np.array([joint.coulomb_friction for joint in arm.joints]),
            'coulomb_speed': np.array([joint.coulomb_speed for joint in arm.joints])}
