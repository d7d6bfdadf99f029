"""
Keep joint speeds below a limit: the planner finds the smallest weights that do it.

Section 5.2 of Korayem et al. 2009, whose fig. 1 adjusts weights by hand until the motion is as
wanted. Here the limit is given, and the planner finds the weight, with the proof that a
slightly smaller one is not enough.

    tools/run python examples/keep_a_speed.py

"""

from __future__ import annotations

import sys

from flex_planner import load_arm, Objectives, plan_path, Task
from flex_planner.planning.plan import peaks
from flex_planner.reports.motion import weights_table
import numpy as np

LIMIT = 0.8  # [rad/s]


def main() -> None:
    """Plan without and with the limit, then with one that cannot be kept."""
    arm = load_arm('korayem_rigid')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])

    free = plan_path(task)
    kept = plan_path(task, objectives=speed_limit(LIMIT))
    for name, plan in (('no limit', free), (f'at most {LIMIT} rad/s', kept)):
        if not plan.solved:
            sys.exit(plan.message)
        largest = peaks(plan, plan.uniform_samples(2001)).speeds
        speeds = ', '.join(f'{speed:.4f}' for speed in largest)
        print(f'{name}: peak speeds {speeds} rad/s, effort {plan.effort:.3f} N^2 m^2 s')

    print(f'\nweights tried:\n{weights_table(kept)}')
    assert kept.objectives is not None
    for margin in kept.objectives.margins:
        print(f'w_2 = {margin.weight:.4f} keeps the limit ({margin.share:.2%} of it), '
              f'{margin.relaxed_weight:.4f} does not ({margin.relaxed_share:.2%})')

    # 0.52 rad in a second need 0.52 rad/s at the very least, and motors take time to speed up
    impossible = plan_path(task, objectives=speed_limit(0.55))
    print(f'\nat most 0.55 rad/s: {impossible.message}')


def speed_limit(limit: float) -> Objectives:
    """Return the objective that both joints stay below a speed [rad/s]."""
    return Objectives(max_joint_speeds=np.full(2, limit))


if __name__ == '__main__':
    main()
