"""What identification may find of an arm, its payload and its drive."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_joint import slides
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array
import numpy as np

# of the sine of the angle between an axis and gravity
_ALONG = 1e-9


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


def check_identifiable(arm: Arm) -> None:
    """
    Refuse an arm whose parameters cannot be found.

    Raises
    ------
    InvalidValueError
        If one of its joints slides: parameters are those of joints that turn.

    """
    for i, joint in enumerate(arm.joints):
        if slides(joint):
            raise InvalidValueError(f'joints[{i}]', 'one that slides', 'one that turns, for its '
                                    'parameters to be identified')


def mode_weights(link: Link | SpatialLink) -> tuple[float, ...]:
    """Return the damping ratio of each mode over the largest one."""
    ratios = link.damping_ratios
    largest = ratios.max(initial=0.0)
    return tuple(ratios / largest) if largest else (1.0,) * link.modes


def free_parameters(arm: Arm, kinds: frozenset[Quantity]) -> list[int]:
    """
    Return which parameters of some kinds an arm lets be found, as indices of the vector.

    An offset of the first joint turns the whole arm, which no log can tell without gravity, nor
    where the joint turns about it.

    """
    chosen = []
    for place, one in enumerate(list_parameters(arm.n_joints)):
        bends = arm.links[one.index].modes > 0
        needs_modes = one.kind in (Quantity.RIGIDITY, Quantity.DAMPING)
        unseen = one.kind is Quantity.OFFSET and one.index == 0 and _turns_unseen(arm)
        if one.kind in kinds and not unseen and (bends or not needs_modes):
            chosen.append(place)
    return chosen


def _turns_unseen(arm: Arm) -> bool:
    """Return whether the weight of an arm does not feel its first joint turn."""
    if not isinstance(arm, SpatialArm):
        return not arm.gravity.any()
    first = arm.joints[0]
    axis = np.array(first.rotation) @ np.array(first.axis)
    across = np.linalg.norm(np.cross(axis, arm.gravity))
    return bool(across <= _ALONG * np.linalg.norm(arm.gravity))


def with_damping(link: Link | SpatialLink, ratios: Sequence[float]) -> Link | SpatialLink:
    """Return a link that bends with other damping ratios (modes,), in space all the same."""
    largest = float(max(ratios))
    if not isinstance(link, SpatialLink):
        even = len(set(ratios)) == 1
        return replace(link, damping_ratio=largest if even else tuple(map(float, ratios)))
    if link.elements is not None:
        return replace(link, elements=replace(link.elements, damping_ratio=largest))
    assert link.beam is not None
    return replace(link, beam=replace(link.beam, damping_ratio=largest))


def with_rigidity(link: Link | SpatialLink, rigidity: float) -> Link | SpatialLink:
    """Return a link that bends with another E I; all of a beam's in space keep their ratio."""
    if isinstance(link, SpatialLink):
        return link.with_rigidity(rigidity / link.flexural_rigidity)
    return replace(link, flexural_rigidity=rigidity)


def arm_with(arm: Arm, values: Sequence[float] | Array) -> Arm:
    """
    Return an arm with other values of the parameters that an arm file holds.

    The mass of the payload, the delay and the offsets of encoders are none of them.

    """
    table = np.asarray(values, dtype=float)[1:-1].reshape(6, arm.n_joints).T
    links: Any = tuple(_link(link, *row[:2]) for link, row in zip(arm.links, table, strict=True))
    joints = tuple(_joint(joint, *row[2:5]) for joint, row in zip(arm.joints, table, strict=True))
    return replace(arm, links=links, joints=joints)


def _link(link: Link | SpatialLink, rigidity: float, damping: float) -> Link | SpatialLink:
    """Return a link with other values; a rigid one stays."""
    if not link.modes:
        return link
    ratios = [float(damping * weight) for weight in mode_weights(link)]
    return with_damping(with_rigidity(link, float(rigidity)), ratios)


def _joint(joint: Joint, viscous: float, coulomb: float, rotor: float) -> Joint:
    """Return a joint with other values."""
    motor = replace(joint.motor, rotor_inertia=float(rotor) / joint.motor.gear_ratio**2)
    return replace(joint, motor=motor, viscous_friction=float(viscous),
                   coulomb_friction=float(coulomb))
