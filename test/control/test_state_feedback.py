"""Regulators and observers, against SciPy and by what they are made for."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.control import state_feedback
from flex_planner.control.state_feedback import LinearArm, NoFeedbackError, StateFeedback
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are


@pytest.fixture(scope='module')
def linear(workshop_arm: Arm) -> LinearArm:
    parameters = PhysicalParameters.of_arm(workshop_arm, payload_mass=0.3)
    return LinearArm.of(ArmDynamics.of(workshop_arm), np.array([-1.3, 0.3]), parameters, 500.0)


def feedback(linear: LinearArm, wander: float = 0.0) -> StateFeedback:
    correction, disturbance = linear.observe(1e-4, 0.3, wander)
    return StateFeedback(transition=linear.free, inputs=linear.forced, rate=linear.rate,
                         state_gain=linear.regulate(1e-3), observer_gain=correction,
                         disturbance_gain=disturbance)


def test_riccati_equation_is_solved(linear: LinearArm,
                                    monkeypatch: pytest.MonkeyPatch) -> None:
    found = linear.regulate(1e-3), *linear.observe(1e-4, 0.3, 3.0)
    monkeypatch.setattr(state_feedback, '_solve_riccati', solve_discrete_are)
    for ours, theirs in zip(found, (linear.regulate(1e-3), *linear.observe(1e-4, 0.3, 3.0)),
                            strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6 * np.abs(theirs).max())


def test_regulator_and_observer_keep_their_own_poles(linear: LinearArm) -> None:
    # the separation principle
    found = feedback(linear)
    together = np.linalg.eigvals(found.law().closed_loop(linear.free, linear.forced))
    n, size = found.state_gain.shape
    apart = np.concatenate([
        np.linalg.eigvals(linear.free - linear.forced @ found.state_gain),
        np.linalg.eigvals(linear.free @ (np.eye(size) - found.observer_gain @ np.eye(n, size)))])
    assert np.abs(together).max() < 1
    np.testing.assert_allclose(np.sort(np.abs(together)), np.sort(np.abs(apart)), atol=1e-6)


def steady_error(linear: LinearArm, wander: float) -> Array:
    """Return where joints stay under a torque of 1 N m beside the first motor [rad]."""
    loop = feedback(linear, wander).law().closed_loop(linear.free, linear.forced)
    push = np.zeros(len(loop))
    push[:linear.rest.size] = linear.forced[:, 0]
    steady: Array = np.linalg.solve(np.eye(len(loop)) - loop, push)[:2]
    return steady


def test_torque_beside_the_motors_is_taken_away_where_it_is_estimated(linear: LinearArm) -> None:
    assert np.abs(steady_error(linear, 0.0)).max() > 1e-4
    assert np.abs(steady_error(linear, 30.0)).max() < 1e-9


def test_dear_torques_make_soft_gains(linear: LinearArm) -> None:
    sizes = [np.abs(linear.regulate(price)).max() for price in (1e-3, 1e-1, 10.0)]
    assert sizes == sorted(sizes, reverse=True)


def test_projected_gain_is_the_whole_one_where_only_joints_move() -> None:
    rigid = LinearArm(rest=np.zeros(2), torque=np.zeros(1), free=np.array([[1, 1e-3], [0, 1]]),
                      forced=np.array([[5e-7], [1e-3]]), stiffness=np.zeros((1, 1)),
                      mass=np.eye(1), rate=1000.0)
    gain = rigid.regulate(1e-3)
    np.testing.assert_allclose(rigid.project(gain, 0.3), gain, rtol=1e-6)


def test_vibration_that_motors_do_not_reach_and_that_grows_has_no_gain(linear: LinearArm) -> None:
    lost = replace(linear, free=1.001 * np.eye(len(linear.free)),
                   forced=np.zeros_like(linear.forced))
    with pytest.raises(NoFeedbackError, match='no gain makes'):
        lost.regulate(1e-3)
