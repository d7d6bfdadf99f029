"""
Plan a motion of a flexible arm, look at its certificate, sample and draw it.

The motion is that of Korayem et al. 2009, section 5.2: the tip of a two-link arm goes from
(0.5, 0) m to (0.5, 0.5) m in a second with 1 kg, at the least effort, within the limits of its
motors. Without ROS.

    tools/run python examples/plan_a_path.py

"""

from __future__ import annotations

from pathlib import Path
import sys

from flex_planner import load_arm, plan_path, Task
from flex_planner.planning.plan import Samples
from flex_planner.plotting import draw_motion, Motion, save
import numpy as np

PICTURE = Path('output') / 'plan_a_path.png'


def main() -> None:
    """Plan a motion, then print and draw it."""
    arm = load_arm('korayem_ei50')  # a preset of config/arms, or the path of a YAML file
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])
    plan = plan_path(task)
    if not plan.solved:  # a failure is a status with a reason, never an exception
        sys.exit(plan.message)

    print(f'{plan.status.value} by a {plan.strategy} in {plan.planning_time:.2f} s: '
          f'J = {plan.cost:.6f}')
    print(f'tip error of the re-simulated motion {plan.certificate.tip_error * 1e3:.1e} mm, '
          f'remaining vibration {plan.certificate.residual_vibration * 1e3:.1e} mm')

    # any instants may be asked for: the plan is a polynomial in every interval of its mesh
    print('\n  t [s]    torques [N m]     tip [m]           bending of the middle of link 1 [mm]')
    for row in zip(*_rows(plan.sample(np.linspace(0, 1, 6, dtype=float))), strict=True):
        print('{:7.2f} {:8.3f} {:8.3f} {:9.4f} {:8.4f} {:10.4f}'.format(*row))

    save(draw_motion(Motion.of(plan, ['shoulder', 'elbow'])), PICTURE)
    print(f'\npicture: {PICTURE}')


def _rows(samples: Samples) -> list[list[float]]:
    """Return the columns of the table."""
    # coordinates: two joint angles, then the modes link by link; in the middle of a link its
    # first mode is 1 and its second is 0
    bending = samples.coordinates[:, 2] * 1e3
    return [column.tolist() for column in (samples.times, *samples.torques.T, *samples.tip.T,
                                           bending)]


if __name__ == '__main__':
    main()
