"""
The straight arm by NumPy alone: mass matrix, stiffness, and how it rings with its joints free.

For estimates of arms that nobody has compiled, such as the same arm with more modes. Written apart
from :mod:`flex_planner.dynamics.build_chain`, which it agrees with where the links are not bent.
Neither gravity nor damping is in it.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.arms.mechanism import FlexibleBody, Mechanism, RigidBody
from flex_planner.arms.mechanism_of_arm import mechanism_of
from flex_planner.arms.spatial_kinematics import LinkFrames, walk_links
from flex_planner.base.validation import Array
import numpy as np


def mass_matrix(arm: Arm, positions: Array, payload_mass: float,
                payload_inertia: float) -> Array:
    """
    Return the mass matrix of the arm with straight links.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    positions : numpy.ndarray, shape (n,)
        Joint angles [rad]; ways of joints that slide [m].
    payload_mass, payload_inertia : float
        At the tip [kg, kg m^2].

    Returns
    -------
    numpy.ndarray, shape (n_t, n_t)
        M of eq. (3) at zero modal displacements.

    """
    mechanism, n_t = mechanism_of(arm), arm.n_coordinates
    mass = np.diag([*(link.rotor for link in mechanism.links), *np.zeros(arm.n_passive)])
    point = _Point(place=np.zeros(3), velocity=np.zeros((3, n_t)), turning=np.zeros((3, n_t)))
    unbent = np.concatenate([positions, np.zeros(arm.n_passive)])
    at = arm.n_joints + len(arm.elastic_joints)
    for i, frames in enumerate(walk_links(mechanism, unbent)):
        link, modes = frames.link, slice(at, at + frames.link.beam.count)
        at = modes.stop
        point = point.moved_by_joint(frames, _columns(mechanism, i))
        mass += point.mass(frames.rotation, link.base)
        mass += point.flexible_mass(frames.rotation, link.beam, modes)
        point = point.at_tip(frames, modes)
        mass += point.mass(frames.tip_rotation, link.end)
    carried = _payload(mechanism, payload_mass, payload_inertia)
    return mass + point.mass(frames.tip_rotation, carried)


def _columns(mechanism: Mechanism, index: int) -> list[int]:
    """Return the coordinates that move a joint: its own, and its twist."""
    elastic = mechanism.elastic
    twist = [len(mechanism.links) + elastic.index(index)] if index in elastic else []
    return [index, *twist]


def _payload(mechanism: Mechanism, mass: float, inertia: float) -> RigidBody:
    """Return a payload in the frame of the tip."""
    com = mechanism.payload_com
    turns = np.zeros(3)
    turns[list(mechanism.payload_axes)] = inertia
    spread = com @ com * np.eye(3) - np.outer(com, com)
    return RigidBody(mass=mass, first_moment=mass * com, inertia=mass * spread + np.diag(turns))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Point:
    """A point of the arm: what rates of coordinates make of it and its frame, (3, n_t) each."""

    place: Array
    velocity: Array
    turning: Array

    def moved_to(self, place: Array) -> _Point:
        """Return another point of the same body."""
        carried = np.cross(self.turning, place - self.place, axis=0)
        return _Point(place=place, velocity=self.velocity + carried, turning=self.turning)

    def moved_by_joint(self, frames: LinkFrames, columns: list[int]) -> _Point:
        """Return the origin of a link, which its joint moves."""
        at = self.moved_to(frames.joint_position).moved_to(frames.position)
        part = at.velocity if frames.link.slides else at.turning
        part = part.copy()
        part[:, columns] += frames.axis[:, None]
        if frames.link.slides:
            return _Point(place=at.place, velocity=part, turning=at.turning)
        return _Point(place=at.place, velocity=at.velocity, turning=part)

    def at_tip(self, frames: LinkFrames, modes: slice) -> _Point:
        """Return the end of a link, which its modes move."""
        beam, at = frames.link.beam, self.moved_to(frames.tip_position)
        velocity, turning = at.velocity.copy(), at.turning.copy()
        velocity[:, modes] += frames.rotation @ beam.tip_displacement
        turning[:, modes] += frames.rotation @ beam.tip_turn
        return _Point(place=at.place, velocity=velocity, turning=turning)

    def mass(self, axes: Array, body: RigidBody | FlexibleBody) -> Array:
        """Return the part of a body whose frame is here, with axes (3, 3), unbent."""
        velocity, turning = axes.T @ self.velocity, axes.T @ self.turning
        mixed = velocity.T @ np.cross(turning, body.first_moment, axis=0)
        part: Array = (body.mass * velocity.T @ velocity + mixed + mixed.T
                       + turning.T @ body.inertia @ turning)
        return part

    def flexible_mass(self, axes: Array, body: FlexibleBody, modes: slice) -> Array:
        """Return the part of a link that bends."""
        part = self.mass(axes, body)
        coupled = (self.velocity.T @ axes @ body.displacement
                   + self.turning.T @ axes @ body.moment)
        part[:, modes] += coupled
        part[modes] += coupled.T
        part[modes, modes] += body.gram
        return part


def bending_stiffness(arm: Arm) -> Array:
    """Return the stiffness of links, eq. (23), and twists, (n_t, n_t); zero at the joints."""
    stiffness = np.zeros((arm.n_coordinates, arm.n_coordinates))
    for place, i in enumerate(arm.elastic_joints, arm.n_joints):
        elasticity = arm.joints[i].elasticity
        stiffness[place, place] = elasticity.stiffness if elasticity else 0.0
    for link, made, modal in zip(arm.links, mechanism_of(arm).links, arm.modal_slices,
                                 strict=True):
        if link.modes:
            stiffness[modal, modal] = link.flexural_rigidity * made.beam.stiffness
    return stiffness


def free_vibrations(mass: Array, stiffness: Array, n_joints: int) -> tuple[Array, Array]:
    """
    Return the vibrations of an arm whose joints are free to turn.

    Parameters
    ----------
    mass, stiffness : numpy.ndarray, shape (n_t, n_t)
        Of `mass_matrix` and `bending_stiffness`; n_f coordinates are modal.
    n_joints : int
        n: so many directions have no stiffness and are left out.

    Returns
    -------
    frequencies : numpy.ndarray, shape (n_f,)
        Angular, ascending [rad/s].
    vectors : numpy.ndarray, shape (n_t, n_f)
        Columns are displacements, orthonormal in the mass matrix.

    """
    # SciPy's `eigh` takes both matrices, but a tenth of a second to import
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    return np.sqrt(squares[n_joints:]), (inverse.T @ vectors)[:, n_joints:]
