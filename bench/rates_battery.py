"""
Random motions without jumps of the torque: plans against IPOPT's.

``python -m bench.rates_battery 20`` takes so many tasks of random rigid arms, with a price on the
rates of the torques by which these turn over a random time, every other one with bounds of rates
that the motion with the price alone breaks. No plan may break a bound, and none may cost more
than IPOPT's motion by 2e-3. The table is in docs/smooth_torques.md.

"""

from __future__ import annotations

from dataclasses import replace
import sys
import time

from bench.random_tasks import random_task
from bench.torque_rates import find_cost
from flex_planner import plan_path, Task
from flex_planner.planning.plan import Plan
import numpy as np

WORSE = 2e-3
# times over which torques turn, as shares of the duration, and bounds as shares of the peaks
_TURNS, _BOUNDS, _SLOWER = (0.005, 0.08), (0.4, 0.9), 1.15
_INTERVALS, _FINER = 60, 2


def rates_task(seed: int) -> Task | None:
    """Return a random task with a price on rates, or bounds, too; None if no motion is found."""
    draw = np.random.default_rng([seed, 11, 2026])
    task = random_task(seed)
    duration = _SLOWER * task.duration
    turn = duration * float(np.exp(draw.uniform(*np.log(_TURNS))))
    priced = replace(task, duration=duration, torque_rate_weight=task.effort_weights * turn**2)
    if seed % 2 == 0:
        return priced
    plan = plan_path(priced)
    if not plan.solved:
        return None
    return replace(priced, max_torque_rate=draw.uniform(*_BOUNDS, 2) * plan.torque_rates)


def judge(task: Task, plan: Plan) -> float:
    """Return the cost of IPOPT's cheapest motion, on a finer mesh where it seems cheaper."""
    starts = [plan if plan.solved else None, None]
    found = min(find_cost(task, _INTERVALS, start) for start in starts)
    if plan.solved and plan.cost > (1 + WORSE) * found:
        found = min(find_cost(task, _FINER * _INTERVALS, start) for start in starts)
    return found


def main(count: int) -> None:
    """Print what becomes of so many tasks, one a line, and how many are lost."""
    lost, made, seed = list[int](), 0, -1
    while made < count:
        seed += 1
        task = rates_task(seed)
        if task is None:
            continue
        made, began = made + 1, time.process_time()
        plan = plan_path(task)
        seconds = time.process_time() - began
        cost = judge(task, plan)
        own = plan.cost if plan.solved else np.inf
        worst = (float((plan.torque_rates / task.torque_rate_bounds).max()) if plan.solved
                 else np.nan)
        if cost < np.inf and own > (1 + WORSE) * cost or worst > 1 + 1e-6:
            lost.append(seed)
        sys.stdout.write(
            f'{seed:4d} {"bounds" if task.max_torque_rate.size else "price":6s} plan {own:.6g} '
            f'IPOPT {cost:.6g} share of bounds {worst:.6f} {seconds:.2f} s '
            f'{"" if plan.solved else plan.message}\n')
        sys.stdout.flush()
    sys.stdout.write(f'{made} tasks, lost: {lost or "none"}\n')


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
