"""Motions whose largest payload or shortest duration is known."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.optimal_control.task import Task

G = 9.81  # [m/s^2]
# of section 5.3's motion: kg in 1 s, enclosed within 1e-6 kg by prices of 1e4 to 1e5 a kilogram;
# s with 1 kg, enclosed within 1e-6 s by prices up to 1e5 a second
HEAVIEST = {'rigid': 5.855140, 'ei5': 5.741828}
SHORTEST = {'rigid': 0.642097, 'ei5': 0.649512}


def one_link(duration: float, **changes: Any) -> Task:
    """Return the motion of a link with u_max = 2 N m and M = 1 kg m^2 + m_p (1 m)^2 by 0.5 rad."""
    link = Link(length=1.0, linear_density=3.0)
    arm = Arm(name='one', links=(link,), joints=(Joint(motor=Motor(stall_torque=2.0)),))
    return Task(arm=arm, start_positions=[0.1], goal_positions=[0.6], duration=duration,
                **changes)


def lifted_to(angle: float, duration: float, **changes: Any) -> Task:
    """Return the motion of a pendulum of 0.3 kg and 1 m with 6 N m, from -0.5 rad on."""
    return Task(arm=pendulum(6.0), start_positions=[-0.5], goal_positions=[angle],
                duration=duration, **changes)


def pendulum(stall_torque: float) -> Arm:
    """Return a link of 0.3 kg and 1 m under gravity."""
    link = Link(length=1.0, linear_density=0.3)
    return Arm(name='pendulum', links=(link,), gravity=[0, -G],
               joints=(Joint(motor=Motor(stall_torque=stall_torque)),))
