"""
An adversary of the largest payloads of arms whose links bend: IPOPT from random starts.

``python -m bench.payload_adversary 0 4`` asks about arms with clamped links: published ones and
random ones of these seeds. IPOPT's transcription is one of its own, with Radau's points; the arm
rests at both ends as its payload bends it, its motors can hold that, and its links bend no further
than the model holds. More than the planner's payload counts once a mesh twice as fine says the
same: coarse meshes carry nearly half as much again where links ring.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
import os
import sys
import time
from typing import Any

from bench.random_tasks import link_mass, random_task
import casadi as ca
from flex_planner import load_arm, Task
from flex_planner.arms.arm import Arm
from flex_planner.base.processes import PROCESSES
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.paper.cases import paper_arm, point_to_point
from flex_planner.planning.bending import limits_of_model
import numpy as np

_DEGREE, _INTERVALS, _FINEST = 5, 40, 160
_ITERATIONS, _SECONDS, _TIME_LIMIT = 250, 60.0, 60.0
# of a payload: two meshes that say the same, and what beats an answer; how many are confirmed
STANDS, WORSE, _CONFIRMED = 0.005, 0.005, 2
# of the torques' squares, by the motors', which singular arcs need [kg]
_EFFORT = 1e-4
# of random arms: frequencies of a link alone, clamped [rad/s]; first eigenvalue of a cantilever
_FREQUENCIES, _CANTILEVER = (40.0, 120.0), 3.516
# of random starts: sines in the paths of the joints [rad]
_DETOUR, _SINES = 0.6, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What planner and adversary say of a task [kg]; NaN for nothing."""

    name: str
    payload: float
    upper: float
    status: str
    adversary: float
    seconds: float
    adversary_seconds: float

    @property
    def lost(self) -> float:
        """Return by which share of it the adversary carries more than the planner."""
        if np.isnan(self.adversary):
            return -np.inf
        return np.inf if not self.payload else self.adversary / self.payload - 1

    def __str__(self) -> str:
        beaten = '  <-- LOST' if self.lost > WORSE else ''
        return (f'{self.name}: planner {self.payload:.6g} to {self.upper:.6g} kg ({self.status}, '
                f'{self.seconds:.1f} s), adversary {self.adversary:.6g} kg '
                f'({self.adversary_seconds:.1f} s), lost {self.lost:+.2%}{beaten}')


