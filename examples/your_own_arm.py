"""
Describe your own arm in a file, print its properties, and plan with it.

An arm file has physical quantities in SI units, docs/arm_files.md lists them. This one is an
aluminium beam at a hub, clamped, upright under gravity. Its functions are compiled when it is
first used, which takes some seconds, and kept for the next time.

    tools/run python examples/your_own_arm.py

"""

from __future__ import annotations

from pathlib import Path

from flex_planner import load_arm, plan_path, Task
from flex_planner.arms.arm_files import ArmFileError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.plotting import draw_arm, save
from flex_planner.reports.arm import describe_arm
import numpy as np

FOLDER = Path('output')
ARM = """
name: Aluminium beam on a hub
gravity: [0.0, -9.81]
links:
  - length: 0.8
    density: 2700.0
    youngs_modulus: 7.0e+10
    section: {width: 0.04, thickness: 0.004}
    modes: 2
    mode_family: clamped_mass   # shapes of a cantilever with a load...
    shape_mass: 0.2             # ...of about the expected payload
    shape_inertia: 0.0
    damping_ratio: 0.005
joints:
  - motor: {stall_torque: 6.0, no_load_speed: 8.0}
    viscous_friction: 0.02
nodes:
  - {inertia: 0.01}
  - {}
"""


def main() -> None:
    """Write the file, read it, use it."""
    FOLDER.mkdir(exist_ok=True)
    file, misspelt = FOLDER / 'my_arm.yaml', FOLDER / 'my_arm_misspelt.yaml'
    file.write_text(ARM)
    misspelt.write_text(ARM.replace('damping_ratio', 'dampingratio'))
    try:
        load_arm(str(misspelt))
    except ArmFileError as error:  # every mistake is named by its place in the file
        print(f'the mistake is found: {error}\n')

    arm, payload = load_arm(str(file)), 0.2
    model = ArmModel.of(arm)  # its compiled functions, which plans of the same arm share
    hanging, level = np.array([-np.pi / 2]), np.array([0.0])
    print(describe_arm(model, [hanging, level], payload), '\n')
    save(draw_arm(model, [hanging, level], payload), FOLDER / 'my_arm.png')

    # the states at both ends are those of the arm at rest, bent by its weight
    plan = plan_path(Task(arm=arm, start_positions=hanging, goal_positions=level, duration=1.0,
                          payload_mass=payload))
    print(f'hanging to level in 1 s: {plan.status.value}, {plan.strategy}')
    print(f'tip error {plan.certificate.tip_error * 1e3:.1e} mm, remaining vibration '
          f'{plan.certificate.residual_vibration * 1e3:.1e} mm')
    for warning in plan.warnings:  # what a certificate cannot know
        print(f'warning: {warning.sentence}')
    print(f'pictures and files: {FOLDER}/my_arm*')


if __name__ == '__main__':
    main()
