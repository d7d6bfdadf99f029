"""
A serial arm as bodies and joints in three dimensions: what the equations of motion need of it.

All is numbers in the axes of frames: a link's frame sits at its joint and turns with the link, the
frame of its tip is carried along by bending. Planar arms are the case in which links lie along
the x axes of their frames and everything turns about z; what is zero then costs nothing.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from flex_planner.arms.arm import Arm, Elasticity, Link, Node
from flex_planner.base.validation import Array
import numpy as np

X, Y, Z = range(3)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigidBody:
    """
    A rigid body about the origin of its frame.

    Attributes
    ----------
    mass : float
        [kg].
    first_moment : numpy.ndarray, shape (3,)
        Mass times centre of mass [kg m].
    inertia : numpy.ndarray, shape (3, 3)
        About the origin [kg m^2].

    """

    mass: float = 0.0
    first_moment: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlexibleBody:
    """
    A link that bends, by integrals over it: m modes with coordinates q.

    A point of it that lies at r_0 in the frame of the link comes to ``r = r_0 + Phi q``, and
    shortened by bending to ``r + q^T Phi_2 q / 2``; pieces of a twisted link turn besides.
    Integrals are over its mass; where more than one entry of space belongs to a mode, the mode
    comes first, but where it is said otherwise.

    Attributes
    ----------
    mass : float
        [kg].
    first_moment, inertia : numpy.ndarray, shapes (3,) and (3, 3)
        Of r_0 [kg m], [kg m^2].
    displacement : numpy.ndarray, shape (3, m)
        Integral of Phi.
    inertia_slope, inertia_bend : numpy.ndarray, shapes (m, 3, 3) and (m, m, 3, 3)
        Integrals of ``(r . Phi_j) 1 - Phi_j r^T`` for r = r_0 and for r = Phi_k, k second; of
        r_0 and Phi_2 together for what bending shortens.
    moment : numpy.ndarray, shape (3, m)
        Integral of ``r_0 x Phi_j``, and `spin`.
    cross_moment : numpy.ndarray, shape (m, m, 3)
        Integral of ``Phi_k x Phi_j``, k first.
    gram : numpy.ndarray, shape (m, m)
        Mass matrix of the modes alone.
    stiffness : numpy.ndarray, shape (m, m)
        For a rigidity of 1 N m^2: the rigidity of the link is a free parameter.
    damping : numpy.ndarray, shape (m,)
        Coefficients for that rigidity; they grow with its root.
    tip : numpy.ndarray, shape (3,)
        Where its end is unbent [m].
    tip_displacement, tip_turn : numpy.ndarray, shape (3, m)
        What modes displace and turn it by.
    spin : numpy.ndarray, shape (3, m)
        Polar inertia times the turn of pieces by a mode.
    shortening, tip_shortening : numpy.ndarray, shape (3, m, m)
        Integral of Phi_2, and Phi_2 at the tip; space comes first.

    """

    mass: float
    first_moment: Array
    inertia: Array
    displacement: Array
    inertia_slope: Array
    inertia_bend: Array
    moment: Array
    cross_moment: Array
    gram: Array
    stiffness: Array
    damping: Array
    tip: Array
    tip_displacement: Array
    tip_turn: Array
    spin: Array = field(default_factory=lambda: np.zeros((3, 0)))
    shortening: Array = field(default_factory=lambda: np.zeros((3, 0, 0)))
    tip_shortening: Array = field(default_factory=lambda: np.zeros((3, 0, 0)))

    @property
    def count(self) -> int:
        """Return the number of modes, m."""
        return len(self.stiffness)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MechanismLink:
    """
    A joint with the link that it moves.

    Attributes
    ----------
    position, rotation : numpy.ndarray, shapes (3,) and (3, 3)
        Of the joint's frame in the frame of the tip before [m]; columns of the rotation are axes.
    axis : int
        About which of its axes, 0 to 2, the joint turns, or along which it slides.
    sign : float
        1, or -1 where it does so the other way round.
    slides : bool
        Whether the joint is prismatic.
    turned : numpy.ndarray, shape (3, 3)
        Axes of the link's frame in that of the joint.
    base, end : RigidBody
        Fixed to the frames of the link and of its tip.
    beam : FlexibleBody
        The link between; without modes it is rigid.
    tip_order : tuple of int
        Axes about which the bent tip turns, one after the other.
    rotor : float
        Inertia that turns with the joint's own rate [kg m^2].
    elasticity : Elasticity, optional
        Of the joint: the link turns by a twist more than the motor.

    """

    base: RigidBody
    beam: FlexibleBody
    end: RigidBody
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    axis: int = Z
    sign: float = 1.0
    slides: bool = False
    turned: Array = field(default_factory=lambda: np.eye(3))
    tip_order: tuple[int, ...] = (Y, X, Z)
    rotor: float = 0.0
    elasticity: Elasticity | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mechanism:
    """
    An arm from its base to its tip.

    Attributes
    ----------
    links : sequence of MechanismLink
        n of them.
    friction : numpy.ndarray, shape (n,)
        Viscous, of the joints [N m s/rad].
    gravity : numpy.ndarray, shape (3,)
        In the axes of the base [m/s^2].
    coulomb : tuple of int
        Joints with Coulomb friction, whose sizes are free parameters.
    payload_com : numpy.ndarray, shape (3,)
        Centre of mass of the payload in the frame of the tip [m].
    payload_axes : tuple of int
        Axes about which the payload has its rotary inertia.
    tip_rotation : numpy.ndarray, shape (3, 3)
        Axes of the tool in the frame of the tip.

    """

    links: Sequence[MechanismLink]
    friction: Array
    gravity: Array
    coulomb: tuple[int, ...] = ()
    payload_com: Array = field(default_factory=lambda: np.zeros(3))
    payload_axes: tuple[int, ...] = (Z,)
    tip_rotation: Array = field(default_factory=lambda: np.eye(3))

    @property
    def elastic(self) -> tuple[int, ...]:
        """Return the joints that are elastic."""
        return tuple(i for i, link in enumerate(self.links) if link.elasticity is not None)

    @property
    def n_coordinates(self) -> int:
        """Return the number of coordinates: joints, twists of the elastic ones, modes."""
        return (len(self.links) + len(self.elastic)
                + sum(link.beam.count for link in self.links))

    @classmethod
    def of(cls, arm: Arm) -> Mechanism:
        """Return a planar arm: in the plane of x and y."""
        # what is fixed to the tip of each link: the housing of the next motor, or the last node
        ends = [*(joint.housing for joint in arm.joints[1:]), arm.nodes[-1]]
        return cls(
            links=[MechanismLink(base=_node(node), beam=planar_beam(link), end=_node(end),
                                 rotor=joint.motor.reflected_inertia, elasticity=joint.elasticity)
                   for link, joint, node, end in zip(arm.links, arm.joints, arm.nodes, ends,
                                                     strict=False)],
            friction=np.array([joint.viscous_friction for joint in arm.joints]),
            gravity=np.append(arm.gravity, 0.0),
            coulomb=tuple(i for i, joint in enumerate(arm.joints) if joint.coulomb_friction),
            payload_com=np.append(arm.payload_com, 0.0))


def _node(node: Node) -> RigidBody:
    """Return the lumped mass at the origin of a frame in the plane."""
    return RigidBody(mass=node.mass, inertia=np.diag([0.0, 0.0, node.inertia]))


def planar_beam(link: Link) -> FlexibleBody:
    """
    Return a link along x that bends across, along y.

    Eqs. (19), (21) and (23) of Korayem et al. 2009; the integrals are those of its mode shapes.

    """
    rho, L, modes = link.linear_density, link.length, link.mode_shapes()
    inertia = link.rotary_inertia
    m = modes.count
    slope, bend = np.zeros((m, 3, 3)), np.zeros((m, m, 3, 3))
    slope[:, Y, X] = -rho * modes.moment
    # a displacement across moves mass away from the axes x and z
    bend[:, :, X, X] = bend[:, :, Z, Z] = rho * modes.gram
    return FlexibleBody(
        mass=rho * L, first_moment=np.array([*link.first_moment, 0.0]),
        inertia=np.diag([0.0, inertia, inertia]),
        displacement=_row(Y, rho * modes.area), inertia_slope=slope, inertia_bend=bend,
        moment=_row(Z, rho * modes.moment), cross_moment=np.zeros((m, m, 3)),
        gram=rho * modes.gram, stiffness=modes.stiffness,
        damping=2 * link.damping_ratios * np.sqrt(
            np.diag(modes.stiffness) * rho * np.diag(modes.gram)),
        tip=np.array([L, 0.0, 0.0]), tip_displacement=_row(Y, modes.tip_deflection),
        tip_turn=_row(Z, modes.tip_slope))


def _row(axis: int, values: Array) -> Array:
    """Return a matrix of three rows, one of which has values."""
    matrix = np.zeros((3, values.size))
    matrix[axis] = values
    return matrix
