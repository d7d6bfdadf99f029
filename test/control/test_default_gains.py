"""Gains where nobody has given any."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Link, Node
from flex_planner.arms.arm_files import load_arm
from flex_planner.control.controlled_motion import ControlledArm
from flex_planner.control.default_gains import default_gains
from flex_planner.control.feedback_stability import feedback_growth
from flex_planner.control.joint_controller import JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
import numpy as np
from presets import PLANAR_PRESETS
import pytest

BENT = np.array([[0.0, 0.5, 0.5], [0.3, 1.2, 1.2], [0.0, 2.0, 2.0]])


# next to nothing turns at once with a joint of the first, the last turns more than 10 kg m^2
LIGHT_OR_HEAVY = {'de_luca_siciliano', 'asen_single', 'rome_flexarm', 'space_beam'}


@pytest.mark.parametrize('name', PLANAR_PRESETS)
def test_every_preset_is_stable_with_them(name: str) -> None:
    arm = load_arm(name)
    dynamics = ArmDynamics.of(arm)
    gains = default_gains(dynamics)
    if name not in LIGHT_OR_HEAVY:
        assert gains.stiffness.tolist() == [100.0] * arm.n_joints
        assert gains.damping.tolist() == [10.0] * arm.n_joints
    controlled = ControlledArm(dynamics=dynamics, parameters=PhysicalParameters.of_arm(arm),
                               controller=JointController(gains=gains))
    # undamped vibrations beyond half the rate may grow by less than 1 % a second
    assert feedback_growth(controlled, BENT[:, :arm.n_joints]) < 0.01


def test_joint_that_turns_much_has_gains_in_proportion() -> None:
    arm = load_arm('korayem_rigid')
    heavy = replace(arm, links=tuple(
        replace(link, linear_density=300 * link.linear_density) for link in arm.links))
    # 600 and 75 kg m^2
    assert default_gains(ArmDynamics.of(heavy)).stiffness.tolist() == [6000.0, 750.0]


def test_hub_without_inertia_has_low_gains_and_a_slower_controller_lower_ones() -> None:
    # rotary flexible link of a student laboratory (ASEN 2003, Colorado): 0.0005 kg m^2 at the hub
    link = Link(length=0.45, linear_density=0.06 / 0.45, flexural_rigidity=0.272, modes=2,
                mode_family='clamped_free')
    arm = Arm(name='laboratory', links=(link,), joints=(load_arm('single_link').joints[0],),
              nodes=(Node(inertia=0.0005), Node(mass=0.05)))
    gains = default_gains(ArmDynamics.of(arm))
    assert 1 < gains.stiffness[0] < 10
    assert gains.damping[0] == pytest.approx(gains.stiffness[0] / 10)
    slow = default_gains(ArmDynamics.of(arm), rate=200.0)
    assert slow.stiffness[0] == pytest.approx(gains.stiffness[0] / 5, rel=0.05)
