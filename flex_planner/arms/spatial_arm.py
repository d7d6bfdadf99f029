"""
A manipulator in space as validated data: any axes, links that bend in two planes and twist.

A planar arm is the special case that `flex_planner.arms.arm.Arm` describes by itself.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from flex_planner.arms.arm import Arm, MAX_LINKS, Node
from flex_planner.arms.quantities import check_quantity
from flex_planner.arms.spatial_beam import CLAMPED, SpatialBeam
from flex_planner.arms.spatial_body import (
    as_point,
    IDENTITY,
    inertia_matrix,
    Matrix,
    NO_INERTIA,
    Point,
    rotation,
    SpatialBody,
)
from flex_planner.arms.spatial_body import point as checked_point
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidSizeError, InvalidValueError
from flex_planner.base.sentences import count_of
from flex_planner.base.text import LONGEST_NAME, printable
from flex_planner.base.validation import Array, integer, plain_names, vector
import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpatialArm(Arm):
    """
    A serial chain of links in space, each rigid or flexible.

    Coordinates are the n joint coordinates, then the twists of elastic joints, then the modes link
    by link, of each link those of its first plane, of its second and of twisting; ``n_t`` in all.

    Parameters
    ----------
    name, source : str
        As of `Arm`.
    links : tuple of SpatialLink
        1 to 8.
    joints : tuple of SpatialJoint
        One per link.
    gravity : array_like, shape (3,)
        In the frame of the base, within +-1000 [m/s^2]; by default along -z.
    base : array_like, shape (3,)
        Where the first joint is, in the frame of the base [m].
    tip_rotation : array_like, shape (3,) or (3, 3)
        Of the frame of the tip in that of the last link: roll, pitch and yaw, or a matrix.
    payload_com : array_like, shape (3,)
        Centre of mass of what the arm carries, in the frame of the tip [m].
    payload_inertia : float
        Its rotary inertia about that centre where a task gives none, the same about every axis,
        >= 0 [kg m^2].
    payload_tensor : array_like, shape (3,) or (3, 3)
        Rotary inertia of what the arm carries besides, whatever its mass: principal moments along
        the axes of the tip, or a matrix in its frame [kg m^2].
    notes : tuple of str
        What was made of the file that the arm comes from, for people.
    joint_names : tuple of str
        Of the joints, where the file names them; empty, or one per joint.
    frame_names : tuple of str
        Of the base, the links and the tip, where the file names them; empty, or n + 2.

    Raises
    ------
    InvalidValueError
        If the numbers of links and joints do not fit, or a value breaks its bound.

    """

    links: tuple[SpatialLink, ...]  # type: ignore[assignment]  # with what is asked of a `Link`
    joints: tuple[SpatialJoint, ...]
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    payload_com: Array = field(default_factory=lambda: np.zeros(3))
    base: Point = (0.0, 0.0, 0.0)
    tip_rotation: Matrix = IDENTITY
    payload_tensor: Matrix = NO_INERTIA
    notes: tuple[str, ...] = ()
    joint_names: tuple[str, ...] = ()
    frame_names: tuple[str, ...] = ()

    if TYPE_CHECKING:
        # arrays are made of anything like one; type checkers would insist on arrays
        def __init__(self, *, name: str, links: tuple[SpatialLink, ...],
                     joints: tuple[SpatialJoint, ...], gravity: ArrayLike = ...,
                     source: str = ..., payload_com: ArrayLike = ..., payload_inertia: float = ...,
                     base: ArrayLike = ..., tip_rotation: ArrayLike = ...,
                     payload_tensor: ArrayLike = ...,
                     notes: tuple[str, ...] = ..., joint_names: tuple[str, ...] = ...,
                     frame_names: tuple[str, ...] = ...) -> None:
            """Accept a list where an array is kept."""

    @classmethod
    def of_planar(cls, arm: Arm) -> SpatialArm:
        """
        Return a planar arm in the plane of x and y.

        Raises
        ------
        InvalidValueError
            If one of its links bends otherwise than a clamped uniform beam.

        """
        ends = [*(joint.housing for joint in arm.joints[1:]), arm.nodes[-1]]
        return cls(
            name=arm.name, source=arm.source, gravity=[*arm.gravity, 0.0],
            payload_com=[*arm.payload_com, 0.0], payload_inertia=arm.payload_inertia,
            joints=tuple(SpatialJoint(
                motor=joint.motor, viscous_friction=joint.viscous_friction,
                coulomb_friction=joint.coulomb_friction, coulomb_speed=joint.coulomb_speed,
                elasticity=joint.elasticity, lower_limit=joint.lower_limit,
                upper_limit=joint.upper_limit) for joint in arm.joints),
            links=tuple(_of_planar(arm, i, end) for i, end in enumerate(ends)))

    def __post_init__(self) -> None:
        n = integer('number of links', len(self.links), at_least=1, at_most=MAX_LINKS)
        if len(self.joints) != n:
            raise InvalidValueError('number of joints', len(self.joints), f'{n}, one per link')
        if self.nodes:
            raise InvalidValueError('nodes', 'given', 'left out for a spatial arm: bodies of '
                                    'links say what sits at their ends')
        object.__setattr__(self, 'name', printable(self.name, LONGEST_NAME))
        object.__setattr__(self, 'source', printable(self.source, keep='\n\t'))
        for name, kind, unit in (('gravity', 'gravity', 'm/s^2'), ('payload_com', 'length', 'm')):
            entries = vector(name, getattr(self, name), 3, unit=unit)
            for index, entry in enumerate(entries):
                check_quantity(f'{name}[{index}]', entry, kind)
            object.__setattr__(self, name, entries)
        check_quantity('payload_inertia', self.payload_inertia, 'inertia', at_least=0)
        object.__setattr__(self, 'base', checked_point('base', self.base))
        object.__setattr__(self, 'tip_rotation', rotation('tip_rotation', self.tip_rotation))
        object.__setattr__(self, 'payload_tensor',
                           inertia_matrix('payload_tensor', self.payload_tensor))
        plain_names('notes', self.notes)
        for name, count in (('joint_names', n), ('frame_names', n + 2)):
            given = getattr(self, name)
            plain_names(name, given)
            if len(given) not in (0, count):
                raise InvalidSizeError(name, count_of(len(given), 'name'), f'{count}, or none')
        if not self.reach:
            raise InvalidValueError('links', 'all of length 0', 'with an end apart from a joint')

    @property
    def dimension(self) -> int:
        """Return 3: points are in space."""
        return 3

    @property
    def modal_names(self) -> tuple[str, ...]:
        """Return the names of the modal coordinates, e.g. ``link2_y1``, ``link2_twist1``."""
        return tuple(f'link{i}_{name}' for i, link in enumerate(self.links, 1)
                     for name in link.mode_names)

    @property
    def reach(self) -> float:
        """Return the largest distance of the tip from the first joint, slides aside [m]."""
        return sum(link.length for link in self.links)

    def end_body(self, index: int) -> Node:
        """Refuse: bodies in space are no lumped masses."""
        raise TypeError('a spatial arm has no nodes')

    def rigid(self) -> SpatialArm:
        """Return the same arm with every link and joint rigid."""
        stiff = self.with_rigid_links(range(self.n_joints), f'{self.name} (rigid)')
        return replace(stiff, joints=tuple(replace(joint, elasticity=None)
                                           for joint in self.joints))

    def with_rigid_links(self, indices: Iterable[int], name: str = '') -> SpatialArm:
        """Return the same arm with some links rigid, counted from 0."""
        links = list(self.links)
        for i in indices:
            links[i] = links[i].rigid()
        return replace(self, name=name or self.name, links=tuple(links))


def _of_planar(arm: Arm, index: int, end: Node) -> SpatialLink:
    """Return a link of a planar arm, with a node or a housing at its end."""
    link, node = arm.links[index], arm.nodes[index]
    base = SpatialBody(mass=node.mass, inertia=(0.0, 0.0, node.inertia))  # type: ignore[arg-type]
    tip = SpatialBody(mass=end.mass, inertia=(0.0, 0.0, end.inertia))  # type: ignore[arg-type]
    along = as_point([link.length, 0.0, 0.0])
    if not link.modes:
        return SpatialLink(end=along, body=_rigid_body(arm, index), tip_body=tip)
    if link.mode_family not in CLAMPED or link.sections:
        raise InvalidValueError(f'links[{index}]', 'no uniform clamped beam',
                                'one, to be written as a link in space')
    return SpatialLink(end=along, body=base, tip_body=tip, beam=SpatialBeam(
        linear_density=link.linear_density, modes=(link.modes, 0),
        flexural_rigidity=(link.flexural_rigidity, np.inf), mode_family=link.mode_family,
        shape_mass=link.shape_mass, shape_inertia=link.shape_inertia,
        damping_ratio=float(link.damping_ratios[0])))


def _rigid_body(arm: Arm, index: int) -> SpatialBody:
    """Return a rigid link of a planar arm with the node at its base."""
    link, node = arm.links[index], arm.nodes[index]
    mass = link.mass + node.mass
    x, y = (entry / mass for entry in link.first_moment)
    about = link.rotary_inertia + node.inertia - mass * (x * x + y * y)
    return SpatialBody(mass=mass, center_of_mass=(x, y, 0.0),
                       inertia=(0.0, 0.0, about))  # type: ignore[arg-type]