class Adversary:
    """
    The largest payload of one task by IPOPT on one mesh.

    Parameters
    ----------
    task : Task
        Between joint angles, from rest to rest, of a planar arm.
    intervals : int
        Of the mesh, five points each.

    """

    def __init__(self, task: Task, intervals: int) -> None:
        self._task, self._points = task, intervals * _DEGREE
        self._step = task.duration / intervals
        points = np.array(ca.collocation_points(_DEGREE, 'radau'))
        self.times: Array = ((np.arange(intervals)[:, None] + points) * self._step).ravel()
        self._forces = self._derive_forces()
        self._solver, self._count = self._transcribe()

    def carry(self, start: Array, payload: float) -> tuple[float, Array] | None:
        """
        Return the largest payload and its motion from a start; None if IPOPT fails.

        Parameters
        ----------
        start : numpy.ndarray, shape (3 n_t, k)
            Coordinates, rates and accelerations at the points.
        payload : float
            [kg].

        """
        n, n_t = self._task.arm.n_joints, self._task.arm.n_coordinates
        equal, unequal = self._count
        first = np.concatenate([*(start[part:part + n_t].T.ravel()
                                  for part in (0, n_t, 2 * n_t)), start[n:n_t, 0], [payload]])
        answer = self._solver(
            x0=first, lbg=ca.DM.zeros(equal + unequal), lbx=ca.vertcat(
                -ca.inf * ca.DM.ones(first.size - 1), 0),
            ubg=ca.vertcat(ca.DM.zeros(equal), ca.inf * ca.DM.ones(unequal)))
        if not self._solver.stats()['success']:
            return None
        x = np.array(answer['x']).ravel()
        parts = x[:3 * n_t * self._points].reshape(3, self._points, n_t)
        return float(x[-1]), np.concatenate([part.T for part in parts])

    def _derive_forces(self) -> Any:
        """Return forces M a + h by coordinates, rates, accelerations and the payload."""
        arm = self._task.arm
        chain, values = build_chain(arm), Parameters.of(arm)
        mass, a = ca.SX.sym('m'), ca.SX.sym('a', arm.n_coordinates)
        numbers: Any = [(chain.payload_mass, mass), (chain.payload_inertia, 0.0),
                        (chain.rigidity, values.rigidity),
                        (chain.coulomb_friction, values.coulomb_friction),
                        (chain.coulomb_speed, values.coulomb_speed)]
        symbols = [symbol for symbol, _ in numbers]
        forces = ca.substitute([chain.inverse_dynamics(a)], symbols,
                               [ca.SX(value) for _, value in numbers])[0]
        return ca.Function('forces', [chain.coordinates, chain.rates, a, mass], [forces])

    def _transcribe(self) -> tuple[Any, tuple[int, int]]:
        """Return the solver, and how many equations and inequalities it has."""
        task, n, n_t = self._task, self._task.arm.n_joints, self._task.arm.n_coordinates
        q, v, a = (ca.MX.sym(name, n_t, self._points) for name in 'qva')
        bent, mass = ca.MX.sym('bent', n_t - n), ca.MX.sym('m')
        begin, rest = ca.vertcat(ca.DM(task.start_positions), bent), ca.DM.zeros(n_t)
        forces = self._forces.map(self._points)(q, v, a, ca.repmat(mass, 1, self._points))
        held = [self._forces(end, rest, rest, mass) for end in (begin, q[:, -1])]
        torques = forces[:n, :]
        stall = ca.DM([joint.motor.standstill_torque for joint in task.arm.joints])
        equal = ca.vertcat(
            self._follow(q, v, begin), self._follow(v, a, rest), ca.vec(forces[n:, :]),
            q[:n, -1] - ca.DM(task.goal_positions), v[:, -1], *(one[n:] for one in held))
        unequal = ca.vertcat(
            self._leave(v, torques), *(part for one in held
                                       for part in (1 - one[:n] / stall, 1 + one[:n] / stall)),
            ca.vec(self._bend(q)))
        used = ca.sumsqr(torques / ca.repmat(stall, 1, self._points)) / torques.numel()
        programme: Any = {
            'x': ca.vertcat(ca.vec(q), ca.vec(v), ca.vec(a), bent, mass),
            'f': -mass + _EFFORT * used, 'g': ca.vertcat(equal, unequal)}
        options: Any = {'ipopt': {'print_level': 0, 'sb': 'yes', 'tol': 1e-6,
                                  'max_iter': _ITERATIONS, 'max_cpu_time': _SECONDS},
                        'print_time': False}
        return (ca.nlpsol('adversary', 'ipopt', programme, options),
                (equal.numel(), unequal.numel()))

    def _follow(self, x: Any, rate: Any, begin: Any) -> Any:
        """Return what polynomials of x lack of having a rate at the points."""
        coefficients, _, _ = ca.collocation_coeff(ca.collocation_points(_DEGREE, 'radau'))
        slopes, ends = np.array(coefficients), x[:, _DEGREE - 1::_DEGREE]
        parts = [ca.horzcat(begin, ends[:, :-1]), *(x[:, k::_DEGREE] for k in range(_DEGREE))]
        return ca.vertcat(*(ca.vec(
            sum(slope * part for slope, part in zip(slopes[:, j], parts, strict=True))
            - self._step * rate[:, j::_DEGREE]) for j in range(_DEGREE)))

    def _leave(self, v: Any, torques: Any) -> Any:
        """Return what the limits of the motors leave, as shares of their torques."""
        slacks = []
        for joint, one in enumerate(self._task.arm.joints):
            motor, torque, speed = one.motor, torques[joint, :], v[joint, :]
            if np.isfinite(motor.stall_torque):
                share = torque / motor.stall_torque + speed / motor.no_load_speed
                slacks += [1 - share, 1 + share]
            if np.isfinite(motor.torque_cap):
                slacks += [1 - torque / motor.torque_cap, 1 + torque / motor.torque_cap]
        return ca.vertcat(*(ca.vec(slack) for slack in slacks))

    def _bend(self, q: Any) -> Any:
        """Return what the model leaves of the bending of the links."""
        arm, slacks = self._task.arm, []
        for limit in limits_of_model(arm):
            link, modes = arm.links[limit.link - 1], arm.modal_slices[limit.link - 1]
            shapes = link.bend_shapes(np.array(limit.stations))[:, 0]
            share = ca.DM(shapes / (limit.limit * link.length)) @ q[modes, :]
            slacks += [1 - share, 1 + share]
        return ca.vertcat(*slacks)


