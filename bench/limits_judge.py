"""
IPOPT's cheapest motion within limits on the way, by a transcription of its own.

Radau's points, limits at the points; the arm by the points of mass of `bench.independent`, joints
and places on its links by the angles of a textbook. Nothing of the solver that is judged is used.
IPOPT keeps limits at its points only, and finds local minima as all do.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bench.independent.equations import Equations
from bench.independent.shapes import Array, shapes
import casadi as ca
from flex_planner import Task
from flex_planner.optimal_control.path_constraints import (
    BendingMoment,
    Circle,
    Deflection,
    HalfPlane,
    JointRange,
    JointSpeed,
    KeepOut,
    PathConstraint,
)
import numpy as np

_DEGREE = 3
_OPTIONS: Any = {'ipopt': {'print_level': 0, 'sb': 'yes', 'tol': 1e-8, 'max_iter': 300},
                 'print_time': False}
# of the moments of mass: what is smaller is rounding
_NO_MASS = 1e-13


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """
    Coordinates, rates and accelerations at times, a start for IPOPT.

    Attributes
    ----------
    times : numpy.ndarray, shape (k,)
        From 0 to the duration [s].
    coordinates, rates, accelerations : numpy.ndarray, shape (n_t, k)
        At these times.

    """

    times: Array
    coordinates: Array
    rates: Array
    accelerations: Array

    @classmethod
    def straight(cls, task: Task) -> Motion:
        """Return joints on a straight line, by a polynomial of degree 5, and straight links."""
        share = np.linspace(0, 1, 201, dtype=np.float64)
        change = np.zeros((task.arm.n_coordinates, 1))
        change[:task.arm.n_joints, 0] = task.goal_positions - task.start_positions
        begin = np.zeros_like(change)
        begin[:task.arm.n_joints, 0] = task.start_positions
        moved = [share**3 * (10 + share * (6 * share - 15)),
                 30 * share**2 * (1 - share)**2 / task.duration,
                 60 * share * (1 - share) * (1 - 2 * share) / task.duration**2]
        return cls(times=share * task.duration, coordinates=begin + change * moved[0],
                   rates=change * moved[1], accelerations=change * moved[2])

    def at(self, times: Array) -> Array:
        """Return all values at times (j,), one after the other, each point's together."""
        rows = np.vstack([self.coordinates, self.rates, self.accelerations])
        values = np.array([np.interp(times, self.times, row) for row in rows])
        n_t = len(self.coordinates)
        return np.concatenate([values[part:part + n_t].T.ravel()
                               for part in (0, n_t, 2 * n_t)])


