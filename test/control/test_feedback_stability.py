"""Whether a PD that is sampled and held is stable."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.arm_files import load_arm
from flex_planner.control.controlled_motion import ControlledArm
from flex_planner.control.feedback_stability import feedback_growth
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
import numpy as np
import pytest

ANGLE = np.array([[0.4]])


def single(gains: Gains, rate: float = 100.0, **changes: Any) -> ControlledArm:
    """Return a rigid link of 0.1 kg m^2 under a PD."""
    arm = Arm(name='single', joints=(Joint(),),
              links=(Link(length=1.0, linear_density=0.3, flexural_rigidity=1.0, modes=0),),
              **changes)
    return ControlledArm(dynamics=ArmDynamics.of(arm), parameters=PhysicalParameters.of_arm(arm),
                         controller=JointController(gains=gains, rate=rate))


@pytest.mark.parametrize(('stiffness', 'damping'), [(5.0, 1.0), (0.0, 19.0), (0.0, 21.0),
                                                    (30.0, 0.1)])
def test_rigid_link_has_the_eigenvalues_of_the_textbook(stiffness: float,
                                                        damping: float) -> None:
    found = feedback_growth(single(Gains.of(1, stiffness, damping)), ANGLE)
    # a double integrator with zero-order hold: z^2 - (2 - b - a) z + 1 - b + a
    a, b = stiffness * 0.01**2 / 0.1 / 2, damping * 0.01 / 0.1
    roots = np.roots([1, -(2 - b - a), 1 - b + a])
    assert found == pytest.approx(np.log(np.abs(roots).max()) * 100, rel=1e-5, abs=1e-4)


def test_damping_that_takes_twice_the_speed_in_a_period_is_unstable() -> None:
    # 2 J / T = 20 N m s/rad
    assert feedback_growth(single(Gains.of(1, 0.0, 19.0)), ANGLE) == pytest.approx(0, abs=1e-4)
    assert feedback_growth(single(Gains.of(1, 0.0, 21.0)), ANGLE) > 1


def test_growth_is_that_of_a_small_deviation() -> None:
    arm = load_arm('clamped_motors')
    dynamics = ArmDynamics.of(arm)
    controlled = ControlledArm(
        dynamics=dynamics, parameters=PhysicalParameters.of_arm(arm),
        controller=JointController(gains=Gains.of(2, 400.0, 40.0)))
    growth = feedback_growth(controlled, np.array([[0.3, 0.8]]))
    assert growth > 50
    start = np.concatenate([[0.3, 0.8], np.full(4, 1e-9), np.zeros(6)])
    still = np.concatenate([[0.3, 0.8], np.zeros(10)])
    states = controlled.follow(JointReference.hold(still[:2], np.zeros(2)), start, 0.09).states
    sizes = np.abs(states - still)[:, :6].max(axis=1)
    rate = np.polyfit(np.arange(50, 90) * 1e-3, np.log(sizes[50:90]), 1)[0]
    assert rate == pytest.approx(growth, rel=0.03)


def test_standing_link_falls_under_a_weak_pd() -> None:
    # m g l / 2 = 1.47 N m/rad
    for stiffness, falls in ((1.0, True), (2.0, False)):
        arm = single(Gains.of(1, stiffness, 0.1), rate=1000.0, gravity=[0.0, -9.81])
        assert (feedback_growth(arm, np.array([[np.pi / 2]])) > 0) is falls
        assert feedback_growth(arm, np.array([[-np.pi / 2]])) < 0
