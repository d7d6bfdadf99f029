"""
Reduce the vibration of the links during a motion: weigh the rates of the bending in the cost.

Section 5.5 of Korayem et al. 2009. A plan of least effort leaves no vibration behind, but the
links vibrate while it lasts. `minimum_vibration` puts a weight on the modal rates; the joints then
move more smoothly, at more effort.

    tools/run python examples/minimum_vibration.py

"""

from __future__ import annotations

from pathlib import Path

from flex_planner import load_arm, plan_path, Task
from flex_planner.planning.objectives import minimum_effort, minimum_vibration
from matplotlib.figure import Figure
import numpy as np

PICTURE = Path('output') / 'minimum_vibration.png'
WEIGHT = 500.0


def main() -> None:
    """Plan the same motion twice and compare."""
    arm = load_arm('korayem_ei5')
    n = arm.n_joints
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0)
    tasks = {'minimum effort': minimum_effort(task),
             'minimum vibration': minimum_vibration(task, WEIGHT)}

    figure = Figure(figsize=(10, 7), layout='constrained')
    grid = figure.subplots(2, 2, sharex=True, sharey='row')
    print(f'modal rates of {", ".join(arm.modal_names)}')
    for column, (name, each) in enumerate(tasks.items()):
        plan = plan_path(each)
        samples = plan.uniform_samples(2001)
        rates = samples.rates[:, n:] * 1e3
        rms = ', '.join(f'{value:.2f}' for value in np.sqrt((rates**2).mean(axis=0)))
        print(f'{name}: {rms} mm/s (root mean square), effort {plan.effort:.3f} N^2 m^2 s')
        grid[0, column].plot(samples.times, rates, label=arm.modal_names)
        grid[0, column].set(title=name, ylabel='modal rates [mm/s]')
        grid[1, column].plot(samples.times, samples.torques, label=['joint 1', 'joint 2'])
        grid[1, column].set(xlabel='time [s]', ylabel='torques [N m]')
    for axes in grid[:, 0]:
        axes.legend(fontsize='small')
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE)
    print(f'picture: {PICTURE}')


if __name__ == '__main__':
    main()