class Judge:
    """
    The motions of one task within limits, of arms of rigid and of pinned-pinned links.

    Parameters
    ----------
    task : Task
        Between joint angles, from rest to rest, without gravity and via points.
    constraints : sequence of PathConstraint
        Ranges and speeds of joints, circles, half-planes, moments and deflections.
    intervals : int
        Of the transcription, each with three points.

    """

    def __init__(self, task: Task, constraints: Sequence[PathConstraint], intervals: int) -> None:
        self._task, self.intervals = task, intervals
        n_t = task.arm.n_coordinates
        q, v, a = (ca.SX.sym(name, n_t) for name in 'qva')
        slacks = ca.vertcat(*(express(task, one, q, v) for one in constraints))
        self._slacks = ca.Function('slacks', [q, v], [slacks])
        forces = self.forces(q, v, a)
        torques, passive = forces[:task.arm.n_joints], forces[task.arm.n_joints:]
        self._point = ca.Function('point', [q, v, a], [
            passive, ca.vertcat(self._motors(v, torques), slacks),
            ca.dot(ca.DM(task.effort_weights) * torques, torques) / 2])
        points = np.array(ca.collocation_points(_DEGREE, 'radau'))
        self._step = task.duration / intervals
        self.times: Array = ((np.arange(intervals)[:, None] + points) * self._step).ravel()
        self._solver, self._count = self._transcribe()

    def slacks(self, coordinates: Array, rates: Array) -> Array:
        """Return the slacks of a motion (k, n_t), shape (k, n_c)."""
        values: Array = np.array(self._slacks(coordinates.T, rates.T)).T
        return values

    def cost(self, starts: Sequence[Motion]) -> float:
        """Return the cost of the cheapest motion that is found from some starts; inf for none."""
        found = [self._solve(start) for start in starts]
        return min(found, default=np.inf)

    def _solve(self, start: Motion) -> float:
        equal, unequal = self._count
        answer = self._solver(x0=start.at(self.times), lbg=0, ubg=ca.vertcat(
            ca.DM.zeros(equal), ca.inf * ca.DM.ones(unequal)))
        return float(answer['f']) if self._solver.stats()['success'] else np.inf

    def _transcribe(self) -> tuple[Any, tuple[int, int]]:
        """Return the solver, and how many equations and inequalities it has."""
        task, n_t = self._task, self._task.arm.n_coordinates
        _, _, weights = ca.collocation_coeff(ca.collocation_points(_DEGREE, 'radau'))
        K = self.intervals * _DEGREE
        q, v, a = (ca.MX.sym(name, n_t, K) for name in 'qva')
        passive, unequal, effort = self._point.map(K)(q, v, a)
        start, goal = (ca.DM(np.pad(angles, (0, n_t - task.arm.n_joints)))
                       for angles in (task.start_positions, task.goal_positions))
        rest = ca.DM.zeros(n_t)
        equal = ca.vertcat(self._follow(q, v, start), self._follow(v, a, rest),
                           ca.vec(passive), q[:, -1] - goal, v[:, -1])
        cost = self._step * ca.dot(ca.DM(np.tile(np.array(weights).ravel(), self.intervals)).T,
                                   effort)
        programme: Any = {'x': ca.vertcat(ca.vec(q), ca.vec(v), ca.vec(a)), 'f': cost,
                          'g': ca.vertcat(equal, ca.vec(unequal))}
        return (ca.nlpsol('judge', 'ipopt', programme, _OPTIONS),
                (equal.numel(), unequal.numel()))

    def _follow(self, x: Any, rate: Any, begin: Any) -> Any:
        """Return what polynomials of x lack of having a rate at the points."""
        coefficients, _, _ = ca.collocation_coeff(ca.collocation_points(_DEGREE, 'radau'))
        slopes = np.array(coefficients)
        ends = x[:, _DEGREE - 1::_DEGREE]
        parts = [ca.horzcat(begin, ends[:, :-1]),
                 *(x[:, k::_DEGREE] for k in range(_DEGREE))]
        return ca.vertcat(*(ca.vec(
            sum(slope * part for slope, part in zip(slopes[:, j], parts, strict=True))
            - self._step * rate[:, j::_DEGREE]) for j in range(_DEGREE)))

    def _motors(self, v: Any, torques: Any) -> Any:
        """Return what the limits of the motors leave, as shares of their stall torques."""
        slacks = []
        for joint, one in enumerate(self._task.arm.joints):
            motor = one.motor
            if np.isfinite(motor.stall_torque):
                lost = (v[joint] / motor.no_load_speed if np.isfinite(motor.no_load_speed)
                        else 0.0)
                share = torques[joint] / motor.stall_torque
                slacks += [1 - lost - share, 1 + lost + share]
            if motor.max_torque is not None and np.isfinite(motor.max_torque):
                share = torques[joint] / motor.max_torque
                slacks += [1 - share, 1 + share]
        return ca.vertcat(*slacks)

    def forces(self, q: Any, v: Any, a: Any) -> Any:
        """Return the forces that a motion takes, by virtual power; 0 those of the modes."""
        task = self._task
        arm = Equations.of(task.arm, task.payload_mass, task.payload_inertia)
        assert not arm.gravity
        forces = ca.DM(arm.turning) @ a + ca.DM(arm.stiffness) @ q + ca.DM(arm.friction) * v
        for along, across in _points(arm):
            x, y = _place(ca.DM(arm.angles) @ q, ca.DM(along), ca.DM(across) @ q)
            place = ca.vertcat(x, y)
            slopes = ca.jacobian(place, q)
            speed = slopes @ v
            forces += slopes.T @ (slopes @ a + ca.jtimes(speed, q, v))
        return forces


