"""
An allowable stress of the links, and what it costs: effort, and payload.

The links are tubes clamped to their motors. The stress in them is their bending moment divided by
the section modulus; what the material bears, divided by a safety factor, is a limit on the whole
way. In an arm file the fields are allowable_stress, section_modulus and safety_factor.

    tools/run python examples/allowable_stress.py

"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import sys

from flex_planner import find_max_payload, load_arm, plan_path, Task
from flex_planner.plotting import draw_motion, save

YIELD_STRESS, YOUNGS_MODULUS = 240e6, 70e9  # aluminium [Pa]
DIAMETER = 0.012  # of the tubes [m]


def main() -> None:
    """Plan with rising safety factors, then find the largest payload with one of them."""
    free = plan_path(task(), search='fast')
    if not free.solved:
        sys.exit(free.message)
    print(f'without a limit: J = {free.cost:.4f}')
    for factor in (2.0, 3.0, 4.0, 5.0):
        plan = plan_path(task(factor), search='fast')
        if not plan.solved:
            sys.exit(plan.message)
        nearest = min(plan.constraints, key=lambda one: one.slack)
        print(f'safety factor {factor:g}: J = {plan.cost:.4f}, {plan.cost / free.cost - 1:.1%} '
              f'more; {nearest}')
    save(draw_motion(plan), Path('output') / 'allowable_stress.png')

    for factor in (1.0, 2.0):
        found = find_max_payload(task(factor), accuracy=0.02, search='fast')
        largest = f'{found.payload:.2f} kg' if found.solved else found.message
        print(f'largest payload with safety factor {factor:g}: {largest}')


def task(factor: float = 1.0) -> Task:
    """Return a motion of two tubes that bear their yield stress divided by a factor."""
    arm = load_arm('clamped_motors')
    limited = []
    for link in arm.links:
        second_moment = link.flexural_rigidity / YOUNGS_MODULUS
        section_modulus = second_moment / (DIAMETER / 2)
        limited.append(replace(link, allowable_moment=YIELD_STRESS * section_modulus / factor))
    return Task.between_points(replace(arm, links=tuple(limited)), (0.5, 0.0), (0.5, 0.5),
                               duration=1.0, payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])


if __name__ == '__main__':
    main()
