"""
Find the shortest time for a motion, plan at a price of time, and trade payload for time.

    tools/run python examples/minimum_time.py

"""

from __future__ import annotations

from pathlib import Path
import sys

from flex_planner import find_min_duration, load_arm, plan_path, Task
from flex_planner.capacity.min_duration import payload_against_duration
from flex_planner.planning.objectives import minimum_time
from matplotlib.figure import Figure
import numpy as np

PICTURE = Path('output') / 'minimum_time.png'


def main() -> None:
    """Plan one motion in these three ways."""
    arm = load_arm('korayem_rigid')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])

    # as fast as the motors can: a bracket again, with a certified plan at its upper end
    shortest = find_min_duration(task)
    if not shortest.solved:
        sys.exit(shortest.message)
    print(f'shortest time with 1 kg: {shortest.local_lower:.5f} to {shortest.duration:.5f} s')

    # at a price: the duration is free, and every second adds to the cost
    for price in (1.0, 10.0, 100.0):
        plan = plan_path(minimum_time(task, price))
        print(f'at a price of {price:5.1f} per second: {plan.task.duration:.4f} s, '
              f'effort {plan.effort:7.2f} N^2 m^2 s, {plan.status.value}')

    # the same front from its other side: less time, less payload
    durations = np.linspace(1.3, 0.7, 5)
    front = list(payload_against_duration(task, durations))
    for found in front:
        print(f'in {found.task.duration:.2f} s: {found.payload:.3f} kg')

    figure = Figure(figsize=(6, 4), layout='constrained')
    axes = figure.subplots()
    axes.plot([found.task.duration for found in front], [found.payload for found in front], 'o-')
    axes.plot(shortest.duration, task.payload_mass, 's', label='shortest time with 1 kg')
    axes.set(xlabel='duration [s]', ylabel='largest payload [kg]', title=arm.name)
    axes.legend()
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE)
    print(f'picture: {PICTURE}')


if __name__ == '__main__':
    main()
