"""Gains have the units of their joints."""

from __future__ import annotations

from flex_planner.arms.arm_files import load_arm
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.planning.execution import describe_controller, say_gains, unstable_feedback


def test_gains_of_joints_that_slide_are_those_of_forces() -> None:
    arm = load_arm('gantry_beam')
    controller = JointController(gains=Gains.of(arm.n_joints, 100.0, 10.0))
    kinds = ''.join('s' if joint.slides else 't' for joint in arm.joints)
    assert 's' in kinds
    stiffness, damping = say_gains(controller.gains, arm)
    assert ('N/m' in stiffness) and ('N s/m' in damping)
    assert ('N m/rad' in stiffness) == ('t' in kinds)
    assert stiffness in describe_controller(controller, arm)
    assert damping in unstable_feedback(controller, 1.0, arm)
    assert say_gains(Gains.of(2, 100.0, 10.0)) == ('100, 100 N m/rad', '10, 10 N m s/rad')
