"""
Motions of random arms whose best kind is not that of a straight start: counter-examples.

Sources: a random search with an independent transcription, many starts each.

"""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.optimal_control.task import Task
import numpy as np

# largest payloads [kg], whatever the weights; a straight start leads to 1.756, 1.128 and 1.332
HEAVIEST = {'S1': 30.80, 'S12': 1.974, 'S17': 2.346}
# J of the cheapest kind of G12 and of that of a straight start
CHEAPEST, STRAIGHT = 0.559, 2.107

# lengths [m], linear densities [kg/m], stall torques [N m], no-load speeds [rad/s]
_ARMS = {'S1': ((0.609, 0.326), (4.518, 10.135), (14.022, 1.24), (3.618, 5.304)),
         'S12': ((0.693, 0.402), (3.384, 5.717), (12.089, 0.759), (7.765, 3.882)),
         'S17': ((0.631, 0.53), (4.603, 4.871), (17.145, 2.311), (6.412, 5.642))}
# start and goal [deg], duration [s]
_MOTIONS = {'S1': ((-3, -13), (-63, 184), 2.19), 'S12': ((93, -43), (26, -112), 1.65),
            'S17': ((-98, -10), (-235, -79), 1.76)}


def level_arm(name: str) -> Arm:
    """Return a rigid arm of two links without gravity."""
    lengths, densities, torques, speeds = _ARMS[name]
    links = tuple(Link(length=length, linear_density=density)
                  for length, density in zip(lengths, densities, strict=True))
    motors = (Motor(stall_torque=torque, no_load_speed=speed, max_torque=np.inf)
              for torque, speed in zip(torques, speeds, strict=True))
    return Arm(name=name, links=links, joints=tuple(Joint(motor=motor) for motor in motors))


def level_task(name: str, payload_mass: float = 0.0, **changes: Any) -> Task:
    """Return the motion of such an arm, with R = 1 / stall torque^2 if not told otherwise."""
    arm, (start, goal, duration) = level_arm(name), _MOTIONS[name]
    values: dict[str, Any] = {
        'start_positions': np.deg2rad(start), 'goal_positions': np.deg2rad(goal),
        'duration': duration, 'payload_mass': payload_mass,
        'effort_weights': [1 / joint.motor.stall_torque**2 for joint in arm.joints]}
    return Task(arm=arm, **{**values, **changes})


def lifting_task(**changes: Any) -> Task:
    """Return G12: under gravity, with a second link that bends; joint 2 best swings back first."""
    links = (Link(length=0.7302003392335195, linear_density=4.493343913031948),
             Link(length=0.5468632067254429, linear_density=4.09960842732783, modes=2,
                  flexural_rigidity=131.91917826727652, mode_family='pinned_pinned'))
    joints = (Joint(motor=Motor(stall_torque=87.42070393829658, no_load_speed=4.826830147200209,
                                max_torque=np.inf),
                    viscous_friction=0.3),
              Joint(motor=Motor(stall_torque=16.080724498187617,
                                no_load_speed=6.565635894559151, max_torque=np.inf)))
    nodes = (Node(), Node(mass=0.24366808554040148, inertia=0.022349808628205688), Node())
    arm = Arm(name='G12', links=links, joints=joints, nodes=nodes, gravity=[0.0, -9.81])
    values: dict[str, Any] = {
        'start_positions': np.deg2rad([-129.854423528, 52.594753245]),
        'goal_positions': np.deg2rad([-4.854423528, 63.633872544]),
        'duration': 1.0654177176853392, 'payload_mass': 0.8036052156683331,
        'effort_weights': [0.0013084929935771017, 0.03867130046188705]}
    return Task(arm=arm, **{**values, **changes})
