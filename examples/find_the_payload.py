"""
Find the largest payload of an arm, and the least effort for smaller ones.

The result is a bracket: a payload that a certified plan carries, and one that is too much for the
motors. The search solves motions of least effort near the limit; ordinary plans add lighter ones.
Effort and the price of a little more payload, dJ/dm_p, are the payload-effort front.

    tools/run python examples/find_the_payload.py

"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import sys

from flex_planner import find_max_payload, load_arm, plan_path, Task
from flex_planner.optimal_control.free_payload import payload_price
from flex_planner.plotting import draw_max_payload, Motion, save

PICTURE = Path('output') / 'find_the_payload.png'


def main() -> None:
    """Search, then print and draw the bracket and the front."""
    arm = load_arm('korayem_ei50')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               effort_weights=[1 / 8, 1 / 8])
    found = find_max_payload(task, accuracy=1e-3)
    if not found.solved or found.plan is None:
        sys.exit(found.message)

    print(f'between {found.payload:.4f} kg and {found.local_upper:.4f} kg, in '
          f'{found.planning_time:.1f} s')
    for joint, share in enumerate(found.plan.saturation, 1):
        print(f'with it the motor of joint {joint} is on its limit for {share:.1%} of the time')

    print('\npayload [kg]      J     dJ/dm_p   (the last grams cost most)')
    plan = None
    for payload in (0.0, 2.0, 4.0, 5.5):
        plan = plan_path(replace(task, payload_mass=payload), start_from=plan)
        if plan.solution is not None:
            price = payload_price(plan.problem, plan.solution)
            print(f'{payload:10.4f} {plan.cost:9.4f} {price:9.3f}')
    front = found.front
    for row in zip(front.payloads, front.efforts, front.prices, strict=True):
        print('{:10.4f} {:9.4f} {:9.3f}'.format(*row))

    save(draw_max_payload(found, Motion.of(found.plan, ['shoulder', 'elbow'])), PICTURE)
    print(f'picture: {PICTURE}')


if __name__ == '__main__':
    main()
