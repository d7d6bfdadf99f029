"""
The serial chain of a URDF file from a base to a tip.

Links that are fixed to others are merged with them, on the chain and beside it. What moves beside
the chain would take part in the motion and is refused, unless it is locked at a position.

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flex_planner.arms.spatial_body import as_point, join_bodies, place_body, Point, SpatialBody
from flex_planner.arms.urdf import MOVING, Urdf, UrdfJoint, walk_up
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainLink:
    """
    A link of the chain with the joint that moves it.

    Attributes
    ----------
    name : str
        Of the link.
    joint : UrdfJoint
        Its joint.
    rotation : numpy.ndarray, shape (3, 3)
        Of the joint's frame in that of the link before.
    body : SpatialBody
        Of the link itself.
    merged : tuple of (str, tuple, SpatialBody)
        Name and place of links that are fixed to it, with their bodies, all in its frame.
    end : tuple
        Where the next joint or the tip is [m].

    """

    name: str
    joint: UrdfJoint
    rotation: Array
    body: SpatialBody
    merged: tuple[tuple[str, Point, SpatialBody], ...]
    end: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfChain:
    """
    Links from the base to the tip.

    Attributes
    ----------
    links : tuple of ChainLink
        At least one.
    base : tuple
        Where the first joint is in the frame of the base [m].
    tip_rotation : numpy.ndarray, shape (3, 3)
        Of the tip in the frame of the last link.
    notes : tuple of str
        What was merged and locked.
    base_name, tip_name : str
        Links of the file.

    """

    links: tuple[ChainLink, ...]
    base: Point
    tip_rotation: Array
    notes: tuple[str, ...]
    base_name: str
    tip_name: str


def find_chain(urdf: Urdf, base: str | None, tip: str | None,
               locked: Mapping[str, float]) -> UrdfChain:
    """
    Return the chain between two links.

    Parameters
    ----------
    urdf : Urdf
        The file.
    base, tip : str, optional
        Names of links; by default the root, and the only leaf.
    locked : mapping of str to float
        Positions of joints that are held [rad, m].

    Raises
    ------
    InvalidValueError
        If a name is unknown, the tip is not clear, or something moves beside the chain.

    """
    return _Finder(urdf, locked).find(_named('base', urdf, base or urdf.root),
                                      _named('tip', urdf, tip or _only_leaf(urdf)))


def _only_leaf(urdf: Urdf) -> str:
    leaves = urdf.leaves
    if len(leaves) != 1:
        raise InvalidValueError('tip', None, 'given where the URDF branches: one of '
                                f'{", ".join(leaves)}')
    return leaves[0]


def _named(field: str, urdf: Urdf, link: str) -> str:
    if link not in urdf.bodies:
        raise InvalidValueError(field, link, one_of(link, urdf.bodies))
    return link


class _Finder:
    """Follows a chain and merges what is fixed to it."""

    def __init__(self, urdf: Urdf, locked: Mapping[str, float]) -> None:
        self.urdf, self.locked, self.notes = urdf, locked, list[str]()
        names = [joint.name for joint in urdf.joints]
        for name in locked:
            if name not in names:
                raise InvalidValueError(f'locked_joints.{name}', locked[name],
                                        f'left out: the name of a joint is {one_of(name, names)}')
        self.notes += [f'joint {name} is locked at {position:g}'
                       for name, position in locked.items()]

    def find(self, base: str, tip: str) -> UrdfChain:
        """Return the chain."""
        path = list(walk_up(self.urdf, tip, base))[::-1]
        on_path = {joint.child for joint in path}
        moving = [joint for joint in path if not self._holds(joint)]
        if not moving:
            raise InvalidValueError('tip', tip, f'a link that a joint moves against {base}')
        first = moving[0]
        turn: Array = np.eye(3)
        place: Array = np.zeros(3)
        links: list[ChainLink] = []
        for joint in path:
            step, own = self._pose(joint)
            place, turn = place + turn @ step, turn @ own
            if self._holds(joint):
                continue
            if joint is first:
                start = as_point(place)
            else:
                links[-1] = _ended(links[-1], place)
            links.append(self._link(joint, turn, on_path))
            place, turn = np.zeros(3), np.eye(3)
        links[-1] = _ended(links[-1], place)
        return UrdfChain(links=tuple(links), base=start, tip_rotation=turn,
                         notes=tuple(self.notes), base_name=base, tip_name=tip)

    def _link(self, joint: UrdfJoint, turn: Array, on_path: set[str]) -> ChainLink:
        """Return a link with what is fixed to it."""
        if joint.kind not in MOVING:
            raise InvalidValueError(f'joint {joint.name}, type', joint.kind,
                                    f'one of {", ".join(MOVING)}, or locked')
        if joint.mimics:
            raise InvalidValueError(f'joint {joint.name}, mimic', joint.mimics,
                                    'left out, or the joint locked: no joint follows another')
        merged = self._fixed_to(joint.child, np.zeros(3), np.eye(3), on_path)
        if merged:
            names = ', '.join(name for name, _, _ in merged)
            self.notes.append(f'link {joint.child} was merged with {names}')
        return ChainLink(name=joint.child, joint=joint, rotation=turn,
                         body=self.urdf.bodies[joint.child], merged=tuple(merged),
                         end=(0.0, 0.0, 0.0))

    def _fixed_to(self, link: str, place: Array, turn: Array,
                  on_path: set[str]) -> list[tuple[str, Point, SpatialBody]]:
        """Return the links that are fixed to a link, on the chain or beside it."""
        found = []
        for joint in self.urdf.joints_from(link):
            if not self._holds(joint):
                if joint.child not in on_path:
                    raise InvalidValueError(
                        f'joint {joint.name}', 'beside the chain',
                        'fixed, or locked by locked_joints: what it moves would take part')
                continue
            step, own = self._pose(joint)
            there, turned = place + turn @ step, turn @ own
            found.append((joint.child, as_point(there),
                          place_body(self.urdf.bodies[joint.child], there, turned)))
            found += self._fixed_to(joint.child, there, turned, on_path)
        return found

    def _holds(self, joint: UrdfJoint) -> bool:
        return joint.kind == 'fixed' or joint.name in self.locked

    def _pose(self, joint: UrdfJoint) -> tuple[Array, Array]:
        """Return where a joint's frame is in that of its parent, moved if it is locked."""
        place, turn = np.array(joint.position), np.array(joint.rotation)
        held = self.locked.get(joint.name, 0.0)
        if not held or joint.kind == 'fixed':
            return place, turn
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        if joint.kind == 'prismatic':
            return place + turn @ (held * axis), turn
        return place, turn @ _about(axis, held)


def _ended(link: ChainLink, end: Array) -> ChainLink:
    """Return a link with its end."""
    return ChainLink(name=link.name, joint=link.joint, rotation=link.rotation, body=link.body,
                     merged=link.merged, end=as_point(end))


def _about(axis: Array, angle: float) -> Array:
    """Return the rotation about an axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Array = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn


def whole_body(link: ChainLink) -> SpatialBody:
    """Return a link with all that is fixed to it as one body."""
    return join_bodies(link.body, *(body for _, _, body in link.merged))
