"""
Joints as data sheets describe them: motor, gear, friction, elasticity, limits; lumped masses.

All torques and speeds are at the joint, after the gear.

"""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from flex_planner.arms.quantities import check_quantity
from flex_planner.base.errors import InvalidValueError

COULOMB_SPEED = 0.1
"""Speed below which Coulomb friction fades where none is given [rad/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motor:
    """
    Limits of a D.C. motor at the joint, and the inertia of its rotor.

    The torque that drives falls with the speed, eq. (15): ``+-stall_torque`` at standstill, none
    at `no_load_speed`. In all four quadrants it is at most `max_torque`, as the current is.

    Parameters
    ----------
    stall_torque : float
        > 0 [N m]; infinite for no line.
    no_load_speed : float
        Speed at which the driving torque is used up, > 0 [rad/s]; infinite for limits that do
        not depend on the speed.
    max_torque : float, optional
        > 0 [N m]; infinite for none, which is what eq. (15) says. By default `stall_torque`.
    max_speed : float
        Largest speed of the joint in either direction, of a gear or a bearing for example, > 0
        [rad/s]; infinite for none. Plans keep it at every moment.
    gear_ratio : float
        Turns of the rotor for one of the joint, > 0. Torques and speeds are after the gear.
    rotor_inertia : float
        Of all that turns with the rotor, at the rotor, >= 0 [kg m^2].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    stall_torque: float = math.inf
    no_load_speed: float = math.inf
    max_torque: float | None = None
    max_speed: float = math.inf
    gear_ratio: float = 1.0
    rotor_inertia: float = 0.0

    def __post_init__(self) -> None:
        check_quantity('stall_torque', self.stall_torque, 'torque', above=0, infinite=True)
        for name in ('no_load_speed', 'max_speed'):
            check_quantity(name, getattr(self, name), 'speed', above=0, infinite=True)
        if self.max_torque is not None:
            check_quantity('max_torque', self.max_torque, 'torque', above=0, infinite=True)
        check_quantity('gear_ratio', self.gear_ratio, 'gear_ratio', above=0)
        check_quantity('rotor_inertia', self.rotor_inertia, 'inertia', at_least=0)
        if math.isinf(self.stall_torque) and math.isfinite(self.no_load_speed):
            raise InvalidValueError('no_load_speed', self.no_load_speed,
                                    'infinite where stall_torque is infinite')

    @property
    def torque_slope(self) -> float:
        """Return K_2 of eq. (15): torque lost per speed [N m s/rad]."""
        return 0.0 if math.isinf(self.no_load_speed) else self.stall_torque / self.no_load_speed

    @property
    def torque_cap(self) -> float:
        """Return the largest torque at any speed [N m]."""
        return self.stall_torque if self.max_torque is None else self.max_torque

    @property
    def standstill_torque(self) -> float:
        """Return the largest torque at standstill [N m]."""
        return min(self.stall_torque, self.torque_cap)

    @property
    def reflected_inertia(self) -> float:
        """Return the inertia of the rotor at the joint [kg m^2]."""
        return self.gear_ratio**2 * self.rotor_inertia


@dataclass(frozen=True, slots=True, kw_only=True)
class Elasticity:
    """
    A spring between gear and link, as of harmonic drives.

    Parameters
    ----------
    stiffness : float
        > 0 [N m/rad].
    damping : float
        >= 0 [N m s/rad].

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    stiffness: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        check_quantity('stiffness', self.stiffness, 'stiffness', above=0)
        check_quantity('damping', self.damping, 'viscous_friction', at_least=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """
    Lumped mass and rotary inertia at an end of a link.

    Node i sits at joint i and turns with the link that starts there; the last node sits at the
    tip and turns with the last link.

    Parameters
    ----------
    mass : float
        >= 0 [kg].
    inertia : float
        >= 0 [kg m^2].

    """

    mass: float = 0.0
    inertia: float = 0.0

    def __post_init__(self) -> None:
        check_quantity('mass', self.mass, 'mass', at_least=0)
        check_quantity('inertia', self.inertia, 'inertia', at_least=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """
    A revolute joint at the base of a link.

    Its angle is that of the motor, after the gear; the link turns by the twist of an elastic joint
    more. The rotor turns with this angle alone (Spong's assumption: what the turning of its
    housing adds is smaller by the gear ratio).

    Parameters
    ----------
    motor : Motor
        Limits of torque and speed, gear and rotor.
    viscous_friction : float
        >= 0 [N m s/rad].
    coulomb_friction : float
        >= 0 [N m]; ``tanh(speed / coulomb_speed)`` of it acts.
    coulomb_speed : float
        Below this speed it fades, > 0 [rad/s].
    elasticity : Elasticity, optional
        Of the gear; needs a rotor with inertia.
    housing : Node
        Mass and inertia of the motor at the tip of the link before; that of the first joint is at
        the base and has no effect.
    lower_limit, upper_limit : float
        Of the joint angle at start and goal, which a task must keep, and on the way, which a plan
        must keep to be solved [rad]; infinite for none.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    motor: Motor = field(default_factory=Motor)
    viscous_friction: float = 0.0
    coulomb_friction: float = 0.0
    coulomb_speed: float = COULOMB_SPEED
    elasticity: Elasticity | None = None
    housing: Node = field(default_factory=Node)
    lower_limit: float = -math.inf
    upper_limit: float = math.inf

    def __post_init__(self) -> None:
        check_quantity('viscous_friction', self.viscous_friction, 'viscous_friction', at_least=0)
        check_quantity('coulomb_friction', self.coulomb_friction, 'torque', at_least=0)
        check_quantity('coulomb_speed', self.coulomb_speed, 'speed', above=0)
        if self.elasticity is not None and not self.motor.rotor_inertia:
            raise InvalidValueError('motor.rotor_inertia', self.motor.rotor_inertia,
                                    'a number > 0 kg m^2 where the joint is elastic: between the '
                                    'motor and the spring there would be no mass')
        self._check_limits()

    def _check_limits(self) -> None:
        """Refuse limits of the angle that cross or leave nothing."""
        lower = check_quantity('lower_limit', self.lower_limit, 'angle', infinite=True)
        upper = check_quantity('upper_limit', self.upper_limit, 'angle', above=lower,
                               infinite=True)
        if lower == math.inf or upper == -math.inf:
            name, value = (('lower_limit', lower) if lower == math.inf else ('upper_limit', upper))
            raise InvalidValueError(name, value, 'an angle in rad, or left out for no limit')

    @property
    def is_elastic(self) -> bool:
        """Return whether the link turns by a twist more than the motor."""
        return self.elasticity is not None
