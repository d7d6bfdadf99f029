"""
The power of what sits in the joints: rotors, friction, and springs between motor and link.

A rotor turns with the rate of its joint alone: what the turning of its housing adds is smaller by
the gear ratio (Spong 1987). Coulomb friction is ``tau_c tanh(q'/v_s)``.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arms.mechanism import Mechanism
from flex_planner.dynamics.vectors import Motion, product, total


def link_angle(mechanism: Mechanism, motion: Motion, index: int) -> Motion:
    """Return the angle by which a joint turns its link: that of the motor, and its twist."""
    if index not in mechanism.elastic:
        return motion.take(index)
    return motion.take(index) + twist(mechanism, motion, index)


def twist(mechanism: Mechanism, motion: Motion, index: int) -> Motion:
    """Return the twist of an elastic joint; twists follow the joint angles."""
    return motion.take(len(mechanism.links) + mechanism.elastic.index(index))


@dataclass(frozen=True, slots=True, eq=False)
class JointPowers:
    """
    The joints of a mechanism in motion.

    Parameters
    ----------
    mechanism : Mechanism
        n joints.
    motion : Motion
        Lists of n_t coordinates.
    coulomb, fading : sequence of casadi.SX
        Coulomb friction of each joint [N m], and the speed below which it fades [rad/s].

    """

    mechanism: Mechanism
    motion: Motion
    coulomb: Sequence[Any]
    fading: Sequence[Any]

    def powers(self) -> Iterator[Any]:
        """Yield the power of each joint in the virtual motion [W]."""
        for i, link in enumerate(self.mechanism.links):
            at = self.motion.take(i)
            force = total([product(link.rotor, at.acceleration), self._friction(i, at.rate)])
            yield product(force, at.virtual)
            if link.elasticity is not None:
                bend, spring = twist(self.mechanism, self.motion, i), link.elasticity
                yield product(total([product(float(spring.stiffness), bend.value),
                                     product(float(spring.damping), bend.rate)]), bend.virtual)

    def potentials(self) -> Iterator[Any]:
        """Yield the energy of each spring [J]."""
        for i in self.mechanism.elastic:
            bend = twist(self.mechanism, self.motion, i)
            spring = self.mechanism.links[i].elasticity
            assert spring is not None
            yield product(float(spring.stiffness) / 2, product(bend.value, bend.value))

    def _friction(self, index: int, rate: Any) -> Any:
        """Return the friction of a joint [N m]."""
        viscous = product(float(self.mechanism.friction[index]), rate)
        if index not in self.mechanism.coulomb:
            return viscous
        return total([viscous, self.coulomb[index] * ca.tanh(rate / self.fading[index])])
