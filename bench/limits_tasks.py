"""Random motions, rigid and flexible, and random limits on the way that they break."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from bench.limits_judge import place_of
from bench.random_tasks import random_task
import casadi as ca
from flex_planner import load_arm, Task
from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
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
from flex_planner.planning.plan import Plan
import numpy as np

RIGID = ('range', 'speed', 'post', 'line', 'links past a post')
FLEXIBLE = (*RIGID, 'moment', 'deflection')
# of the rigid tasks' durations: more than limits of the motors alone take
_SLOWER = 1.15
# a second limit, of another kind
_SECOND = 0.3
# of flexible tasks
_RIGIDITIES, _PAYLOADS, _STROKE = (20.0, 100.0), (0.0, 1.5), np.deg2rad(100.0)
_SLACKS = (1.15, 1.8)


def rigid_task(seed: int) -> Task:
    """Return a task of a random arm of two rigid links."""
    task = random_task(seed)
    return replace(task, duration=_SLOWER * task.duration)


def flexible_task(seed: int) -> Task:
    """Return a task of the paper's arm with a random rigidity, one mode for each link."""
    draw = np.random.default_rng([seed, 50, 2026])
    arm = _flexible_arm(float(np.exp(draw.uniform(*np.log(_RIGIDITIES)))))
    payload = float(draw.uniform(*_PAYLOADS))
    start = np.array([draw.uniform(-np.pi, np.pi), draw.uniform(-2.4, 2.4)])
    change = draw.uniform(-_STROKE, _STROKE, 2)
    motors = [joint.motor for joint in arm.joints]
    quickest = max(
        max(2 * np.sqrt(abs(angle) * inertia / motor.stall_torque),
            1.6 * abs(angle) / motor.no_load_speed)
        for angle, inertia, motor in zip(change, _inertias(arm, payload), motors, strict=True))
    return Task(arm=arm, start_positions=start, goal_positions=start + change,
                payload_mass=payload, duration=float(quickest * draw.uniform(*_SLACKS)),
                effort_weights=[1 / motor.stall_torque**2 for motor in motors])


@cache
def _preset() -> Arm:
    return load_arm('korayem_ei50')


def _flexible_arm(rigidity: float) -> Arm:
    links = tuple(replace(link, flexural_rigidity=rigidity, modes=1) for link in _preset().links)
    return replace(_preset(), links=links)


def _inertias(arm: Arm, payload: float) -> list[float]:
    """Return what each joint turns with the arm stretched out [kg m^2]."""
    found = []
    for joint in range(arm.n_joints):
        base, inertia = 0.0, 0.0
        for link in arm.links[joint:]:
            inertia += link.mass * ((base + link.length / 2)**2 + link.length**2 / 12)
            base += link.length
        found.append(inertia + payload * base**2)
    return found


def draw_limits(free: Plan, kinds: tuple[str, ...], seed: int) -> tuple[PathConstraint, ...]:
    """Return one limit or two, the first of which a free motion breaks; none if there is none."""
    draw = np.random.default_rng([seed, len(kinds), 7])
    first = seed % len(kinds)
    found = [_draw(free, kinds[first], draw)]
    if found[0] is not None and draw.random() < _SECOND:
        other = (first + int(draw.integers(1, len(kinds)))) % len(kinds)
        found.append(_draw(free, kinds[other], draw))
    if found[0] is None:
        return ()
    return tuple(one for one in found if one is not None)


def _draw(free: Plan, kind: str, draw: np.random.Generator) -> PathConstraint | None:
    """Return a limit of a kind that a free motion breaks; None where that is not to be had."""
    if kind in ('range', 'speed'):
        return _of_joint(free, kind, draw)
    if kind in ('moment', 'deflection'):
        return _of_link(free, kind, draw)
    if kind == 'line':
        return _line(free.uniform_samples(401).tip, free.arm.reach, draw)
    return _post(free, kind, draw)


