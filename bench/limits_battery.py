"""
Random limits on the way of random motions: plans within them against IPOPT's.

``python -m bench.limits_battery 100`` takes that many tasks of random rigid arms, lets the free
motion break a joint's range, a speed limit, a post or a line, and compares: no plan may pass a
limit, none may cost more than IPOPT's motion by 1e-3, and where IPOPT finds one there should be
one. IPOPT solves a transcription of its own: Radau's points, limits at the points, the planar
chain by its equations here. It keeps to its points only, and finds local minima as all do.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
import sys
import time
from typing import Any

from bench.random_tasks import random_task
import casadi as ca
from flex_planner import plan_path, Task
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import (
    Circle,
    HalfPlane,
    JointRange,
    JointSpeed,
    KeepOut,
    PathConstraint,
)
from flex_planner.planning.plan import Plan
import numpy as np

_INTERVALS, _DEGREE = 50, 3
KINDS = ('range', 'speed', 'post', 'line')
WORSE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a random task came to: costs are inf where nothing was found."""

    seed: int
    kind: str
    free: float
    cost: float
    by_ipopt: float
    slack: float
    seconds: float
    message: str

    @property
    def worse(self) -> bool:
        """Return whether IPOPT's motion is cheaper, or the only one."""
        return self.by_ipopt < np.inf and not self.cost <= (1 + WORSE) * self.by_ipopt


def constrain(free: Plan, kind: str, draw: np.random.Generator) -> PathConstraint | None:
    """Return a limit that a free motion breaks; None where that is not to be had."""
    samples = free.uniform_samples(401)
    joint = int(draw.integers(2))
    angle, share = samples.coordinates[:, joint], draw.uniform(0.2, 0.7)
    ends = sorted([float(angle[0]), float(angle[-1])])
    if kind == 'range':
        over, under = float(angle.max()) - ends[1], ends[0] - float(angle.min())
        if max(over, under) < 0.02:
            return None
        return (JointRange(joint=joint + 1, upper=ends[1] + share * over) if over > under
                else JointRange(joint=joint + 1, lower=ends[0] - share * under))
    if kind == 'speed':
        peak = float(np.abs(samples.rates[:, joint]).max())
        mean = (ends[1] - ends[0]) / free.task.duration
        limit = peak * (1 - 0.5 * share)
        return JointSpeed(joint=joint + 1, limit=limit) if limit > 1.15 * mean else None
    return _block(samples.tip, free.arm.reach, kind, draw)


def _block(tip: Array, reach: float, kind: str, draw: np.random.Generator) -> KeepOut | None:
    """Return a post or a line in the way of a tip, clear of its ends."""
    k = int(draw.uniform(0.3, 0.7) * len(tip))
    along = tip[k + 1] - tip[k - 1]
    normal = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-12)
    if kind == 'post':
        radius = float(draw.uniform(0.04, 0.12) * reach)
        center = tip[k] + draw.uniform(-0.6, 0.6) * radius * normal
        clear = np.linalg.norm(tip[[0, -1]] - center, axis=1).min()
        return KeepOut(region=Circle(center=tuple(center), radius=radius)) if (
            clear > 1.1 * radius) else None
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


def judge(task: Task, constraint: PathConstraint, starts: list[Plan]) -> float:
    """Return the cost of the cheapest motion that IPOPT finds from some plans; inf for none."""
    K, T = _INTERVALS * _DEGREE, task.duration
    points = np.array(ca.collocation_points(_DEGREE, 'radau'))
    C, _, B = ca.collocation_coeff(points.tolist())
    step = T / _INTERVALS
    q, v, a = (ca.SX.sym(name, 2, K) for name in 'qva')
    rows: list[Any] = []
    bounds: list[Any] = []
    cost: Any = 0
    first: tuple[Any, Any] = (ca.DM(task.start_positions), ca.DM(task.start_velocities[:2]))
    weights = np.array(B).ravel()
    stall, slope = _motors(task)
    for k in range(_INTERVALS):
        part = slice(k * _DEGREE, (k + 1) * _DEGREE)
        for x, rate, begin in ((q, v, first[0]), (v, a, first[1])):
            values = ca.horzcat(begin, x[:, part])
            rows.append(ca.vec(values @ C - step * rate[:, part]))
        first = (q[:, (k + 1) * _DEGREE - 1], v[:, (k + 1) * _DEGREE - 1])
        for j in range(_DEGREE):
            i = k * _DEGREE + j
            u = _torques(task, q[:, i], v[:, i], a[:, i])
            cost += step * weights[j] * ca.dot(ca.DM(task.effort_weights) * u, u) / 2
            bounds += [stall - slope * v[:, i] - u, u + stall + slope * v[:, i],
                       _slacks(task, constraint, q[:, i], v[:, i])]
    rows += [first[0] - ca.DM(task.goal_positions), first[1]]
    equations, inequalities = ca.vertcat(*rows), ca.vertcat(*bounds)
    solver = ca.nlpsol('judge', 'ipopt', {
        'x': ca.vertcat(ca.vec(q), ca.vec(v), ca.vec(a)), 'f': cost,
        'g': ca.vertcat(equations, inequalities)}, {
            'ipopt': {'print_level': 0, 'sb': 'yes', 'tol': 1e-8, 'max_iter': 500},
            'print_time': False})
    times = np.concatenate([(k + points) * step for k in range(_INTERVALS)])
    best = np.inf
    for start in starts:
        given = start.sample(np.minimum(times, T))
        found = solver(x0=np.concatenate([values.ravel() for values in (
            given.coordinates, given.rates, given.accelerations)]), lbg=0,
            ubg=ca.vertcat(ca.DM.zeros(equations.numel()),
                           ca.inf * ca.DM.ones(inequalities.numel())))
        if solver.stats()['success']:
            best = min(best, float(found['f']))
    return best


