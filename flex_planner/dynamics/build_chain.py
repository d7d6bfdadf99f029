"""
The virtual power of an arm, from its base to its tip, and its potential energy.

One forward recursion: the frame of each link is carried along with its motion and its virtual
motion, and every body adds its power. Neither energies nor accelerations are differentiated.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.arms.mechanism import FlexibleBody, Mechanism, MechanismLink
from flex_planner.arms.mechanism_of_arm import mechanism_of
from flex_planner.dynamics.body_power import (
    flexible_potential,
    flexible_power,
    Inertia,
    tip_shift,
)
from flex_planner.dynamics.chain import Chain
from flex_planner.dynamics.joint_power import JointPowers, link_angle
from flex_planner.dynamics.moving_frame import along, MovingFrame, Posture
from flex_planner.dynamics.vectors import Motion, product, total
import numpy as np


def build_chain(arm: Arm) -> Chain:
    """
    Return the symbolic dynamics of an arm.

    Parameters
    ----------
    arm : Arm
        Its flexural rigidities are left symbolic, all else enters as constants.

    """
    return chain_of(mechanism_of(arm))


def chain_of(mechanism: Mechanism) -> Chain:
    """Return the symbolic dynamics of a mechanism."""
    n = len(mechanism.links)
    n_t = mechanism.n_coordinates
    q, rates, a, y = (ca.SX.sym(name, n_t) for name in ('q', 'dq', 'a', 'y'))
    mass, inertia = ca.SX.sym('m_p'), ca.SX.sym('J_p')
    rigidity, coulomb, fading = (ca.SX.sym(name, n) for name in ('EI', 'tau_c', 'v_s'))
    motion = Motion(q, rates, a, y).apply(ca.vertsplit)
    chain = _Chain(mechanism, motion, _payload(mechanism, mass, inertia), ca.vertsplit(rigidity))
    joints = JointPowers(mechanism, motion, ca.vertsplit(coulomb), ca.vertsplit(fading))
    return Chain(coordinates=q, rates=rates, accelerations=a, virtual_rates=y, payload_mass=mass,
                 payload_inertia=inertia, rigidity=rigidity, coulomb_friction=coulomb,
                 coulomb_speed=fading, power=ca.SX(total([*chain.powers(), *joints.powers()])),
                 potential=ca.SX(total([*chain.potentials(), *joints.potentials()])))


@dataclass(frozen=True, slots=True, eq=False)
class _Chain:
    """A mechanism with the motion of its coordinates, lists of n_t."""

    mechanism: Mechanism
    motion: Motion
    payload: Inertia
    rigidity: list[Any]

    def powers(self) -> Iterator[Any]:
        """Yield the power of every body."""
        frame = MovingFrame.at_base(self.mechanism.gravity)
        for at, beam, carried, modes, rigidity in self._walk(frame):
            yield (flexible_power(beam, carried, at, modes, rigidity) if beam
                   else carried.power(at))

    def potentials(self) -> Iterator[Any]:
        """Yield the potential energy of every body."""
        frame = Posture.at_base(self.mechanism.gravity)
        for at, beam, carried, modes, rigidity in self._walk(frame):
            yield (flexible_potential(beam, carried, at, modes.value, rigidity) if beam
                   else carried.potential(at))

    def _walk(self, frame: Any) -> Iterator[tuple[Any, FlexibleBody | None, Inertia, Motion, Any]]:
        """Yield every body with its frame, modes and rigidity; bodies of tips are rigid."""
        at = len(self.mechanism.links) + len(self.mechanism.elastic)
        pending: list[tuple[int, Motion]] = []
        for i, link in enumerate(self.mechanism.links):
            frame, pending = _to_joint(frame, pending, link)
            frame = _move_joint(frame, pending, link, link_angle(self.mechanism, self.motion, i))
            pending = []
            modes = self.motion.take(slice(at, at + link.beam.count))
            at += link.beam.count
            yield frame, link.beam, Inertia.of(link.base), modes, self.rigidity[i]
            frame = frame.shift(tip_shift(link.beam, modes))
            for axis in link.tip_order:
                angle = modes.weigh(link.beam.tip_turn[axis])
                pending = pending if angle.rests else _merge(pending, axis, angle)
            end = Inertia.of(link.end)
            last = link is self.mechanism.links[-1]
            end = end + self.payload if last else end
            yield _for_body(frame, pending, end), None, end, modes, self.rigidity[i]


def _to_joint(frame: Any, pending: list[tuple[int, Motion]],
              link: MechanismLink) -> tuple[Any, list[tuple[int, Motion]]]:
    """Return the frame of a joint, with turns that may be joined with its own."""
    shifted, turned = link.position.any(), not np.array_equal(link.rotation, np.eye(3))
    if shifted or turned:
        frame, pending = _settle(frame, pending), []
    if shifted:
        rest = (0.0, 0.0, 0.0)
        x, y, z = link.position.tolist()
        frame = frame.shift(Motion((x, y, z), rest, rest, rest))
    return (frame.rotate(link.rotation) if turned else frame), pending


def _move_joint(frame: Any, pending: list[tuple[int, Motion]], link: MechanismLink,
                angle: Motion) -> Any:
    """Return the frame of a link, moved by its joint."""
    moved = angle if link.sign > 0 else angle.apply(lambda part: -part)
    if link.slides:
        frame = _settle(frame, pending).shift(moved.apply(lambda part: along(link.axis, part)))
    else:
        frame = _settle(frame, _merge(pending, link.axis, moved))
    return frame if np.array_equal(link.turned, np.eye(3)) else frame.rotate(link.turned)


def _merge(pending: list[tuple[int, Motion]], axis: int,
           angle: Motion) -> list[tuple[int, Motion]]:
    """Return turns with one more: two about the same axis are one."""
    if pending and pending[-1][0] == axis:
        return [*pending[:-1], (axis, pending[-1][1] + angle)]
    return [*pending, (axis, angle)]


def _settle(frame: Any, pending: list[tuple[int, Motion]]) -> Any:
    """Return a frame after its turns."""
    for axis, angle in pending:
        frame = frame.turn(axis, angle)
    return frame


def _for_body(frame: Any, pending: list[tuple[int, Motion]], body: Inertia) -> Any:
    """Return the frame of a body at a tip: the last turn need not be made if none can tell."""
    if not pending:
        return frame
    axis, angle = pending[-1]
    frame = _settle(frame, pending[:-1])
    return frame.spin(axis, angle) if body.spins_about(axis) else frame.turn(axis, angle)


def _payload(mechanism: Mechanism, mass: Any, inertia: Any) -> Inertia:
    """Return a payload about the tip: a mass at a point, with a rotary inertia."""
    com: Sequence[float] = mechanism.payload_com.tolist()
    turns = mechanism.payload_axes
    square = sum(entry**2 for entry in com)
    matrix = [[total([product((square if i == k else 0.0) - com[i] * com[k], mass),
                      inertia if i == k and i in turns else 0.0]) for k in range(3)]
              for i in range(3)]
    x, y, z = (product(entry, mass) for entry in com)
    return Inertia(mass, (x, y, z), matrix)
