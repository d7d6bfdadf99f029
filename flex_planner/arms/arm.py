"""
A planar manipulator as validated data: links, joints with motors, nodes, gravity.

Units are SI, angles in radians; the ranges of all quantities are in `QUANTITIES`. Nothing here
computes a motion.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

from flex_planner.arms.joint import Elasticity, Joint, Motor, Node
from flex_planner.arms.link import BeamSection, Link, MAX_MODES
from flex_planner.arms.quantities import check_quantity
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.text import LONGEST_NAME, printable
from flex_planner.base.validation import Array, integer, vector
import numpy as np
from numpy.typing import ArrayLike

__all__ = ['Arm', 'BeamSection', 'Elasticity', 'Joint', 'Link', 'MAX_LINKS', 'MAX_MODES', 'Motor',
           'Node']

MAX_LINKS = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arm:
    """
    A planar serial chain of links, each rigid or flexible.

    Coordinates are ordered as in the paper's eq. (3): the n joint angles, then the modal
    displacements link by link; ``n_t`` in all. Twists of elastic joints come between.

    Parameters
    ----------
    name, source : str
        Shown to people; `source` says where the numbers come from. What would steer a terminal is
        kept as escapes.
    links : tuple of Link
        1 to 8.
    joints : tuple of Joint
        One per link.
    nodes : tuple of Node
        One per joint and one for the tip; empty for none.
    gravity : array_like, shape (2,)
        In the plane of motion, within +-1000 [m/s^2]; zero for a horizontal plane.
    payload_com : array_like, shape (2,)
        Centre of mass of what the arm carries, from the tip, along and across the last link as it
        is bent there [m].
    payload_inertia : float
        Its rotary inertia about that centre where a task gives none, >= 0 [kg m^2].

    Raises
    ------
    InvalidValueError
        If the numbers of links, joints and nodes do not fit, or gravity breaks its bound.

    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    nodes: tuple[Node, ...] = ()
    gravity: Array = field(default_factory=lambda: np.zeros(2))
    source: str = ''
    payload_com: Array = field(default_factory=lambda: np.zeros(2))
    payload_inertia: float = 0.0

    if TYPE_CHECKING:
        # arrays are made of anything like one; type checkers would insist on arrays
        def __init__(self, *, name: str, links: tuple[Link, ...], joints: tuple[Joint, ...],
                     nodes: tuple[Node, ...] = ..., gravity: ArrayLike = ...,
                     source: str = ..., payload_com: ArrayLike = ...,
                     payload_inertia: float = ...) -> None:
            """Accept a list where an array is kept."""

    def __post_init__(self) -> None:
        n = integer('number of links', len(self.links), at_least=1, at_most=MAX_LINKS)
        if len(self.joints) != n:
            raise InvalidValueError('number of joints', len(self.joints), f'{n}, one per link')
        if len(self.nodes) not in (0, n + 1):
            raise InvalidValueError('number of nodes', len(self.nodes),
                                    f'0 or {n + 1}, one per joint and one for the tip')
        object.__setattr__(self, 'name', printable(self.name, LONGEST_NAME))
        object.__setattr__(self, 'source', printable(self.source, keep='\n\t'))
        if not self.nodes:
            object.__setattr__(self, 'nodes', (Node(),) * (n + 1))
        for field_name, kind, unit in (('gravity', 'gravity', 'm/s^2'),
                                       ('payload_com', 'length', 'm')):
            entries = vector(field_name, getattr(self, field_name), 2, unit=unit)
            for index, entry in enumerate(entries):
                check_quantity(f'{field_name}[{index}]', entry, kind)
            object.__setattr__(self, field_name, entries)
        check_quantity('payload_inertia', self.payload_inertia, 'inertia', at_least=0)

    @property
    def dimension(self) -> int:
        """Return the number of coordinates of a point: 2, those of the plane."""
        return 2

    @property
    def n_joints(self) -> int:
        """Return the number of joints, n."""
        return len(self.links)

    @property
    def n_modes(self) -> int:
        """Return the number of modal coordinates of all links."""
        return sum(link.modes for link in self.links)

    @property
    def elastic_joints(self) -> tuple[int, ...]:
        """Return the indices of the joints with a spring, counted from 0."""
        return tuple(i for i, joint in enumerate(self.joints) if joint.is_elastic)

    @property
    def n_passive(self) -> int:
        """Return the number of coordinates without a motor: twists and modal displacements."""
        return len(self.elastic_joints) + self.n_modes

    @property
    def n_coordinates(self) -> int:
        """Return the number of generalized coordinates, n_t."""
        return self.n_joints + self.n_passive

    @property
    def modal_names(self) -> tuple[str, ...]:
        """Return the names of the modal coordinates, e.g. ``link1_mode2``."""
        return tuple(f'link{i}_mode{j}' for i, link in enumerate(self.links, 1)
                     for j in range(1, link.modes + 1))

    @property
    def passive_names(self) -> tuple[str, ...]:
        """Return the names of the coordinates without a motor: ``joint1_twist``, then modes."""
        return (*(f'joint{i + 1}_twist' for i in self.elastic_joints), *self.modal_names)

    @property
    def modal_slices(self) -> tuple[slice, ...]:
        """Return the slice of each link's modal coordinates among the generalized ones."""
        ends = accumulate([self.n_joints + len(self.elastic_joints),
                           *(link.modes for link in self.links)])
        return tuple(slice(a, b) for a, b in pairwise(ends))

    @property
    def reach(self) -> float:
        """Return the distance of the tip from the base with the arm stretched out [m]."""
        return sum(link.length for link in self.links)

    @property
    def link_mass(self) -> float:
        """Return the mass of all links, without nodes and housings [kg]."""
        return sum(link.mass for link in self.links)

    @property
    def bends_at_rest(self) -> bool:
        """Return whether gravity bends the arm, so that its tip rests not where it would be."""
        return bool(self.n_passive) and bool(self.gravity.any())

    def flexural_rigidities(self) -> Array:
        """Return E I of each link, shape (n,) [N m^2]; 0 for a link without modes."""
        return np.array([link.flexural_rigidity if link.modes else 0.0 for link in self.links])

    def angle_limits(self) -> tuple[Array, Array]:
        """Return the lower and upper limit of each joint angle, shape (n,) [rad]."""
        return (np.array([joint.lower_limit for joint in self.joints]),
                np.array([joint.upper_limit for joint in self.joints]))

    def end_body(self, index: int) -> Node:
        """
        Return what turns with the end of a link: the housing of the next motor, or the last node.

        It has the mass of the node at the next joint, too, whose inertia turns with the next link.

        """
        if index == self.n_joints - 1:
            return self.nodes[-1]
        housing = self.joints[index + 1].housing
        return replace(housing, mass=self.nodes[index + 1].mass + housing.mass)

    def rigid(self) -> Arm:
        """Return the same arm with every link and joint rigid."""
        stiff = self.with_rigid_links(range(self.n_joints), f'{self.name} (rigid)')
        return replace(stiff, joints=tuple(replace(joint, elasticity=None)
                                           for joint in self.joints))

    def with_rigid_links(self, indices: Iterable[int], name: str = '') -> Arm:
        """Return the same arm with some links rigid, counted from 0."""
        links = list(self.links)
        for i in indices:
            links[i] = links[i].rigid()
        return replace(self, name=name or self.name, links=tuple(links))
