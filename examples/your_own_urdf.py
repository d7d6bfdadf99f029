"""
Plan with an arm in space that has a URDF: see what was made of it, then move it.

`urdf/two_tubes.urdf` is what a vendor might ship, with rigid links and no motors.
`urdf/two_tubes.yaml` names its links and joints and says what bends. docs/spatial_arms.md lists
the fields. Its functions are compiled when the arm is first used, and kept for the next time.

    tools/run python examples/your_own_urdf.py

"""

from __future__ import annotations

from pathlib import Path

from flex_planner import load_arm, plan_path, Task
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.plotting import draw_motion, save
from flex_planner.reports.arm import describe_arm, standard_postures

HERE, FOLDER = Path(__file__).parent, Path('output')


def main() -> None:
    """Read both files, print what they make, plan to a point."""
    FOLDER.mkdir(exist_ok=True)
    arm = load_arm(HERE / 'urdf' / 'two_tubes.yaml')
    # masses, frequencies, sag; notes at the end of the joints say what was merged and compared
    print(describe_arm(ArmModel.of(arm), standard_postures(arm)[:1], 0.5), '\n')

    # from joint angles to a point where the tip, as gravity bends the arm, comes to rest
    task = Task.to_point(arm, [0.0, -0.3, 0.9], [0.5, 1.2, 0.9], duration=0.8, payload_mass=0.3)
    plan = plan_path(task)
    print(f'{plan.status.value}, {plan.strategy}: J = {plan.cost:.4g}')
    print(f'tip error {plan.certificate.tip_error * 1e3:.1e} mm, remaining vibration '
          f'{plan.certificate.residual_vibration * 1e3:.1e} mm')
    for warning in plan.warnings:
        print(f'warning: {warning.sentence}')
    save(draw_motion(plan), FOLDER / 'two_tubes.png')
    print(f'picture: {FOLDER}/two_tubes.png')


if __name__ == '__main__':
    main()
