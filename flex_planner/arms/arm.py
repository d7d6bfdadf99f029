"""
A planar manipulator as validated data: links, joints with motors, nodes, gravity.

Units are SI, angles in radians; the ranges of all quantities are in `QUANTITIES`. Nothing here
computes a motion.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
import math
from typing import TYPE_CHECKING

from flex_planner.arms.beam_eigenmodes import MAX_LOAD_RATIO, TipLoad
from flex_planner.arms.mode_shapes import FAMILIES, LinkModes, mode_shapes
from flex_planner.arms.quantities import check_quantity
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.text import LONGEST_NAME, printable
from flex_planner.base.validation import Array, integer, number, vector
import numpy as np
from numpy.typing import ArrayLike

MAX_LINKS = 8
MAX_MODES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """
    A uniform Euler-Bernoulli beam.

    Parameters
    ----------
    length : float
        > 0 [m].
    linear_density : float
        Mass per length, > 0 [kg/m].
    flexural_rigidity : float
        E I, > 0 [N m^2]; infinite only for a rigid link.
    modes : int
        Number of assumed modes, 0 (rigid) to 8.
    mode_family : str
        A name in :data:`flex_planner.arms.mode_shapes.FAMILIES`.
    shape_mass, shape_inertia : float
        What `clamped_mass` shapes expect at the tip: the mass [kg] and rotary inertia [kg m^2]
        of what the link carries, for example all further links stretched out, >= 0. They form
        the shapes only; the dynamics take masses from links, nodes and payload.
    damping_ratio : float
        Of each mode of the link by itself, 0 to 1 (excluded).

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    length: float
    linear_density: float
    flexural_rigidity: float = math.inf
    modes: int = 0
    mode_family: str = 'pinned_pinned'
    shape_mass: float = 0.0
    shape_inertia: float = 0.0
    damping_ratio: float = 0.0

    def __post_init__(self) -> None:
        check_quantity('length', self.length, 'length', above=0)
        check_quantity('linear_density', self.linear_density, 'linear_density', above=0)
        integer('modes', self.modes, at_least=0, at_most=MAX_MODES)
        check_quantity('flexural_rigidity', self.flexural_rigidity, 'flexural_rigidity', above=0,
                       infinite=self.modes == 0, note=' (needed for a link with modes)')
        if self.mode_family not in list(FAMILIES):
            raise InvalidValueError('mode_family', self.mode_family, f'one of {list(FAMILIES)}')
        check_quantity('shape_mass', self.shape_mass, 'mass', at_least=0)
        check_quantity('shape_inertia', self.shape_inertia, 'inertia', at_least=0)
        # the integrals of shapes with a still heavier load would be lost in rounding
        number('shape_mass', self.shape_mass, at_most=MAX_LOAD_RATIO * self.mass,
               unit=f'kg, {MAX_LOAD_RATIO:g} times the mass of the link')
        number('shape_inertia', self.shape_inertia,
               at_most=MAX_LOAD_RATIO * self.mass * self.length**2,
               unit=f'kg m^2, {MAX_LOAD_RATIO:g} times that of the link')
        ratio = number('damping_ratio', self.damping_ratio, at_least=0)
        if ratio >= 1:
            raise InvalidValueError('damping_ratio', ratio, 'a number < 1')

    @property
    def mass(self) -> float:
        """Return the mass of the beam [kg]."""
        return self.linear_density * self.length

    def mode_shapes(self) -> LinkModes:
        """Return the link's mode shapes and their integrals."""
        load = TipLoad(mass_ratio=self.shape_mass / self.mass,
                       inertia_ratio=self.shape_inertia / (self.mass * self.length**2))
        return mode_shapes(self.mode_family, self.length, self.modes, load)


