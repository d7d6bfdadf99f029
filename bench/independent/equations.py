"""
The equations of motion of an arm by virtual power, over points of mass along its links.

Points are complex numbers: link j, turned by the angle alpha_j, adds e^(i alpha_j) (a + i v) to
them, with a along the link and v across it, where the link bends. The virtual power of what moves
the points and of their inertia gives the equations without a derivative of an energy.

"""

from __future__ import annotations

from dataclasses import dataclass

from bench.independent.shapes import Array, shapes
from flex_planner.arms.arm import Arm
import numpy as np
from numpy.typing import NDArray

# Gauss points of a link: for products of three shapes of a family to rounding
_POINTS = 20


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Equations:
    """
    An arm with its payload as k points of mass and n + 1 bodies that turn; n_t coordinates.

    Attributes
    ----------
    masses : numpy.ndarray, shape (k,)
        [kg].
    along : numpy.ndarray, shape (n, k)
        What each link adds to a point, along the link [m].
    across : numpy.ndarray, shape (n, k, n_t)
        The same across the link, per coordinate.
    angles : numpy.ndarray, shape (n, n_t)
        Angle of each link per coordinate.
    turning : numpy.ndarray, shape (n_t, n_t)
        What bodies that turn add to the mass matrix.
    stiffness : numpy.ndarray, shape (n_t, n_t)
        Of the links.
    friction : numpy.ndarray, shape (n_t,)
        Of joints and modes.
    gravity : complex
        [m/s^2].
    stall, slope : numpy.ndarray, shape (n,)
        Torque of the motors at standstill [N m], and what they lose per speed [N m s/rad].

    """

    masses: Array
    along: Array
    across: Array
    angles: Array
    turning: Array
    stiffness: Array
    friction: Array
    gravity: complex
    stall: Array
    slope: Array

    @classmethod
    def of(cls, arm: Arm, payload: float, inertia: float) -> Equations:
        """Return an arm that carries a payload [kg] with a rotary inertia [kg m^2]."""
        builder = _Builder(arm)
        builder.add_links()
        builder.add_tip(payload, inertia)
        motors = [joint.motor for joint in arm.joints]
        return cls(
            masses=np.array(builder.masses), along=np.array(builder.along).T.copy(),
            across=np.array(builder.across).transpose(1, 0, 2).copy(), angles=builder.angles,
            turning=builder.turning, stiffness=builder.stiffness, friction=builder.friction,
            gravity=complex(*arm.gravity),
            stall=np.array([motor.stall_torque for motor in motors]),
            slope=np.array([motor.stall_torque / motor.no_load_speed
                            if np.isfinite(motor.no_load_speed) else 0.0 for motor in motors]))

    @property
    def n(self) -> int:
        """Return the number of joints."""
        return len(self.angles)

    def mass_and_force(self, q: Array, rates: Array) -> tuple[Array, Array]:
        """
        Return M and the forces without motors, shape (..., n_t, n_t) and (..., n_t).

        Parameters
        ----------
        q, rates : numpy.ndarray, shape (..., n_t)
            Coordinates and their rates.

        """
        turned = np.exp(1j * (q @ self.angles.T))
        place = self.along + 1j * self._bent(q)
        arms = turned[..., None] * place  # what each link adds to each point
        jacobian = 1j * (np.swapaxes(arms, -1, -2) @ self.angles + self._carried(turned))
        spin = (rates @ self.angles.T)[..., None]
        # of the points if no coordinate accelerated
        bending = turned[..., None] * self._bent(rates)
        acceleration = -(spin**2 * arms + 2 * spin * bending).sum(-2)
        back = np.conj(np.swapaxes(jacobian, -1, -2)) * self.masses
        force = (back @ (self.gravity - acceleration)[..., None])[..., 0].real
        return ((back @ jacobian).real + self.turning,
                force - q @ self.stiffness - self.friction * rates)

    def acceleration(self, q: Array, rates: Array, torque: Array) -> Array:
        """Return q'' (..., n_t) under torques of the motors (..., n)."""
        mass, force = self.mass_and_force(q, rates)
        force[..., :self.n] += torque
        columns = np.linalg.solve(mass, force[..., None])
        return columns[..., 0].astype(np.float64, copy=False)

    def limited(self, torque: Array, speeds: Array) -> Array:
        """Return what motors make of torques at joint speeds (..., n)."""
        lost = self.slope * speeds
        return np.clip(torque, -self.stall - lost, self.stall - lost)

    def tip(self, q: Array) -> Array:
        """Return the tip, the last of the points, shape (2,) [m]."""
        place = (self.along + 1j * self._bent(q))[:, -1]
        point = (np.exp(1j * (self.angles @ q)) * place).sum()
        return np.array([point.real, point.imag])

    def rest(self, joints: Array) -> Array:
        """Return coordinates (n_t,) at rest with joint angles (n,), by Newton's method."""
        q = np.concatenate([joints, np.zeros(len(self.friction) - self.n)])
        for _ in range(30):
            q[self.n:] += np.linalg.solve(
                self.locked_stiffness(q), self.mass_and_force(q, 0 * q)[1][self.n:])
        return q

    def locked_stiffness(self, q: Array) -> Array:
        """Return the stiffness of the modes with joints held, by central differences."""
        moves = 1e-5 * np.eye(len(q))[self.n:]
        force = [self.mass_and_force(q + sign * moves, 0 * moves)[1] for sign in (1, -1)]
        slope = (force[1] - force[0])[:, self.n:] / 2e-5
        symmetric: Array = (slope + slope.T) / 2
        return symmetric

    def _bent(self, q: Array) -> Array:
        """Return how far each link carries each point across itself, shape (..., n, k)."""
        n, k, size = self.across.shape
        bent: Array = (q @ self.across.reshape(n * k, size).T).reshape(*q.shape[:-1], n, k)
        return bent

    def _carried(self, turned: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return the sum over links of e^(i alpha) times `across`, shape (..., k, n_t)."""
        n, k, size = self.across.shape
        found: NDArray[np.complex128] = turned @ self.across.reshape(n, k * size)
        return found.reshape(*turned.shape[:-1], k, size)


class _Builder:
    """Collects points and bodies from the base outwards."""

    def __init__(self, arm: Arm) -> None:
        size, n = arm.n_coordinates, arm.n_joints
        self.arm, self.size, self.n = arm, size, n
        self.masses: list[float] = []
        self.along: list[Array] = []
        self.across: list[Array] = []
        self.angles = np.zeros((n, size))
        self.turning, self.stiffness = np.zeros((size, size)), np.zeros((size, size))
        self.friction = np.zeros(size)
        # of the base of the next link, per link and coordinate, and its angle
        self.base, self.shift, self.angle = np.zeros(n), np.zeros((n, size)), np.zeros(size)

    def add_links(self) -> None:
        """Add all links, with the node at the base of each."""
        first = self.n
        for index, link in enumerate(self.arm.links):
            self.angle = self.angle + np.eye(self.size)[index]
            self.angles[index] = self.angle
            self.friction[index] = self.arm.joints[index].viscous_friction
            self._add_node(index)
            self._add_beam(index, slice(first, first + link.modes))
            self._go_to_tip(index, slice(first, first + link.modes))
            first += link.modes

    def add_tip(self, payload: float, inertia: float) -> None:
        """Add the last node, and the payload there."""
        self._add_node(self.n)
        self._add_point(payload, self.base, self.shift)
        self._add_body(inertia)

    def _add_beam(self, index: int, modes: slice) -> None:
        link = self.arm.links[index]
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
        stations, lengths = (nodes + 1) * link.length / 2, weights * link.length / 2
        bent = shapes(link, stations)
        for station, length, row in zip(stations, lengths, bent, strict=True):
            along, across = self.base.copy(), self.shift.copy()
            along[index] += station
            across[index, modes] += row
            self._add_point(link.linear_density * length, along, across)
        if link.modes:
            curved = shapes(link, stations, 2)
            stiffness = link.flexural_rigidity * (curved.T * lengths) @ curved
            self.stiffness[modes, modes] = stiffness
            own = np.diag(link.linear_density * (bent.T * lengths) @ bent)
            damping: Array = np.sqrt(np.diag(stiffness) * own)
            self.friction[modes] = 2 * link.damping_ratio * damping

    def _go_to_tip(self, index: int, modes: slice) -> None:
        link = self.arm.links[index]
        self.base, self.shift, self.angle = (
            self.base.copy(), self.shift.copy(), self.angle.copy())
        self.base[index] += link.length
        if link.mode_family != 'pinned_pinned':  # whose next link is measured from the chord
            end = np.array([link.length])
            self.shift[index, modes] += shapes(link, end)[0]
            self.angle[modes] += shapes(link, end, 1)[0]

    def _add_node(self, index: int) -> None:
        self._add_point(self.arm.nodes[index].mass, self.base, self.shift)
        self._add_body(self.arm.nodes[index].inertia)

    def _add_body(self, inertia: float) -> None:
        self.turning += inertia * np.outer(self.angle, self.angle)

    def _add_point(self, mass: float, along: Array, across: Array) -> None:
        self.masses.append(mass)
        self.along.append(along)
        self.across.append(across)
