"""Random arms and tasks, for adversaries that look for answers that are wrong."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.validation import Array
from flex_planner.optimal_control.task import Task
import numpy as np

_GRAVITY = 9.81
# of a motor's stall torque by what inertia asks for, or gravity: accelerations [rad/s^2], reserve
_ACCELERATIONS, _RESERVES = (3.0, 15.0), (1.2, 2.2)
_LARGEST_STROKE = np.deg2rad(200.0)
# durations by a rough guess of the shortest
_SLACKS = (1.0, 1.8)


def random_task(seed: int, *, links: int = 2, gravity: bool = False) -> Task:
    """Return a task of a rigid arm, R = 1/stall^2, without payload."""
    draw = np.random.default_rng([seed, links, gravity, 2026])
    lengths, densities = draw.uniform(0.25, 0.8, links), draw.uniform(1.5, 9.0, links)
    inertias, loads = _stretched(lengths, lengths * densities)
    stall = inertias * draw.uniform(*_ACCELERATIONS, links)
    if gravity:
        stall += loads * draw.uniform(*_RESERVES, links)
    speeds = draw.uniform(2.5, 8.0, links)
    start = draw.uniform(-np.pi, np.pi, links)
    goal = start + draw.uniform(-_LARGEST_STROKE, _LARGEST_STROKE, links)
    strokes = np.abs(goal - start)
    quickest = np.maximum(2 * np.sqrt(strokes * inertias / (stall - gravity * loads / 2)),
                          1.6 * strokes / speeds).max()
    arm = Arm(
        name=f'random {seed}', gravity=[0.0, -_GRAVITY * gravity],
        links=tuple(Link(length=float(length), linear_density=float(density))
                    for length, density in zip(lengths, densities, strict=True)),
        joints=tuple(Joint(motor=Motor(stall_torque=float(torque), no_load_speed=float(speed),
                                       max_torque=np.inf))
                     for torque, speed in zip(stall, speeds, strict=True)))
    return Task(arm=arm, start_positions=start, goal_positions=goal,
                duration=float(quickest * draw.uniform(*_SLACKS)), effort_weights=1 / stall**2)


def link_mass(task: Task) -> float:
    """Return the mass of all links [kg]."""
    return sum(link.mass for link in task.arm.links)


def with_payload(task: Task, payload: float) -> Task:
    """Return a task with another payload [kg]."""
    return replace(task, payload_mass=payload)


def _stretched(lengths: Array, masses: Array) -> tuple[Array, Array]:
    """Return what each joint turns, and holds, with the arm stretched out [kg m^2, N m]."""
    inertias, loads = np.zeros(lengths.size), np.zeros(lengths.size)
    for joint in range(lengths.size):
        base = 0.0
        for length, mass in zip(lengths[joint:], masses[joint:], strict=True):
            middle = base + length / 2
            inertias[joint] += mass * (middle**2 + length**2 / 12)
            loads[joint] += mass * _GRAVITY * middle
            base += length
    return inertias, loads
