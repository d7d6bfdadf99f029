"""
Limits on the way: a post that the tip must pass, and a bending moment that links may bear.

Plans are made without limits first, then within them, from it: round the post on both sides, of
which the cheaper is taken. What is left of each limit is part of the plan. What limits cost is
effort, and payload.

    tools/run python examples/post_in_the_way.py

"""

from __future__ import annotations

from pathlib import Path
import sys

from flex_planner import find_max_payload, load_arm, plan_path, Task
from flex_planner.optimal_control.path_constraints import BendingMoment, Circle, KeepOut
from flex_planner.plotting import draw_motion, save

POST = KeepOut(region=Circle(center=(0.52, 0.25), radius=0.1), name='post')
MOMENTS = (BendingMoment(link=1, limit=0.6, stations=(0.5,)),  # [N m]
           BendingMoment(link=2, limit=0.45, stations=(0.5,)))


def main() -> None:
    """Plan round the post and with a limit of moments, then find what the post costs in load."""
    free, kept = plan_path(task('korayem_rigid')), plan_path(task('korayem_rigid', POST))
    if not (free.solved and kept.solved):
        sys.exit(kept.message)
    print(f'free J = {free.cost:.4f}, round the post J = {kept.cost:.4f}')
    print(f'nearest: {min(kept.constraints, key=lambda one: one.slack)}')
    for kind in kept.kinds:
        print(f'  {kind.sentence}')
    save(draw_motion(kept), Path('output') / 'post_in_the_way.png')

    bent, calm = plan_path(task('korayem_ei50')), plan_path(task('korayem_ei50', *MOMENTS))
    print(f'any moment J = {bent.cost:.4f}, at most 0.6 and 0.45 N m J = {calm.cost:.4f}, '
          f'{calm.status.value}')

    for limits in ((), (POST,)):
        found = find_max_payload(task('korayem_rigid', *limits))
        largest = f'{found.payload:.3f} kg' if found.solved else found.message
        print(f'largest payload {"round the post" if limits else "without"}: {largest}')


def task(arm: str, *limits: KeepOut | BendingMoment) -> Task:
    """Return the paper's motion within limits."""
    return Task.between_points(load_arm(arm), (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8],
                               path_constraints=limits)


if __name__ == '__main__':
    main()