def _points(arm: Equations) -> list[tuple[Array, Array]]:
    """
    Return points of unit mass that move as all masses do: along (n,) and across (n, n_t) each.

    Forces of inertia are squares of what carries the points, so any points with the same sums of
    squares will do: the eigenvectors of these sums.

    """
    n, count = arm.along.shape
    carried = np.vstack([arm.along, arm.across.transpose(0, 2, 1).reshape(-1, count)])
    values, vectors = np.linalg.eigh((carried * arm.masses) @ carried.T)
    return [(row[:n], row[n:].reshape(n, -1))
            for value, vector in zip(values, vectors.T, strict=True)
            if value > _NO_MASS * values[-1] for row in [np.sqrt(value) * vector]]


def _place(angles: Any, along: Any, across: Any) -> tuple[Any, Any]:
    """Return the sum of vectors along and across directions at angles."""
    c, s = ca.cos(angles), ca.sin(angles)
    return ca.dot(along, c) - ca.dot(across, s), ca.dot(along, s) + ca.dot(across, c)


def express(task: Task, constraint: PathConstraint, q: Any, v: Any) -> Any:
    """Return what must be >= 0 of coordinates and rates (n_t,), by formulas of its own."""
    if isinstance(constraint, JointRange):
        angle = q[constraint.joint - 1]
        return ca.vertcat(*([constraint.upper - angle] if constraint.upper < np.inf else []),
                          *([angle - constraint.lower] if constraint.lower > -np.inf else []))
    if isinstance(constraint, JointSpeed):
        share = v[constraint.joint - 1] / constraint.limit
        return ca.vertcat(1 - share, 1 + share)
    if isinstance(constraint, KeepOut):
        return ca.vertcat(*(_stay_out(constraint, *place_of(task, link, share, q))
                            for link, share in _watched(task, constraint)))
    assert isinstance(constraint, BendingMoment | Deflection)
    shares = _bent(task, constraint, q)
    return ca.vertcat(1 - shares, 1 + shares)


def _watched(task: Task, constraint: KeepOut) -> list[tuple[int, float]]:
    """Return links and shares of their lengths: the tip, and stations if there are any."""
    last, stations = task.arm.n_joints - 1, constraint.stations
    return [(last, 1.0), *((link, (k + 1) / stations) for link in range(last + 1)
                           for k in range(stations) if (link, k) != (last, stations - 1))]


def place_of(task: Task, link: int, share: float, q: Any) -> tuple[Any, Any]:
    """Return the place at a share of a link, whose ends are on its chord."""
    arm = task.arm
    angles = ca.cumsum(q[:arm.n_joints])
    x = sum((arm.links[j].length * ca.cos(angles[j]) for j in range(link)), 0.0)
    y = sum((arm.links[j].length * ca.sin(angles[j]) for j in range(link)), 0.0)
    length = share * arm.links[link].length
    bend = _shape(task, link, np.array([length]), 0) @ q
    c, s = ca.cos(angles[link]), ca.sin(angles[link])
    return x + length * c - bend * s, y + length * s + bend * c


def _stay_out(constraint: KeepOut, x: Any, y: Any) -> Any:
    """Return how far a place is from a region, in a way that is smooth."""
    region = constraint.region
    if isinstance(region, Circle):
        away = (x - region.center[0])**2 + (y - region.center[1])**2
        return away / region.radius**2 - 1
    assert isinstance(region, HalfPlane)
    normal = np.array(region.normal) / np.linalg.norm(region.normal)
    return (x - region.point[0]) * normal[0] + (y - region.point[1]) * normal[1]


def _bent(task: Task, constraint: BendingMoment | Deflection, q: Any) -> Any:
    """Return moments or deflections at stations as shares of the limit."""
    link = task.arm.links[constraint.link - 1]
    stations = np.array(constraint.stations) * link.length
    if isinstance(constraint, BendingMoment):
        curved = _shape(task, constraint.link - 1, stations, 2) @ q
        return link.flexural_rigidity * curved / constraint.limit
    return _shape(task, constraint.link - 1, stations, 0) @ q / (
        constraint.limit * link.length)


def _shape(task: Task, link: int, stations: Array, derivative: int) -> Any:
    """Return a derivative of a link's shapes at stations (k,) by coordinates, (k, n_t)."""
    arm = task.arm
    first = arm.n_joints + sum(one.modes for one in arm.links[:link])
    rows = np.zeros((stations.size, arm.n_coordinates))
    assert not arm.links[link].modes or arm.links[link].mode_family == 'pinned_pinned'
    rows[:, first:first + arm.links[link].modes] = shapes(arm.links[link], stations, derivative)
    return ca.DM(rows)