def _of_joint(free: Plan, kind: str, draw: np.random.Generator) -> PathConstraint | None:
    samples = free.uniform_samples(401)
    joint, share = int(draw.integers(2)), draw.uniform(0.2, 0.7)
    angle = samples.coordinates[:, joint]
    ends = sorted([float(angle[0]), float(angle[-1])])
    if kind == 'speed':
        peak = float(np.abs(samples.rates[:, joint]).max())
        limit = peak * (1 - 0.5 * share)
        mean = (ends[1] - ends[0]) / free.task.duration
        return JointSpeed(joint=joint + 1, limit=limit) if limit > 1.15 * mean else None
    over, under = float(angle.max()) - ends[1], ends[0] - float(angle.min())
    if max(over, under) < 0.02:
        return None
    return (JointRange(joint=joint + 1, upper=ends[1] + share * over) if over > under
            else JointRange(joint=joint + 1, lower=ends[0] - share * under))


def _of_link(free: Plan, kind: str, draw: np.random.Generator) -> PathConstraint:
    """Return a limit of the middle of a link, 60 to 90 % of what the free motion has there."""
    link, share = int(draw.integers(2)), float(draw.uniform(0.6, 0.9))
    peak = float(np.abs(free.uniform_samples(401).coordinates[:, 2 + link]).max())
    part = free.arm.links[link]  # a half wave of a sine
    if kind == 'moment':
        return BendingMoment(link=link + 1, stations=(0.5,), limit=share * peak
                             * part.flexural_rigidity * (np.pi / part.length)**2)
    return Deflection(link=link + 1, stations=(0.5,), limit=share * peak / part.length)


def _post(free: Plan, kind: str, draw: np.random.Generator) -> KeepOut | None:
    """Return a post in the way of the tip, clear of both ends."""
    tip = free.uniform_samples(401).tip
    k = int(draw.uniform(0.3, 0.7) * len(tip))
    along = tip[k + 1] - tip[k - 1]
    normal = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-12)
    radius = float(draw.uniform(0.04, 0.12) * free.arm.reach)
    center = tip[k] + draw.uniform(-0.6, 0.6) * radius * normal
    stations = 3 if kind.startswith('links') else 0
    clear = min(float(np.linalg.norm(place - center)) for place in _at_ends(free, stations))
    return KeepOut(region=Circle(center=tuple(center), radius=radius), stations=stations) if (
        clear > 1.1 * radius) else None


def _at_ends(free: Plan, stations: int) -> list[Array]:
    """Return where the tip and stations of the links are at both ends."""
    task, last, places = free.task, free.arm.n_joints - 1, list[Array]()
    shares = [(link, k / stations) for link in range(last + 1) for k in range(1, stations + 1)]
    for angles in (task.start_positions, task.goal_positions):
        q = ca.DM(np.pad(angles, (0, free.arm.n_coordinates - free.arm.n_joints)))
        for link, share in [*shares, (last, 1.0)]:
            x, y = place_of(task, link, share, q)
            places.append(np.array([float(x), float(y)]))
    return places


def _line(tip: Array, reach: float, draw: np.random.Generator) -> KeepOut | None:
    """Return a line that the tip crosses between its ends."""
    k = int(draw.uniform(0.3, 0.7) * len(tip))
    along = tip[k + 1] - tip[k - 1]
    normal = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-12)
    heights = (tip - tip[k]) @ normal
    ends, peak = heights[[0, -1]], heights[np.abs(heights - heights[[0, -1]].mean()).argmax()]
    if peak > ends.max() + 0.02 * reach:
        level, way = ends.max() + draw.uniform(0.3, 0.7) * (peak - ends.max()), -1.0
    elif peak < ends.min() - 0.02 * reach:
        level, way = ends.min() + draw.uniform(0.3, 0.7) * (peak - ends.min()), 1.0
    else:
        return None
    return KeepOut(region=HalfPlane(point=tuple(tip[k] + level * normal),
                                    normal=tuple(way * normal)))
