"""
Torques without jumps: what turns slowly, and what that costs.

A plan of least effort starts with a jump of the torque, which no drive follows. With a price on
the rates of the torques, or bounds of them, torques begin and end at what holds the arm; an
objective of the speeds goes with both.

    tools/run python examples/torques_without_jumps.py

"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import sys

from flex_planner import load_arm, Objectives, plan_path, Task
from flex_planner.plotting import draw_motion, save
import numpy as np

TURN = 0.02  # [s], over which torques may turn
LARGEST = 150.0  # [N m/s]


def main() -> None:
    """Plan with jumps, with a price on rates, with bounds, and with slower joints."""
    task = Task.between_points(load_arm('korayem_ei50'), (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])
    jumping = plan_path(task)
    start = np.abs(jumping.sample([0.0]).torques[0]).max()
    print(f'least effort: the torque jumps by {start:.2f} N m at the start, '
          f'J = {jumping.cost:.4f}')

    priced = replace(task, torque_rate_weight=task.effort_weights * TURN**2)
    bounded = replace(priced, max_torque_rate=np.full(2, LARGEST))
    slower = Objectives(max_joint_speeds=[1.0, 1.2])
    for name, smooth, objectives in (('a price', priced, None), ('bounds', bounded, None),
                                     ('slower joints', bounded, slower)):
        plan = plan_path(smooth, objectives=objectives)
        if not plan.solved:
            sys.exit(plan.message)
        speeds = np.abs(plan.uniform_samples(1001).rates[:, :2]).max(axis=0)
        print(f'{name}: rates up to {", ".join(f"{rate:.0f}" for rate in plan.torque_rates)} '
              f'N m/s, speeds up to {", ".join(f"{one:.2f}" for one in speeds)} rad/s, '
              f'J = {plan.cost:.4f}')
    save(draw_motion(plan), Path('output') / 'torques_without_jumps.png')


if __name__ == '__main__':
    main()
