"""Arms in one compiled loop over the periods of their controller, against step by step."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.control import held_periods
from flex_planner.control.controlled_motion import ControlledArm
from flex_planner.control.held_periods import HeldPeriods
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np
import pytest

UNTIL = 0.12
START = np.pad([-1.3, 0.3], (0, 8))


@pytest.fixture(scope='module')
def arm(workshop_arm: Arm) -> ControlledArm:
    gains = Gains(stiffness=np.array([60.0, 30.0]), damping=np.array([4.0, 2.0]))
    return ControlledArm(
        dynamics=ArmDynamics(workshop_arm),
        parameters=PhysicalParameters.of_arm(workshop_arm, payload_mass=0.3),
        controller=JointController(gains=gains, rate=200.0))


@pytest.fixture(scope='module')
def reference() -> JointReference:
    """Return a trajectory that asks for about as much as the motors can do, and for more."""
    rng, count = np.random.default_rng(3), 8
    positions, velocities, accelerations, torques = rng.uniform(-1, 1, (4, count, 2))
    return JointReference(
        times=np.linspace(0, 0.14, count), positions=START[:2] + 0.05 * positions,
        velocities=velocities, accelerations=10 * accelerations,
        torques=np.sign(torques) * (0.9 + 0.2 * np.abs(torques)) * [9.0, 5.0])


@pytest.mark.parametrize('hold', [EffortHold.MIDDLE, EffortHold.LINEAR])
def test_states_are_those_of_steps_that_are_cut_at_limits(
        arm: ControlledArm, reference: JointReference, hold: EffortHold) -> None:
    arm = replace(arm, controller=replace(arm.controller, hold=hold))
    exact = arm.follow(reference, START, UNTIL)
    found = HeldPeriods(reference, arm.controller, UNTIL).follow(arm, START)
    np.testing.assert_array_equal(found.times, exact.times)
    speeds = exact.states[:, 5:7]
    asked = np.abs(reference.torque(exact.times))
    assert (asked > TorqueLimits.of(arm.dynamics.arm).bounds(speeds)[1]).any()
    # tolerances of 1e-5 and 1e-8 in every step
    size = np.abs(exact.states).max(axis=0)
    assert (np.abs(found.states - exact.states) <= 1e-4 * size + 1e-7).all()
    assert not np.array_equal(found.states, exact.states)


def test_arm_that_runs_away_has_no_states_from_there(arm: ControlledArm,
                                                     reference: JointReference) -> None:
    start = np.where(np.arange(START.size) >= START.size // 2, 1e200, START)
    states = HeldPeriods(reference, arm.controller, UNTIL).follow(arm, start).states
    assert np.isfinite(states[0]).all() and np.isnan(states[1:]).all()


def test_without_a_compiler_steps_are_taken_one_by_one(
        arm: ControlledArm, reference: JointReference, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(held_periods, 'load_library', lambda: None)
    found = HeldPeriods(reference, arm.controller, 0.01).follow(arm, START)
    np.testing.assert_array_equal(found.states, arm.follow(reference, START, 0.01).states)


def test_monitor_stops_it(arm: ControlledArm, reference: JointReference) -> None:
    with pytest.raises(StoppedError):
        HeldPeriods(reference, arm.controller, UNTIL).follow(
            arm, START, Monitor(canceled=lambda: True))
