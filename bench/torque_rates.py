"""
Motions of two rigid links with prices and bounds of the rates of torques, by IPOPT.

A programme of its own, on Radau collocation of textbook equations of two rigid links, with torque
as a state and its rate as the control. ``python -m bench.torque_rates`` prints the limits of the
paper's motion; `bench.rates_battery` holds random motions against it.

"""

from __future__ import annotations

from dataclasses import replace
import sys
from typing import Any

import casadi as ca
from flex_planner import load_arm, Task
from flex_planner.base.validation import Array
from flex_planner.planning.plan import Plan
import numpy as np

_DEGREE = 3
# of J, beside a payload or a duration, so that a motion is the only one
_TINY = 1e-7
_SHORTEST, _LONGEST, _HEAVIEST = 0.05, 1e3, 1e4


def find_limit(task: Task, *, payload: bool, intervals: int) -> float:
    """
    Return the largest payload [kg] or the shortest duration [s] of two rigid links; nan for none.

    Parameters
    ----------
    task : Task
        Of an arm in a horizontal plane, at rest at both ends.
    payload : bool
        Whether the payload is free, else the duration.
    intervals : int
        Of equal length.

    """
    found = _optimise(task, 'payload' if payload else 'duration', intervals, None)
    return np.nan if found is None else float(found[-2 if payload else -1])


def find_cost(task: Task, intervals: int, plan: Plan | None = None) -> float:
    """Return the least cost of a task from a plan or a straight line, inf for none."""
    found = _optimise(task, '', intervals, plan)
    return np.inf if found is None else float(found[0])


def _optimise(task: Task, free: str, intervals: int, plan: Plan | None) -> Array | None:
    """Return cost, payload and duration of the best motion with one of these free, or none."""
    K, roots = intervals * _DEGREE, ca.collocation_points(_DEGREE, 'radau')
    C, _, B = ca.collocation_coeff(roots)
    q, v, a, u, r = (ca.SX.sym(name, 2, K) for name in 'qvaur')
    m, T = ca.SX.sym('m'), ca.SX.sym('T')
    step, rows, margins, cost = T / intervals, list[Any](), list[Any](), ca.SX(0)
    motors = [joint.motor for joint in task.arm.joints]
    stall = ca.DM([motor.stall_torque for motor in motors])
    slope = ca.DM([motor.torque_slope for motor in motors])
    R, S = ca.DM(task.effort_weights), ca.DM(task.torque_rate_prices)
    first: list[Any] = [ca.DM(task.start_positions), ca.DM.zeros(2), ca.DM.zeros(2)]
    for k in range(intervals):
        part = slice(k * _DEGREE, (k + 1) * _DEGREE)
        for i, (x, rate) in enumerate(((q, v), (v, a), (u, r))):
            values = ca.horzcat(first[i], x[:, part])
            rows.append(ca.vec(values @ C - step * rate[:, part]))
            first[i] = x[:, part.stop - 1]
        for j, weight in zip(range(part.start, part.stop), np.ravel(B), strict=True):
            rows.append(_torques(task, m, q[:, j], v[:, j], a[:, j]) - u[:, j])
            cost += step * weight * (ca.dot(R, u[:, j]**2) + ca.dot(S, r[:, j]**2)) / 2
            margins += [stall - slope * v[:, j] - u[:, j], stall + slope * v[:, j] + u[:, j]]
    rows += [first[0] - ca.DM(task.goal_positions), first[1], first[2]]
    equations, inequalities = ca.vertcat(*rows), ca.vertcat(*margins)
    aim = {'payload': -m + _TINY * cost, 'duration': T + _TINY * cost}.get(free, cost)
    unknowns = ca.vertcat(*(ca.vec(each) for each in (q, v, a, u, r)), m, T)
    solver = ca.nlpsol('limit', 'ipopt', {
        'x': unknowns, 'f': aim, 'g': ca.vertcat(equations, inequalities)}, {
            'ipopt': {'print_level': 0, 'sb': 'yes', 'max_iter': 800}, 'print_time': False})
    endless, bounds = np.full(8 * K, np.inf), np.tile(task.torque_rate_bounds, K)
    given = [task.payload_mass, task.duration]
    least = [0.0 if free == 'payload' else given[0], _SHORTEST if free == 'duration' else given[1]]
    most = [_HEAVIEST if free == 'payload' else given[0],
            _LONGEST if free == 'duration' else given[1]]
    times = np.concatenate([(k + np.array(roots)) / intervals for k in range(intervals)])
    start = np.concatenate([_straight(task, times) if plan is None else _along(plan, times),
                            np.zeros(2 * K), np.array(given)])
    found = solver(x0=start, lbx=np.concatenate([-endless, -bounds, least]),
                   ubx=np.concatenate([endless, bounds, most]), lbg=0, ubg=ca.vertcat(
                       ca.DM.zeros(equations.numel()), ca.inf * ca.DM.ones(inequalities.numel())))
    if not solver.stats()['success']:
        return None
    spent = ca.Function('cost', [unknowns], [cost])(found['x'])
    return np.append(float(spent), np.ravel(found['x'])[-2:])


def _straight(task: Task, times: Array) -> Array:
    """Return q, v, a and u on a straight line at shares (k,) of the duration, (8 k,)."""
    way = task.goal_positions - task.start_positions
    return np.concatenate([(task.start_positions + np.outer(times, way)).ravel(),
                           np.tile(way / task.duration, times.size), np.zeros(4 * times.size)])


def _along(plan: Plan, times: Array) -> Array:
    """Return q, v, a and u of a plan at shares (k,) of its duration, (8 k,)."""
    at = plan.sample(times * plan.task.duration)
    return np.concatenate([each.ravel() for each in (
        at.coordinates, at.rates, at.accelerations, at.torques)])


def _torques(task: Task, load: Any, q: Any, v: Any, a: Any) -> Any:
    """Return the torques of two rigid links that carry a load, as textbooks have them."""
    (l_1, l_2), (m_1, m_2) = ([link.length for link in task.arm.links],
                              [link.mass for link in task.arm.links])
    alpha = m_1 * l_1**2 / 3 + m_2 * (l_1**2 + l_2**2 / 3) + load * (l_1**2 + l_2**2)
    beta, delta = (m_2 / 2 + load) * l_1 * l_2, (m_2 / 3 + load) * l_2**2
    c, s = ca.cos(q[1]), ca.sin(q[1])
    return ca.vertcat(
        (alpha + 2 * beta * c) * a[0] + (delta + beta * c) * a[1]
        - beta * s * (2 * v[0] * v[1] + v[1]**2),
        (delta + beta * c) * a[0] + delta * a[1] + beta * s * v[0]**2)


def main() -> None:
    """Print the limits for some bounds and meshes."""
    task = Task.between_points(load_arm('korayem_rigid'), (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])
    for rate in (900.0, 300.0):
        bounded = replace(task, max_torque_rate=np.full(2, rate))
        for intervals in (50, 100, 200):
            payload, duration = (find_limit(bounded, payload=free, intervals=intervals)
                                 for free in (True, False))
            sys.stdout.write(f'{rate:g} N m/s, {intervals} intervals: {payload:.6g} kg, '
                             f'{duration:.6g} s\n')


if __name__ == '__main__':
    main()