def _motors(task: Task) -> tuple[Any, Any]:
    """Return stall torques and what a speed takes of them."""
    motors = [joint.motor for joint in task.arm.joints]
    return (ca.DM([motor.stall_torque for motor in motors]),
            ca.DM([motor.torque_slope for motor in motors]))


def _torques(task: Task, q: Any, v: Any, a: Any) -> Any:
    """Return the torques of two rigid links in a horizontal plane, as textbooks have them."""
    (l_1, l_2), (m_1, m_2) = ([link.length for link in task.arm.links],
                              [link.mass for link in task.arm.links])
    load = task.payload_mass
    alpha = m_1 * l_1**2 / 3 + m_2 * (l_1**2 + l_2**2 / 3) + load * (l_1**2 + l_2**2)
    beta, delta = (m_2 / 2 + load) * l_1 * l_2, (m_2 / 3 + load) * l_2**2
    c, s = ca.cos(q[1]), ca.sin(q[1])
    return ca.vertcat(
        (alpha + 2 * beta * c) * a[0] + (delta + beta * c) * a[1]
        - beta * s * (2 * v[0] * v[1] + v[1]**2),
        (delta + beta * c) * a[0] + delta * a[1] + beta * s * v[0]**2)


def _slacks(task: Task, constraint: PathConstraint, q: Any, v: Any) -> Any:
    """Return what must be >= 0, by formulas of its own."""
    if isinstance(constraint, JointRange):
        angle = q[constraint.joint - 1]
        return ca.vertcat(*(
            [constraint.upper - angle] if np.isfinite(constraint.upper) else []),
            *([angle - constraint.lower] if np.isfinite(constraint.lower) else []))
    if isinstance(constraint, JointSpeed):
        return ca.vertcat(constraint.limit - v[constraint.joint - 1],
                          constraint.limit + v[constraint.joint - 1])
    assert isinstance(constraint, KeepOut)
    first, second = (link.length for link in task.arm.links)
    x = first * ca.cos(q[0]) + second * ca.cos(q[0] + q[1])
    y = first * ca.sin(q[0]) + second * ca.sin(q[0] + q[1])
    region = constraint.region
    if isinstance(region, Circle):
        away = (x - region.center[0])**2 + (y - region.center[1])**2
        return away / region.radius**2 - 1
    assert isinstance(region, HalfPlane)
    return ((x - region.point[0]) * region.normal[0] + (y - region.point[1]) * region.normal[1])


def run(seed: int) -> Outcome | None:
    """Return the outcome of a random task; None where no limit is broken."""
    draw, kind = np.random.default_rng([seed, 7]), KINDS[seed % len(KINDS)]
    task = random_task(seed)
    task = replace(task, duration=1.15 * task.duration)
    free = plan_path(task)
    constraint = constrain(free, kind, draw) if free.solved else None
    if constraint is None:
        return None
    began = time.process_time()
    plan = plan_path(replace(task, path_constraints=(constraint,)))
    seconds = time.process_time() - began
    by_ipopt = judge(task, constraint, [plan] if plan.solved else [free])
    if plan.solved:
        by_ipopt = min(by_ipopt, judge(task, constraint, [free]))
    return Outcome(seed=seed, kind=kind, free=free.cost, seconds=seconds, by_ipopt=by_ipopt,
                   cost=plan.cost if plan.solved else np.inf, message=plan.message,
                   slack=min(one.slack for one in plan.constraints) if plan.solved else np.inf)


def main(count: int) -> None:
    """Print the outcome of so many tasks that a limit is in the way of."""
    found: list[Outcome] = []
    seed = 0
    while len(found) < count:
        outcome = run(seed)
        seed += 1
        if outcome is not None:
            found.append(outcome)
            print(f'{outcome.seed:4d} {outcome.kind:5s} free {outcome.free:.5g} plan '
                  f'{outcome.cost:.6g} IPOPT {outcome.by_ipopt:.6g} slack {outcome.slack:.1e} '
                  f'{outcome.seconds:.2f} s'
                  + (f'  {outcome.message}' if outcome.worse else ''), flush=True)
    solvable = [one for one in found if one.by_ipopt < np.inf]
    solved = sum(one.cost < np.inf for one in solvable)
    print(f'{solved} of {len(solvable)} that IPOPT solves; '
          f'{sum(one.worse and one.cost < np.inf for one in found)} dearer by {WORSE:g}; smallest '
          f'slack {min(one.slack for one in found):.1e}; CPU median '
          f'{np.median([one.seconds for one in found]):.2f} s')


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
