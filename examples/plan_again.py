"""
Plan again on the way: the arm moves and bends when its goal is changed.

Two clamped links in a vertical plane. Half way to a point, another point is asked for; the new
plan begins with the whole state that the arm has then. Without ROS.

    tools/run python examples/plan_again.py

"""

from __future__ import annotations

from dataclasses import replace
import sys

from flex_planner import load_arm, plan_path, Task
from flex_planner.planning.plan import Plan
import numpy as np


def solved(task: Task) -> Plan:
    """Return the plan of a task, or end."""
    plan = plan_path(task)
    if not plan.solved:
        sys.exit(plan.message)
    return plan


def main() -> None:
    """Plan a motion, then the rest of it, then a way to another point."""
    level = load_arm('clamped_motors')
    strong = replace(level.joints[0].motor, stall_torque=60.0)
    arm = replace(level, gravity=np.array([0.0, -9.81]),
                  joints=tuple(replace(joint, motor=strong) for joint in level.joints))
    first = solved(Task.between_points(arm, (0.2, -0.8), (0.7, -0.4), elbow=1, duration=1.6,
                                       payload_mass=1.0))
    # points are where the tip rests, though the links sag: joint angles are those of the bent arm
    at_goal = first.sample(1.6)
    print(f'the tip rests at ({at_goal.tip[0, 0]:.4f}, {at_goal.tip[0, 1]:.4f}) m; the modes of '
          f'link 1 are displaced by {at_goal.coordinates[0, 2] * 1e3:.2f} mm')

    now = first.sample(0.8)
    n = arm.n_joints
    state = {'start_positions': now.coordinates[0, :n], 'start_velocities': now.rates[0],
             'start_modal_displacements': now.coordinates[0, n:]}
    print(f'at 0.8 s the tip is at ({now.tip[0, 0]:.4f}, {now.tip[0, 1]:.4f}) m and joints move '
          f'at {np.degrees(now.rates[0, :n]).round(1)} deg/s')

    # the rest of the best motion is the best rest
    rest = solved(replace(first.task, start_point=np.zeros(0), duration=0.8, **state))
    later = rest.sample(0.4).coordinates - first.sample(1.2).coordinates
    print(f'planned again to the same point: J = {rest.cost:.4f} of {first.cost:.4f}, and at most '
          f'{np.abs(later).max():.0e} from the first plan')

    other = solved(Task.to_point(arm, goal=(0.6, -0.6), elbow=1, duration=1.0, payload_mass=1.0,
                                 **state))
    print(f'to another point: J = {other.cost:.4f}, tip error '
          f'{other.certificate.tip_error * 1e3:.0e} mm')


if __name__ == '__main__':
    main()
