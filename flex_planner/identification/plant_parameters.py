"""What identification may find of an arm, its payload and its drive."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array
import numpy as np


class Quantity(Enum):
    """Kinds of parameters; the value is the name on the command line."""

    PAYLOAD = 'payload'
    RIGIDITY = 'rigidity'
    DAMPING = 'damping'
    VISCOUS = 'viscous'
    COULOMB = 'coulomb'
    ROTOR = 'rotor'
    OFFSET = 'offset'
    DELAY = 'delay'

    @classmethod
    def named(cls, names: Iterable[str]) -> frozenset[Quantity]:
        """
        Return the kinds of some names.

        Raises
        ------
        InvalidValueError
            If there is no such name.

        """
        known = [kind.value for kind in cls]
        for name in names:
            if name not in known:
                raise InvalidValueError('free', name, one_of(name, known))
        return frozenset(cls(name) for name in names)


_FIELDS = {Quantity.RIGIDITY: ('links[{}].flexural_rigidity', 'N m^2'),
           Quantity.DAMPING: ('links[{}].damping_ratio', ''),
           Quantity.VISCOUS: ('joints[{}].friction.viscous', 'N m s/rad'),
           Quantity.COULOMB: ('joints[{}].friction.coulomb', 'N m'),
           Quantity.ROTOR: ('joints[{}].motor.reflected_inertia', 'kg m^2'),
           Quantity.OFFSET: ('joints[{}].encoder_offset', 'rad')}


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """
    One number that may be identified.

    Attributes
    ----------
    kind : Quantity
        What it is.
    index : int
        Of its link or joint, from 0.
    name, unit : str
        For people; the name is that of the field in an arm file where it has one.

    """

    kind: Quantity
    index: int
    name: str
    unit: str

    @property
    def lower_bound(self) -> float:
        """Return the least value that makes sense."""
        if self.kind is Quantity.OFFSET:
            return -np.inf
        return 1e-6 if self.kind is Quantity.RIGIDITY else 0.0


def list_parameters(joints: int) -> list[Parameter]:
    """Return the parameters of an arm in the order of the vector that the model takes."""
    found = [Parameter(kind=Quantity.PAYLOAD, index=0, name='payload_mass', unit='kg')]
    for kind, (name, unit) in _FIELDS.items():
        found += [Parameter(kind=kind, index=i, name=name.format(i), unit=unit)
                  for i in range(joints)]
    return [*found, Parameter(kind=Quantity.DELAY, index=0, name='delay', unit='s')]


def parameters_of(arm: Arm, payload_mass: float, delay: float = 0.0) -> Array:
    """
    Return the values of an arm file in the order of `list_parameters`, shape (2 + 6 n,).

    Of links whose modes have different damping ratios it is the largest one; see `mode_weights`.

    """
    dampings = [max(link.damping_ratios, default=0.0) for link in arm.links]
    joints = arm.joints
    return np.concatenate([
        [payload_mass], arm.flexural_rigidities(), dampings,
        [joint.viscous_friction for joint in joints],
        [joint.coulomb_friction for joint in joints],
        [joint.motor.reflected_inertia for joint in joints],
        np.zeros(arm.n_joints), [delay]])


def mode_weights(link: Link) -> tuple[float, ...]:
    """Return the damping ratio of each mode over the largest one."""
    ratios = link.damping_ratios
    largest = ratios.max(initial=0.0)
    return tuple(ratios / largest) if largest else (1.0,) * link.modes


def free_parameters(arm: Arm, kinds: frozenset[Quantity]) -> list[int]:
    """
    Return which parameters of some kinds an arm lets be found, as indices of the vector.

    Without gravity an offset of the first joint turns the whole arm, which no log can tell.

    """
    chosen = []
    for place, one in enumerate(list_parameters(arm.n_joints)):
        bends = arm.links[one.index].modes > 0
        needs_modes = one.kind in (Quantity.RIGIDITY, Quantity.DAMPING)
        unseen = (one.kind is Quantity.OFFSET and one.index == 0 and not arm.gravity.any())
        if one.kind in kinds and not unseen and (bends or not needs_modes):
            chosen.append(place)
    return chosen


def arm_with(arm: Arm, values: Sequence[float] | Array) -> Arm:
    """
    Return an arm with other values of the parameters that an arm file holds.

    The mass of the payload, the delay and the offsets of encoders are none of them.

    """
    table = np.asarray(values, dtype=float)[1:-1].reshape(6, arm.n_joints).T
    links = tuple(_link(link, *row[:2]) for link, row in zip(arm.links, table, strict=True))
    joints = tuple(_joint(joint, *row[2:5]) for joint, row in zip(arm.joints, table, strict=True))
    return replace(arm, links=links, joints=joints)


def _link(link: Link, rigidity: float, damping: float) -> Link:
    """Return a link with other values; a rigid one stays."""
    if not link.modes:
        return link
    weights = mode_weights(link)
    even = len(set(weights)) == 1
    return replace(link, flexural_rigidity=float(rigidity), damping_ratio=(
        float(damping) if even else tuple(float(damping * weight) for weight in weights)))


def _joint(joint: Joint, viscous: float, coulomb: float, rotor: float) -> Joint:
    """Return a joint with other values."""
    motor = replace(joint.motor, rotor_inertia=float(rotor) / joint.motor.gear_ratio**2)
    return replace(joint, motor=motor, viscous_friction=float(viscous),
                   coulomb_friction=float(coulomb))