@dataclass(frozen=True, slots=True, kw_only=True)
class Motor:
    """
    Limits of a D.C. motor at the joint: torque, eq. (15), ``+-stall_torque`` at standstill; speed.

    Parameters
    ----------
    stall_torque : float
        > 0 [N m]; infinite for no limit.
    no_load_speed : float
        Speed at which the driving torque is used up, > 0 [rad/s]; infinite for limits that do
        not depend on the speed.
    max_speed : float
        Largest speed of the joint in either direction, of a gear or a bearing for example, > 0
        [rad/s]; infinite for none. It is checked in every plan, but does not bend the motion.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    stall_torque: float = math.inf
    no_load_speed: float = math.inf
    max_speed: float = math.inf

    def __post_init__(self) -> None:
        check_quantity('stall_torque', self.stall_torque, 'stall_torque', above=0, infinite=True)
        for name in ('no_load_speed', 'max_speed'):
            check_quantity(name, getattr(self, name), 'speed', above=0, infinite=True)
        if math.isinf(self.stall_torque) and math.isfinite(self.no_load_speed):
            raise InvalidValueError('no_load_speed', self.no_load_speed,
                                    'infinite where stall_torque is infinite')

    @property
    def torque_slope(self) -> float:
        """Return K_2 of eq. (15): torque lost per speed [N m s/rad]."""
        return 0.0 if math.isinf(self.no_load_speed) else self.stall_torque / self.no_load_speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """
    A revolute joint at the base of a link.

    Parameters
    ----------
    motor : Motor
        Limits of torque and speed.
    viscous_friction : float
        >= 0 [N m s/rad].
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
    lower_limit: float = -math.inf
    upper_limit: float = math.inf

    def __post_init__(self) -> None:
        check_quantity('viscous_friction', self.viscous_friction, 'viscous_friction', at_least=0)
        lower = check_quantity('lower_limit', self.lower_limit, 'angle', infinite=True)
        upper = check_quantity('upper_limit', self.upper_limit, 'angle', above=lower,
                               infinite=True)
        if lower == math.inf or upper == -math.inf:
            name, value = (('lower_limit', lower) if lower == math.inf else ('upper_limit', upper))
            raise InvalidValueError(name, value, 'an angle in rad, or left out for no limit')


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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arm:
    """
    A planar serial chain of links, each rigid or flexible.

    Coordinates are ordered as in the paper's eq. (3): the n joint angles, then the modal
    displacements link by link; ``n_t`` in all.

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

    if TYPE_CHECKING:
        # gravity is made an array of anything like one; type checkers would insist on arrays
        def __init__(self, *, name: str, links: tuple[Link, ...], joints: tuple[Joint, ...],
                     nodes: tuple[Node, ...] = ..., gravity: ArrayLike = ...,
                     source: str = ...) -> None:
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
        gravity = vector('gravity', self.gravity, 2, unit='m/s^2')
        for index, entry in enumerate(gravity):
            check_quantity(f'gravity[{index}]', entry, 'gravity')
        object.__setattr__(self, 'gravity', gravity)

    @property
    def n_joints(self) -> int:
        """Return the number of joints, n."""
        return len(self.links)

    @property
    def n_modes(self) -> int:
        """Return the number of modal coordinates of all links."""
        return sum(link.modes for link in self.links)

    @property
    def n_coordinates(self) -> int:
        """Return the number of generalized coordinates, n_t."""
        return self.n_joints + self.n_modes

    @property
    def modal_names(self) -> tuple[str, ...]:
        """Return the names of the modal coordinates, e.g. ``link1_mode2``."""
        return tuple(f'link{i}_mode{j}' for i, link in enumerate(self.links, 1)
                     for j in range(1, link.modes + 1))

    @property
    def modal_slices(self) -> tuple[slice, ...]:
        """Return the slice of each link's modal coordinates among the generalized ones."""
        ends = np.cumsum([self.n_joints, *(link.modes for link in self.links)])
        return tuple(slice(int(a), int(b)) for a, b in zip(ends[:-1], ends[1:], strict=True))

    @property
    def reach(self) -> float:
        """Return the distance of the tip from the base with the arm stretched out [m]."""
        return sum(link.length for link in self.links)

    @property
    def bends_at_rest(self) -> bool:
        """Return whether gravity bends links, so that the tip at rest is not where it would be."""
        return bool(self.n_modes) and bool(self.gravity.any())

    def flexural_rigidities(self) -> Array:
        """Return E I of each link, shape (n,) [N m^2]; 0 for a link without modes."""
        return np.array([link.flexural_rigidity if link.modes else 0.0 for link in self.links])

    def angle_limits(self) -> tuple[Array, Array]:
        """Return the lower and upper limit of each joint angle, shape (n,) [rad]."""
        return (np.array([joint.lower_limit for joint in self.joints]),
                np.array([joint.upper_limit for joint in self.joints]))

    def rigid(self) -> Arm:
        """Return the same arm with every link rigid."""
        return self.with_rigid_links(range(self.n_joints), f'{self.name} (rigid)')

    def with_rigid_links(self, indices: Iterable[int], name: str = '') -> Arm:
        """Return the same arm with some links rigid, counted from 0."""
        links = list(self.links)
        for i in indices:
            links[i] = Link(length=links[i].length, linear_density=links[i].linear_density)
        return Arm(name=name or self.name, links=tuple(links), joints=self.joints,
                   nodes=self.nodes, gravity=self.gravity, source=self.source)