def random_starts(task: Task, times: Array, seed: int) -> Iterator[tuple[Array, float]]:
    """Yield motions of straight links with sines in the paths of the joints, and payloads [kg]."""
    draw, n, n_t = np.random.default_rng([seed, 2026]), task.arm.n_joints, task.arm.n_coordinates
    share, total = times / task.duration, task.duration
    stroke = (task.goal_positions - task.start_positions)[:, None]
    waves = np.arange(1, _SINES + 1) * np.pi
    detour = 0.0
    while True:
        sizes = detour * draw.normal(size=(n, _SINES)) / np.arange(1, _SINES + 1)
        start = np.zeros((3 * n_t, times.size))
        sines, cosines = np.sin(np.outer(waves, share)), np.cos(np.outer(waves, share))
        start[:n] = (task.start_positions[:, None] + sizes @ sines
                     + stroke * share**3 * (10 + share * (6 * share - 15)))
        start[n_t:n_t + n] = (sizes * waves @ cosines
                              + stroke * 30 * share**2 * (1 - share)**2) / total
        start[2 * n_t:2 * n_t + n] = (-sizes * waves**2 @ sines + stroke * 60 * share * (
            1 - share) * (1 - 2 * share)) / total**2
        yield start, float(link_mass(task) * draw.uniform(0.1, 1.0))
        detour = _DETOUR


def find_heaviest(task: Task, starts: int, enough: float, seed: int = 0) -> float:
    """Return the largest payload found; what is more than enough stands on a finer mesh."""
    coarse = Adversary(task, _INTERVALS)
    pairs = random_starts(task, coarse.times, seed)
    found = [one for _, (start, payload) in zip(range(starts), pairs, strict=False)
             if (one := coarse.carry(start, payload)) is not None]
    best = max((payload for payload, _ in found if payload <= enough), default=np.nan)
    for payload, motion in sorted(found, key=lambda one: -one[0])[:_CONFIRMED]:
        if payload > enough:
            best = np.fmax(best, _confirm(task, coarse.times, payload, motion, enough))
    return float(best)


def _confirm(task: Task, times: Array, payload: float, motion: Array, enough: float) -> float:
    """Return the payload on a mesh so fine that it stands, or is enough; NaN without one."""
    intervals = _INTERVALS
    while 2 * intervals <= _FINEST:
        intervals *= 2
        fine = Adversary(task, intervals)
        met = fine.carry(np.array([np.interp(fine.times, times, row) for row in motion]), payload)
        if met is None:
            return np.nan
        if met[0] <= enough or abs(met[0] - payload) <= STANDS * payload:
            return met[0]
        (payload, motion), times = met, fine.times
    return np.nan


def random_clamped_task(seed: int) -> Task:
    """Return a task of a random arm of two clamped links, with gravity for odd seeds."""
    task = random_task(seed, gravity=bool(seed % 2))
    draw = np.random.default_rng([seed, 9, 2026])
    links = []
    for link in task.arm.links:
        frequency = draw.uniform(*_FREQUENCIES)
        rigidity = link.linear_density * (frequency / _CANTILEVER)**2 * link.length**4
        links.append(replace(link, modes=1, mode_family='clamped_free',
                             flexural_rigidity=float(rigidity), damping_ratio=0.01))
    return replace(task, arm=replace(task.arm, links=tuple(links)))


def known_tasks() -> Iterator[tuple[str, Task]]:
    """Yield tasks whose largest payloads the documentation has."""
    for rigidity in (50.0, 5.0):
        yield f'paper, EI {rigidity:g}', point_to_point(
            paper_arm(rigidity, 1, 'clamped_free'), 0.0)
    muroran = load_arm('muroran_vertical')
    yield 'muroran_vertical', _turn(replace(muroran, links=tuple(
        replace(link, modes=1) for link in muroran.links)), (0, 45), (40, 80), 1.0)
    yield 'desk_arm', _turn(load_arm('desk_arm'), (-90, 0), (-60, 30), 2.0)


def _turn(arm: Arm, start: tuple[float, float], goal: tuple[float, float],
          duration: float) -> Task:
    return Task(arm=arm, start_positions=np.deg2rad(start), goal_positions=np.deg2rad(goal),
                duration=duration)


def ask(name: str, task: Task, starts: int) -> Answer:
    """Return what both say of a task."""
    began = time.process_time()
    found = find_max_payload(task, monitor=Monitor(
        canceled=lambda: time.process_time() - began > _TIME_LIMIT))
    middle = time.process_time()
    heaviest = find_heaviest(task, starts, (1 + WORSE) * found.payload)
    return Answer(name=name, payload=found.payload, upper=found.local_upper,
                  status=found.status.name, adversary=heaviest, seconds=middle - began,
                  adversary_seconds=time.process_time() - middle)


def run(first: int, last: int, starts: int = 6) -> list[Answer]:
    """Print and return the answers for known and for random arms."""
    os.environ[PROCESSES] = '0'  # the CPU time is that of this process
    tasks = [*known_tasks(), *((f'random {seed}', random_clamped_task(seed))
                               for seed in range(first, last))]
    answers = []
    for name, task in tasks:
        answers.append(ask(name, task, starts))
        print(answers[-1], flush=True)
    return answers


if __name__ == '__main__':
    run(*(int(text) for text in sys.argv[1:]))
