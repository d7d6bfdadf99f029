"""What a task gives away about all of its motions: energies at both ends, distances, motors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points, payload_position, payload_velocity
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.validation import Array
from flex_planner.dynamics.rigid_inertia import RigidInertia
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np

# of energies: what rounding can have taken from them
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class EndEnergy:
    """
    The energy of a state above the least that the arm can have at rest.

    Parameters
    ----------
    bare, per_payload : float
        Without the payload's mass [J], and what each kilogram of it adds [J/kg].
    size, size_per_payload : float
        Sums of the parts of both, which say what is lost in rounding [J], [J/kg].

    """

    bare: float
    per_payload: float
    size: float
    size_per_payload: float

    def most(self, payload: float) -> float:
        """Return the energy with a payload, or a little more [J]."""
        return max(self.bare + self.per_payload * payload + self._doubt(payload), 0.0)

    def least(self, payload: float) -> float:
        """Return the energy with a payload, or a little less [J]."""
        return max(self.bare + self.per_payload * payload - self._doubt(payload), 0.0)

    def ceiling(self, payload: float, tip_mass: float) -> float:
        """
        Return what the energy per mass at the tip is at most with this payload or more.

        Times the mass at the tip with this payload, `tip_mass` [kg] more than the payload
        itself; the energy per mass tends to `per_payload` as the payload grows [J].

        """
        limit = self.per_payload + _ROUNDING * self.size_per_payload
        return max(self.most(payload), limit * (payload + tip_mass))

    def _doubt(self, payload: float) -> float:
        return _ROUNDING * (self.size + payload * self.size_per_payload)


def knows_bounds(arm: Arm) -> bool:
    """
    Return whether bounds of the motions of an arm are known.

    They follow from the mass matrices of planar arms in all postures, see `RigidInertia`. Of
    spatial arms nothing is proved here.

    """
    return not isinstance(arm, SpatialArm)


class MotionFacts:
    """
    What holds for every motion of a task.

    Parameters
    ----------
    problem : MotionProblem
        The task.

    Attributes
    ----------
    stall, drag : numpy.ndarray, shape (n,)
        K_1 [N m], and K_2 with the viscous friction of the joint [N m s/rad].
    held : numpy.ndarray, shape (n,)
        K_1 with the Coulomb friction of the joint, which helps motors that brake [N m].
    caps, friction : numpy.ndarray, shape (n,)
        The most torque that drives at any speed [N m], and viscous friction [N m s/rad].
    power : float
        What the motors can give at most, less what friction takes [W]; infinite without a
        no-load speed and without friction.
    rigid, weightless : bool
        Whether the links are rigid, and whether there is no gravity.
    limited : bool
        Whether every motor has a stall torque.
    hard_joints : numpy.ndarray of bool, shape (n,)
        Which joints must reach their goal.
    reaches, stops : bool
        Whether all positions of the goal must be met, and all rates, too.

    """

    def __init__(self, problem: MotionProblem) -> None:
        self.problem, self.arm = problem, problem.model.arm
        given, n_t = problem.parameters, self.arm.n_coordinates
        self.friction = np.array([joint.viscous_friction for joint in self.arm.joints])
        # of the line, which a cap only makes narrower
        self.stall, self.drag = given.stall_torque, given.torque_slope + self.friction
        self.held = self.stall + given.coulomb_friction
        # of driving motors alone: one that is driven far beyond its line brakes with more
        self.caps = given.torque_limits.standstill
        self.limited = bool(np.isfinite(self.stall).all())
        self.power = self._largest_power() if self.limited and self.drag.all() else np.inf
        self.rigid, self.weightless = not self.arm.n_passive, not self.arm.gravity.any()
        hard = np.isinf(problem.goal_weights)
        self.hard_joints = hard[:self.arm.n_joints]
        self.reaches = bool(hard[:n_t].all())
        self.stops = self.reaches and bool(hard[n_t:].all())

    def _largest_power(self) -> float:
        """Return the sum over motors of the largest power on the line and below the cap [W]."""
        # K_1 |w| - drag w^2 is largest at half the speed where it vanishes
        speeds = self.stall / (2 * self.drag)
        power = self.stall * speeds / 2
        # there or faster, where the cap leaves what the line gives
        slope = self.drag - self.friction
        capped = self.stall - slope * speeds > self.caps
        if capped.any():
            free = np.minimum((self.stall - self.caps)[capped] / slope[capped], np.divide(
                self.caps[capped], 2 * self.friction[capped], where=self.friction[capped] > 0,
                out=np.full(int(capped.sum()), np.inf)))
            power[capped] = (self.caps[capped] - self.friction[capped] * free) * free
        return float(power.sum())

    @property
    def knows_energies(self) -> bool:
        """Return whether the least energy of the arm is known, for any payload."""
        return self.rigid or self.weightless

    def inertia(self, payload: float) -> RigidInertia:
        """Return the inertia of a rigid arm with a payload [kg]."""
        return RigidInertia.of(self.arm, payload, self.problem.parameters.payload_inertia)

    @cached_property
    def tip_mass(self) -> float:
        """Return the least mass that moves with the payload's centre besides it [kg]."""
        if self.rigid:
            return 1 / self.inertia(0.0).carried_mobility
        return 0.0 if self.arm.payload_com.any() else self.arm.nodes[-1].mass

    @cached_property
    def start_energy(self) -> EndEnergy:
        """Return the energy at the start; for arms of which it is known."""
        return self._end_energy(self.problem.start)

    @cached_property
    def goal_energy(self) -> EndEnergy:
        """Return the energy at the goal; for arms of which it is known."""
        return self._end_energy(self.problem.goal)

    def _end_energy(self, state: Array) -> EndEnergy:
        """Return the energy of a state (2 n_t,)."""
        kinetic, potential = self._energies(state, 0.0)
        n_t, weight = self.arm.n_coordinates, float(np.linalg.norm(self.arm.gravity))
        speed = payload_velocity(self.arm, state[:n_t], state[n_t:])
        moving = float(speed @ speed) / 2
        if not weight:  # at rest and unbent it is 0
            return EndEnergy(bare=kinetic + potential, per_payload=moving,
                             size=kinetic + potential, size_per_payload=moving)
        inertia = self.inertia(0.0)
        bare, loaded = (inertia.first_moments(self.arm, payload).sum() for payload in (0.0, 1.0))
        lowest, hangs = -weight * float(bare), weight * float(loaded - bare)
        height = -float(self.arm.gravity @ payload_position(self.arm, state[:n_t]))
        return EndEnergy(
            bare=kinetic + potential - lowest, per_payload=moving + height + hangs,
            size=kinetic + abs(potential) - lowest, size_per_payload=moving + 2 * hangs)

    def energy_needed(self) -> float:
        """Return by how much the energy at the goal exceeds that at the start, at least [J]."""
        if not self.reaches:
            return -np.inf
        payload = self.problem.parameters.payload_mass
        before, after = (self._energies(state, payload)
                         for state in (self.problem.start, self.problem.goal))
        # at a goal that is passed, the speed is not known
        gained = (after[0] if self.stops else 0.0) + after[1] - sum(before)
        return gained - _ROUNDING * float(np.abs([*before, *after]).sum())

    def lifting(self) -> tuple[float, float]:
        """
        Return the potential energy that the goal has more, without payload and per kilogram.

        Of rigid arms [J], [J/kg].

        """
        n_t, problem = self.arm.n_coordinates, self.problem
        bare = (self._energies(problem.goal, 0.0)[1] - self._energies(problem.start, 0.0)[1])
        start, goal = (payload_position(self.arm, state[:n_t])
                       for state in (problem.start, problem.goal))
        way = goal - start
        return bare, -float(self.arm.gravity @ way)

    def distances(self) -> Array:
        """
        Return how far the ends of the links are between start and goal, shape (n,) [m].

        Instead of the tip, the payload's centre of mass.

        """
        n_t = self.arm.n_coordinates
        postures = np.stack([self.problem.start[:n_t], self.problem.goal[:n_t]])
        ends = link_points(self.arm, postures)[:, :, -1]  # (2, n, 2)
        ends[:, -1] = payload_position(self.arm, postures)
        apart: Array = np.linalg.norm(ends[1] - ends[0], axis=1)
        return apart

    def strokes(self) -> tuple[Array, Array]:
        """
        Return how far joints and links turn at least, shapes (n,), of rigid arms [rad].

        To a point they may go the other way round, see `other_windings`.

        """
        turned = (self.problem.goal - self.problem.start)[:self.arm.n_joints]
        joints, links = np.abs(turned), np.abs(np.cumsum(turned))
        if not self.problem.task.must_reach_point:
            return joints, links
        return _within_half_turn(joints), _within_half_turn(links)

    def _energies(self, state: Array, payload: float) -> tuple[float, float]:
        """Return kinetic and potential energy of a state with a payload [J]."""
        given = replace(self.problem.parameters, payload_mass=payload)
        _, kinetic, potential = self.problem.model.mass_and_energy(state[None], given.physical)
        return float(kinetic[0]), float(potential[0])


def _within_half_turn(turned: Array) -> Array:
    """Return angles >= 0, or what full turns leave of them: at most half a turn."""
    rest = turned % (2 * np.pi)
    nearest: Array = np.minimum(rest, 2 * np.pi - rest)
    return nearest
