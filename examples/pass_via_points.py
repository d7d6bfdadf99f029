"""
Pass points on the way: at a given time, and at the time that is best.

A via point is passed without a stop. Its time may be given, or left to the planner; then the
Hamiltonian does not jump there, and no other time near it is cheaper.

    tools/run python examples/pass_via_points.py

"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flex_planner import load_arm, plan_path, Task
from flex_planner.optimal_control.via_points import ViaPoint
from matplotlib.figure import Figure

PICTURE = Path('output') / 'pass_via_points.png'
POINT = (0.40, 0.25)


def main() -> None:
    """Plan a motion without and with a via point, and draw the paths of the tip."""
    arm = load_arm('korayem_ei50')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0, payload_mass=1.0,
                               effort_weights=[0.125, 0.125])
    tasks = {
        'no via point': task,
        'passed at 0.5 s': replace(task, via_points=(ViaPoint(point=POINT, time=0.5),)),
        'passed when it is best': replace(task, via_points=(ViaPoint(point=POINT),))}

    figure = Figure(figsize=(10, 4.5), layout='constrained')
    path, torque = figure.subplots(1, 2)
    for name, each in tasks.items():
        plan = plan_path(each)
        samples = plan.uniform_samples(501)
        times = ', '.join(f'{time:.4f} s' for time in plan.via_times) or 'never'
        print(f'{name}: J = {plan.cost:.4f}, passed at {times}, missed by '
              f'{plan.certificate.via_error * 1e3:.1e} mm')
        path.plot(*samples.tip.T, label=name)
        torque.plot(samples.times, samples.torques[:, 0], label=name)
    path.plot(*POINT, 'ko')
    path.set(title='path of the tip', xlabel='x [m]', ylabel='y [m]', aspect='equal')
    torque.set(title='torque of joint 1', xlabel='time [s]', ylabel='[N m]')
    path.legend(fontsize='small')
    PICTURE.parent.mkdir(exist_ok=True)
    figure.savefig(PICTURE)
    print(f'picture: {PICTURE}')


if __name__ == '__main__':
    main()
